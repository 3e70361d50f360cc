import numpy as np
import pytest

from splap_editor.core.handle_nodes import Region, handle_nodes
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.splats.occupancy import Ellipses


def _ellipses(centers, inert_rows=()):
    """Active splats in file order, after the inert rows are taken out."""
    n_splats = len(centers) + len(inert_rows)
    inert = np.zeros(n_splats, np.uint8)
    inert[list(inert_rows)] = 1
    n = len(centers)
    return Ellipses(
        rows=np.flatnonzero(inert == 0),
        centers=np.asarray(centers, np.float64),
        semi_axes=np.tile(np.eye(3)[:2], (n, 1, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (n, 1)),
        cutoffs=np.ones(n),
        axes=np.tile(np.array([0, 1, 2], np.int8), (n, 1)),
        opacities=np.ones(n),
        subject=MainSubject(10.0, np.zeros(3), 5.0 * np.eye(3)),
        n_splats=n_splats,
        inert=inert,
    )


LINE = _ellipses(np.stack([np.arange(11.0), np.zeros(11), np.zeros(11)], axis=1))


def _at(x, radius=0.0):
    return Region(np.array([x, 0.0, 0.0]), radius)


def test_a_handle_holds_what_is_within_its_radius():
    handles = handle_nodes(LINE, [_at(2.0, 1.0)])
    assert handles.indices.tolist() == [1, 2, 3]
    assert handles.labels.tolist() == [0, 0, 0]
    np.testing.assert_array_equal(handles.centers, [[2.0, 0.0, 0.0]])
    np.testing.assert_array_equal(handles.cage_radii, [np.inf])


def test_a_handle_with_nothing_within_its_radius_holds_the_nearest():
    assert handle_nodes(LINE, [_at(4.4, 0.1)]).indices.tolist() == [4]


def test_rows_are_file_rows_and_inert_ones_are_passed_over():
    ellipses = _ellipses(LINE.centers, inert_rows=(0, 5))
    region = Region(np.zeros(3), rows=np.array([0, 1, 5, 6]))
    assert handle_nodes(ellipses, [region]).indices.tolist() == [0, 4]


def test_rows_that_are_all_inert_give_the_nearest_active_splat():
    ellipses = _ellipses(LINE.centers, inert_rows=(0, 5))
    region = Region(np.array([7.1, 0.0, 0.0]), rows=np.array([0, 5]))
    assert handle_nodes(ellipses, [region]).indices.tolist() == [7]


def test_earlier_handles_win_over_later_ones_and_handles_over_pins():
    handles = handle_nodes(LINE, [_at(2.0, 1.0), _at(3.0, 1.0)], [_at(4.0, 2.0)])
    assert handles.indices.tolist() == [1, 2, 3, 4, 5, 6]
    assert handles.labels.tolist() == [0, 0, 0, 1, -1, -1]


def test_far_splats_are_pinned_by_their_distance_from_every_handled_splat():
    handles = handle_nodes(LINE, [_at(2.0, 1.0), _at(9.0)], free_radius=2.0)
    # Free are 0 and 4, 5 beside the first handle, 7, 8 and 10 beside the second; 6 is three from either.
    assert handles.indices.tolist() == [1, 2, 3, 6, 9]
    assert handles.labels.tolist() == [0, 0, 0, -1, 1]


def test_what_only_holds_frees_nothing_about_it():
    handles = handle_nodes(LINE, [_at(2.0, 1.0), _at(9.0)], free_radius=2.0, frees=[True, False])
    assert handles.indices.tolist() == [1, 2, 3, 6, 7, 8, 9, 10]
    assert handles.labels.tolist() == [0, 0, 0, -1, -1, -1, 1, -1]
    alone = handle_nodes(LINE, [_at(9.0)], free_radius=2.0, frees=[False])
    assert alone.indices.tolist() == handle_nodes(LINE, [_at(9.0)], free_radius=2.0).indices.tolist()
    with pytest.raises(ValueError, match=r"frees must have shape \(1,\)"):
        handle_nodes(LINE, [_at(0.0)], frees=[True, False])


def test_without_handles_the_free_radius_pins_nothing():
    handles = handle_nodes(LINE, [], [_at(0.0)], free_radius=1.0)
    assert handles.indices.tolist() == [0]
    assert handles.n_handles == 0
    assert handles.centers.shape == (0, 3)


def test_rejects_bad_regions():
    with pytest.raises(ValueError, match="three finite numbers"):
        handle_nodes(LINE, [Region(np.array([0.0, np.nan, 0.0]))])
    with pytest.raises(ValueError, match="radius must not be negative"):
        handle_nodes(LINE, [_at(0.0, -1.0)])
    with pytest.raises(ValueError, match="row 11 is outside"):
        handle_nodes(LINE, [Region(np.zeros(3), rows=np.array([3, 11]))])
    with pytest.raises(ValueError, match="free_radius"):
        handle_nodes(LINE, [_at(0.0)], free_radius=-1.0)
    with pytest.raises(ValueError, match=r"cage_radii must have shape \(1,\)"):
        handle_nodes(LINE, [_at(0.0)], cage_radii=[1.0, 2.0])
    with pytest.raises(ValueError, match="no splat of this scene is active"):
        handle_nodes(_ellipses(np.empty((0, 3))), [_at(0.0)])
