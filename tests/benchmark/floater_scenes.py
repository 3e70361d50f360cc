"""Scenes in which an object is not equally dense, not equally opaque, or not alone: what is of it, is no floater."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from splap_editor.core.splats.main_subject import MainSubject, main_subject
from splap_editor.core.splats.splats import Splats

_PARTS = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")


def sparser(splats: Splats, rng: np.random.Generator, factor: float = 3.0, *, fades: bool = False) -> Splats:
    """One half, or all of it more and more, with splats ``factor`` times larger and the square of that fewer."""
    means = np.asarray(splats.means, np.float64)
    along = (means - np.median(means, axis=0)) @ rng.normal(size=3)
    along /= np.abs(along).max()
    return _thinned(splats, rng, np.clip(0.5 + along, 0.0, 1.0) if fades else 1.0 * (along > 0.0), factor)


def sparse_patch(splats: Splats, rng: np.random.Generator) -> Splats:
    """A ball about a place on the object with a ninth of its splats."""
    means = np.asarray(splats.means, np.float64)
    inside = np.linalg.norm(means - means[rng.integers(len(means))], axis=1) < 0.25 * _subject(splats).size
    return _thinned(splats, rng, 1.0 * inside, 3.0)


def half_transparent(splats: Splats, rng: np.random.Generator) -> Splats:
    """One side a tenth to four tenths as opaque as it was."""
    means = np.asarray(splats.means, np.float64)
    along = (means - np.median(means, axis=0)) @ rng.normal(size=3)
    side = along > np.quantile(along, rng.uniform(0.4, 0.7))
    opacities = np.asarray(splats.opacities, np.float64)
    opacities = np.clip(np.where(side, opacities * rng.uniform(0.1, 0.4), opacities), 1e-4, 1.0 - 1e-6)
    return replace(splats, logit_opacities=np.log(opacities / (1.0 - opacities)))


def two_objects(splats: Splats, rng: np.random.Generator) -> Splats:
    """The object, and a smaller one of fewer splats beside it."""
    kept = rng.random(splats.n_splats) < rng.uniform(0.25, 0.6)
    subject, factor = _subject(splats), rng.uniform(0.3, 0.7)
    shift = _unit(rng.normal(size=3)) * subject.size * rng.uniform(1.0, 1.4)
    second = splats.at(kept)
    means = (np.asarray(second.means, np.float64) - subject.center) * factor + subject.center + shift
    log_scales = np.asarray(second.log_scales, np.float64) + np.log(factor / np.sqrt(kept.mean()))
    return _joined(splats, replace(second, means=means, log_scales=log_scales))


def on_a_plate(splats: Splats, rng: np.random.Generator) -> Splats:
    """The object before a large, sparser plate."""
    subject, number = _subject(splats), int(rng.integers(3))
    axes = np.array([_unit(half_axis) for half_axis in subject.half_axes])
    a, b = (axes[other] for other in range(3) if other != number)
    n, width = int(splats.n_splats * rng.uniform(0.15, 0.4)), subject.size * rng.uniform(0.7, 1.1)
    low = ((np.asarray(splats.means, np.float64) - subject.center) @ axes[number]).min() - 0.01 * subject.size
    heights = low + 0.004 * subject.size * rng.normal(size=(n, 1))
    places = rng.uniform(-width, width, (n, 2)) @ np.array([a, b]) + subject.center + heights * axes[number]
    frames = Rotation.from_matrix(np.repeat(np.stack([a, b, np.cross(a, b)], 1)[None], n, 0))
    frames *= Rotation.from_rotvec(np.deg2rad(6.0) * rng.normal(size=(n, 3)) * [1, 1, 0])
    frames *= Rotation.from_rotvec(rng.uniform(0.0, 2.0 * np.pi, (n, 1)) * [0, 0, 1])
    spread = np.exp(0.3 * rng.normal(size=(n, 1)) - 0.1 + rng.normal(0.0, 0.25, (n, 3)))
    return _joined(splats, _laid(splats, rng, places, frames, np.sqrt(4.0 * width**2 / n) * spread * [1, 1, 0.1]))


def with_bars(splats: Splats, rng: np.random.Generator) -> Splats:
    """The object with thin bars of needles that stand out of it."""
    subject, means, made = _subject(splats), np.asarray(splats.means, np.float64), splats
    spacing = 2.0 * np.exp(np.median(np.asarray(splats.log_scales, np.float64)[:, :2]))
    for _ in range(int(rng.integers(2, 6))):
        foot, along = means[rng.integers(len(means))], _unit(rng.normal(size=3))
        along = along if along @ (foot - subject.center) >= 0.0 else -along
        length, radius = subject.size * rng.uniform(0.2, 0.5), subject.size * rng.uniform(0.003, 0.012)
        n = max(20, int(length / spacing * rng.uniform(2.0, 6.0)))
        out = rng.normal(size=(n, 3))
        out -= np.outer(out @ along, along)
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        places = foot + rng.random((n, 1)) * length * along + radius * out
        frames = Rotation.from_matrix(np.stack([np.repeat(along[None], n, 0), np.cross(out, along), out], 2))
        needles = np.exp(0.3 * rng.normal(size=n)) * 3.0 * length / n, radius * np.exp(0.2 * rng.normal(size=n))
        made = _joined(made, _laid(splats, rng, places, frames, np.column_stack([*needles, np.full(n, 0.1 * radius)])))
    return made


KINDS: dict[str, Callable[[Splats, np.random.Generator], Splats]] = {
    "even": lambda splats, rng: splats,
    "half 9 times sparser": sparser,
    "half 4 times sparser": lambda splats, rng: sparser(splats, rng, 2.0),
    "half 16 times sparser": lambda splats, rng: sparser(splats, rng, 4.0),
    "fading to 16 times": lambda splats, rng: sparser(splats, rng, 4.0, fades=True),
    "sparse patch": sparse_patch,
    "half transparent": half_transparent,
    "two objects": two_objects,
    "plate behind": on_a_plate,
    "thin bars": with_bars,
}
"""What is made of a clean object before floaters are added."""


def _thinned(splats, rng, share, factor):
    factors = factor ** np.asarray(share)
    kept = rng.random(splats.n_splats) < factors**-2
    return replace(splats, log_scales=np.asarray(splats.log_scales, np.float64) + np.log(factors)[:, None]).at(kept)


def _laid(splats, rng, places, frames, scales):
    opacities = np.clip(rng.beta(4.0, 1.5, len(places)), 0.05, 0.995)
    return replace(
        splats.at(rng.choice(splats.n_splats, len(places))),
        means=places,
        log_scales=np.log(scales[:, : splats.n_scales]),
        quats=frames.as_quat()[:, [3, 0, 1, 2]],
        logit_opacities=np.log(opacities / (1.0 - opacities)),
    )


def _joined(first: Splats, second: Splats) -> Splats:
    parts = {n: np.concatenate([np.asarray(getattr(first, n)), np.asarray(getattr(second, n))]) for n in _PARTS}
    return replace(first, **parts, thresholds=None)


def _subject(splats: Splats) -> MainSubject:
    return main_subject(np.asarray(splats.means, np.float64), splats.opacities)


def _unit(vector):
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
