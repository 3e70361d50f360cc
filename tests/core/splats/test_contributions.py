"""Laws of what each splat contributes to pictures of the scene."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.contributions import contributions
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from tests.reference import contributions as reference

COLUMNS = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")


def scene(means, sigma, opacity=0.9, *, n_scales=3, seed=0) -> Splats:
    rng = np.random.default_rng(seed)
    n = len(means)
    opacities = np.broadcast_to(np.asarray(opacity, float), n)
    return Splats(
        means=np.asarray(means, np.float64),
        log_scales=np.log(sigma * rng.uniform(0.5, 2.0, (n, n_scales))),
        quats=rng.standard_normal((n, 4)),
        logit_opacities=np.log(opacities / (1 - opacities)),
        sh0=np.zeros((n, 3)),
        shN=np.zeros((n, 0, 3)),
    )


def oblong(n, seed=0):
    """Points in a box of which no two sides are equal."""
    return np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * [1.0, 0.7, 0.4]


def of(splats):
    return contributions(splats, occupancy_ellipses(splats))


def in_file_order(splats):
    ellipses = occupancy_ellipses(splats)
    values = np.zeros(splats.n_splats)
    values[ellipses.rows] = contributions(splats, ellipses).weights
    return values


@pytest.mark.parametrize("n_scales", [2, 3])
def test_the_fast_loop_is_the_slow_twin(n_scales):
    splats = scene(oblong(60), 0.08, np.random.default_rng(1).uniform(0.01, 0.99, 60), n_scales=n_scales)
    ellipses = occupancy_ellipses(splats)
    weights, peaks = reference.contributions(splats, ellipses, 128)
    found = contributions(splats, ellipses)
    # The loop looks a kernel's values up, and takes what lies between two for straight.
    np.testing.assert_allclose(found.weights, weights, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(found.peaks, peaks, rtol=1e-6, atol=1e-12)


def test_shuffling_the_file_changes_nothing():
    splats = scene(oblong(300), 0.05)
    order = np.random.default_rng(3).permutation(300)
    arrays = {name: getattr(splats, name)[order] for name in COLUMNS}
    np.testing.assert_allclose(
        in_file_order(replace(splats, **arrays)), in_file_order(splats)[order], rtol=1e-6, atol=1e-12
    )


def test_turning_moving_and_scaling_the_scene_changes_little_more_than_pixels():
    splats = scene(oblong(400), 0.06)
    turn = Rotation.random(random_state=5)
    x, y, z, w = turn.as_quat()
    a, b, c, d = splats.quats.T
    quats = np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=1,
    )
    turned = replace(
        splats,
        means=3.0 * turn.apply(splats.means) + [4.0, -1.0, 9.0],
        log_scales=splats.log_scales + np.log(3.0),
        quats=quats,
    )
    # The box of the subject is found by a descent: it turns with the points to within its tolerance.
    np.testing.assert_allclose(in_file_order(turned), in_file_order(splats), rtol=0.02, atol=1e-5)


@pytest.mark.parametrize("signs", [(-1, 1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1)])
def test_symmetries_of_the_dodecahedron_change_nothing(signs):
    splats = replace(scene(oblong(300), 0.05), log_scales=np.full((300, 3), np.log(0.05)))
    mirrored = replace(splats, means=splats.means * signs)
    np.testing.assert_allclose(in_file_order(mirrored), in_file_order(splats), rtol=1e-3, atol=1e-7)


def test_what_is_hidden_within_something_opaque_contributes_next_to_nothing():
    rng = np.random.default_rng(0)
    shell = rng.standard_normal((4000, 3))
    shell /= np.linalg.norm(shell, axis=1, keepdims=True)
    inside = 0.4 * oblong(300)
    splats = scene(np.concatenate([shell * [1.0, 0.8, 0.6], inside]), 0.04, 0.99)
    values = in_file_order(splats)
    # Gaussians have soft rims: a little light gets through between them.
    assert values[4000:].max() < 0.02 * values[:4000].mean()
    assert values[4000:].mean() < 1e-3 * values[:4000].mean()
    assert np.median(values[:4000]) > 0.1 * values[:4000].mean()


def test_a_faint_veil_contributes_as_much_as_it_is_opaque():
    sheet = np.random.default_rng(0).uniform(-1, 1, (2000, 3)) * [1.0, 0.7, 0.0]
    veil = sheet + np.array([0.0, 0.0, 0.2])
    splats = scene(np.concatenate([sheet, veil]), 0.03, np.repeat([0.99, 0.02], 2000))
    values = in_file_order(splats)
    # Half of the opaque ones are hidden behind others of their kind, the faint ones hide nothing.
    assert 0.01 < values[2000:].mean() / values[:2000].mean() < 0.1


def test_far_floaters_are_in_no_picture_and_hide_nothing():
    splats = scene(oblong(500), 0.05)
    rng = np.random.default_rng(0)
    far = rng.standard_normal((40, 3))
    far *= 8.0 / np.linalg.norm(far, axis=1, keepdims=True)
    arrays = {name: np.concatenate([getattr(splats, name), getattr(splats, name)[:40]]) for name in COLUMNS}
    arrays["means"][500:] = far
    with_floaters = in_file_order(replace(splats, **arrays))
    assert (with_floaters[500:] == 0.0).all()
    np.testing.assert_allclose(with_floaters[:500], in_file_order(splats), rtol=0.1, atol=1e-4)


@pytest.mark.parametrize("means", [np.zeros((1, 3)), np.zeros((5, 3)), np.eye(3)[[0]] * np.linspace(-1, 1, 9)[:, None]])
def test_scenes_without_extent_have_finite_contributions(means):
    found = of(scene(means, 0.1))
    assert np.isfinite(found.weights).all() and (found.weights > 0).all() and (found.peaks <= 1.0).all()


def test_of_very_many_splats_every_fifth_in_a_picture_stands_for_all(monkeypatch):
    """A sheet before another: on the mean, any kind of splat gives what it gives in full pictures."""
    means = np.concatenate([oblong(4000) * [1, 1, 0.02], oblong(4000, 1) * [0.6, 0.6, 0.02] + [0.0, 0.0, 0.3]])
    splats = scene(means, 0.02, np.random.default_rng(2).uniform(0.2, 0.99, len(means)))
    full = in_file_order(splats)
    monkeypatch.setattr("splap_editor.core.splats.contributions.MANY", len(means) - 1)
    some = in_file_order(splats)
    near, opaque = means[:, 2] > 0.15, splats.opacities > 0.6
    for part in (near, ~near, opaque, ~opaque):
        # What is grown reaches a little farther over the rims of the sheets.
        assert some[part].mean() == pytest.approx(full[part].mean(), rel=0.4)
    assert np.corrcoef(np.log(some + 1e-6), np.log(full + 1e-6))[0, 1] > 0.85


def test_an_empty_scene_has_none():
    splats = scene(oblong(3), 0.1, 1e-6)
    assert of(splats).weights.shape == (0,)


def test_it_tells_how_far_it_is_and_can_be_cancelled():
    splats, shares = scene(oblong(20), 0.1), []
    contributions(splats, occupancy_ellipses(splats), progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0

    def cancel(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        contributions(splats, occupancy_ellipses(splats), progress=cancel)
