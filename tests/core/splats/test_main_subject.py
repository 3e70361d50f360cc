"""The size of what a capture is of must not follow what floats about it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from splap_editor.core.splats.main_subject import main_subject
from splap_editor.core.splats.smallest_box import smallest_box
from splap_editor.io.ply import read_ply
from splap_editor.io.sample_maker import STYLES, shape_sample
from splap_editor.resources import resource

SHARE = 0.3
"""So many of all splats are haze or floaters."""


def _capture(name):
    """Centres and opacities of a bundled sample, or of splats laid on a shape."""
    if name.endswith("ply"):
        splats = read_ply(resource("samples", name)).splats
    else:
        shape, style = name.split()
        splats = shape_sample(shape, 10_000, STYLES[style]).splats
    return np.asarray(splats.means, np.float64), splats.opacities


CAPTURES = {
    name: _capture(name)
    for name in (
        "bench_2dgs.ply",
        "windmill_2dgs.ply",
        "coil.ply",
        "tube.ply",
        "comb trained",
        "book thin",
        "bench thin",
    )
}
CLEAN = {name: main_subject(*capture) for name, capture in CAPTURES.items()}


def _near_haze(n, rng):
    return rng.uniform(-1.0, 1.0, (n, 3))


def _wide_haze(n, rng):
    away = rng.normal(size=(n, 3))
    return away / np.linalg.norm(away, axis=1, keepdims=True) * np.exp(rng.uniform(0.0, np.log(5.0), (n, 1)))


def _clusters(n, rng):
    centers = rng.normal(size=(6, 3))
    centers *= rng.uniform(1.0, 5.0, (6, 1)) / np.linalg.norm(centers, axis=1, keepdims=True)
    return centers[rng.integers(6, size=n)] + rng.normal(size=(n, 3)) * 0.08


def _one_cluster(n, rng):
    return np.array([1.5, 0.3, 0.2]) + rng.normal(size=(n, 3)) * 0.05


def _far(n, rng):
    away = rng.normal(size=(n, 3))
    return away / np.linalg.norm(away, axis=1, keepdims=True) * rng.uniform(5.0, 100.0, (n, 1))


@pytest.mark.parametrize("floaters", [_near_haze, _wide_haze, _clusters, _one_cluster, _far])
@pytest.mark.parametrize("name", CAPTURES)
def test_floaters_leave_the_subject(name, floaters):
    rng = np.random.default_rng(5)
    (means, opacities), clean = CAPTURES[name], CLEAN[name]
    n = round(SHARE / (1.0 - SHARE) * len(means))
    points = np.concatenate([means, clean.center + clean.size * floaters(n, rng)])
    turn = Rotation.random(random_state=1)
    found = main_subject(turn.apply(points), np.concatenate([opacities, rng.uniform(0.02, 0.6, n)]))
    assert abs(found.size / clean.size - 1.0) < 0.05
    assert np.linalg.norm(turn.inv().apply(found.center) - clean.center) < 0.05 * clean.size
    assert (found.seen or found).size < 1.05 * clean.size


def _beside(dense, sparse, *, every, gap=0.01):
    """A thing as dense as a strap, and one as large of few, half-transparent splats at its side, so far off it."""
    rng = np.random.default_rng(4)
    (means, opacities), clean = CAPTURES[dense], CLEAN[dense]
    means = np.concatenate([means, means + rng.normal(size=means.shape) * 0.002 * clean.size])
    few, faint = CAPTURES[sparse]
    few, faint = few[::every], 0.5 * faint[::every]
    few = clean.size / np.ptp(few, axis=0).max() * (few - few.mean(axis=0)) + clean.center
    axis = clean.half_axes[1] / np.linalg.norm(clean.half_axes[1])
    tree = cKDTree(means)
    # From outside inwards until they are as near as wanted.
    for away in np.arange(1.5, 0.0, -0.01) * clean.size:
        if tree.query(few + away * axis)[0].min() <= gap * clean.size:
            break
    few += away * axis
    points = np.concatenate([means, few])
    return points, np.concatenate([opacities, opacities, faint]), np.arange(len(means), len(points))


@pytest.mark.parametrize("floaters", [None, _near_haze, _clusters, _one_cluster])
@pytest.mark.parametrize(
    ("dense", "sparse", "every"), [("windmill_2dgs.ply", "bench thin", 8), ("comb trained", "bench_2dgs.ply", 16)]
)
def test_a_sparse_part_beside_a_dense_one_is_seen_and_changes_no_size(dense, sparse, every, floaters):
    rng = np.random.default_rng(8)
    means, opacities, part = _beside(dense, sparse, every=every)
    clean, points = CLEAN[dense], means
    if floaters is not None:
        n = round(SHARE / (1.0 - SHARE) * len(means))
        points = np.concatenate([means, clean.center + clean.size * floaters(n, rng)])
        opacities = np.concatenate([opacities, rng.uniform(0.02, 0.6, n)])
    found = main_subject(points, opacities)
    assert abs(found.size / clean.size - 1.0) < 0.05
    assert not found.holds(means[part], room=0.05 * clean.size).all()
    # Splats at the end of a thin part have few neighbours; what is about the subject in the picture has room for them.
    assert found.seen.holds(means[part], room=0.02 * clean.size).mean() > 0.98
    # Both and no more.
    assert found.seen.size < 1.05 * 2.0 * np.linalg.norm(smallest_box(means)[1][0])


def test_what_goes_on_far_beyond_or_stands_apart_is_no_part():
    means, _ = CAPTURES["bench thin"]
    rng = np.random.default_rng(3)
    floor = np.column_stack([rng.uniform(-5.0, 5.0, (3000, 2)), np.full(3000, means[:, 2].min() - 0.01)])
    assert main_subject(np.concatenate([means, floor]), np.ones(len(means) + 3000)).seen is None
    apart, faint, _ = _beside("comb trained", "bench_2dgs.ply", every=16, gap=0.2)
    assert main_subject(apart, faint).seen is None


@pytest.mark.parametrize("name", CAPTURES)
def test_turning_shuffling_and_scaling_a_capture_turns_and_scales_its_subject(name):
    (means, opacities), clean = CAPTURES[name], CLEAN[name]
    order = np.random.default_rng(2).permutation(len(means))
    turn, shift = Rotation.from_rotvec([1.0, -0.4, 2.0]), np.array([3.0, -7.0, 20.0])
    found = main_subject(4.0 * turn.apply(means[order]) + shift, opacities[order])
    # The search for the smallest box stops at angles of 1e-8.
    np.testing.assert_allclose(found.size, 4.0 * clean.size, rtol=1e-6)
    np.testing.assert_allclose(found.center, 4.0 * turn.apply(clean.center) + shift, atol=1e-5)


def test_samples_of_more_splats_than_are_looked_at_turn_with_the_capture():
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(90_000, 3))
    means = directions / np.linalg.norm(directions, axis=1, keepdims=True) * [2.0, 1.0, 0.5]
    opacities = np.round(rng.uniform(0.3, 1.0, len(means)), 2)
    clean = main_subject(means, opacities)
    assert abs(clean.size - 4.0) < 0.04
    turned = main_subject(Rotation.from_rotvec([1.0, -0.4, 2.0]).apply(means), opacities)
    np.testing.assert_allclose(turned.size, clean.size, rtol=1e-6)


@pytest.mark.parametrize("name", CAPTURES)
def test_the_size_of_a_clean_capture_is_about_its_longest_side(name):
    # At any angle a box may be a little shorter than along the axes.
    assert 0.95 < CLEAN[name].size / np.ptp(CAPTURES[name][0], axis=0).max() < 1.01


def test_two_equal_things_far_apart_are_both_the_subject_but_a_small_one_is_not():
    means, opacities = CAPTURES["bench thin"]
    both = main_subject(np.concatenate([means, means + np.array([6.0, 0, 0])]), np.tile(opacities, 2))
    assert abs(both.size - 8.6) < 0.1
    few = means[::4] + np.array([6.0, 0, 0])
    one = main_subject(np.concatenate([means, few]), np.concatenate([opacities, opacities[::4]]))
    assert abs(one.size - 2.6) < 0.1


def test_a_part_close_to_the_subject_is_part_of_it():
    means, opacities = CAPTURES["bench thin"]
    small = means[::8] * 0.3 + [1.3 + 0.39 + 0.1, 0.0, 0.0]
    found = main_subject(np.concatenate([means, small]), np.concatenate([opacities, opacities[::8]]))
    assert abs(found.size - (2.6 + 0.1 + 0.78)) < 0.1


@pytest.mark.parametrize("n", [0, 1, 2, 40])
def test_coinciding_points_have_no_size(n):
    subject = main_subject(np.ones((n, 3)), np.ones(n))
    assert subject.size < 1e-12
    np.testing.assert_allclose(subject.center, np.ones(3) if n else np.zeros(3))


def test_a_handful_of_points_is_boxed_as_it_is():
    assert np.isclose(main_subject(np.array([[0.0, 0, 0], [0, 2, 0]]), np.ones(2)).size, 2.0)


def test_corners_and_what_lies_between_them():
    subject = CLEAN["bench thin"]
    assert subject.corners.shape == (8, 3)
    np.testing.assert_allclose(subject.corners.mean(axis=0), subject.center, atol=1e-12)
    assert subject.holds(subject.corners, room=1e-9).all()
    out = subject.center + 1.1 * (subject.corners - subject.center)
    assert not subject.holds(out, room=1e-9).any()
    assert subject.holds(out, room=0.1 * subject.size).all()
