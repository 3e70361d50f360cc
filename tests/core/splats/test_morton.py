import numpy as np

from splap_editor.core.splats.morton import morton_codes, morton_order


def test_the_order_is_a_permutation_that_sorts_the_codes():
    points = np.random.default_rng(0).normal(size=(500, 3))
    order = morton_order(points)
    assert np.array_equal(np.sort(order), np.arange(500))
    assert (np.diff(morton_codes(points)[order].astype(np.int64)) >= 0).all()


def test_the_order_of_points_does_not_depend_on_the_order_they_come_in():
    rng = np.random.default_rng(1)
    # Far apart overall, so that each of the two clusters falls into one cell of the curve.
    points = np.concatenate([rng.uniform(size=(100, 3)) * 1e-9, 1e6 + rng.uniform(size=(100, 3)) * 1e-9])
    shuffle = rng.permutation(200)
    again = points[shuffle]
    assert np.array_equal(points[morton_order(points)], again[morton_order(again)])


def test_codes_visit_the_octants_with_x_fastest():
    corners = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    assert (np.diff(morton_codes(corners).astype(np.int64)) > 0).all()


def test_neighbours_on_the_curve_are_near_in_space():
    points = np.random.default_rng(2).uniform(size=(4096, 3))
    steps = np.linalg.norm(np.diff(points[morton_order(points)], axis=0), axis=1)
    # The mean distance of random points in the unit cube is 0.66; a perfect tour would take 1/16.
    assert steps.mean() < 0.15


def test_no_points_and_coinciding_points_have_an_order():
    assert len(morton_order(np.empty((0, 3)))) == 0
    assert np.array_equal(morton_order(np.ones((5, 3))), np.arange(5))
