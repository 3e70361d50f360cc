"""Graphs as PLY files that other programs read."""

import numpy as np
import plyfile
import pytest

from splap_editor.io.edges_ply import write_edges_ply
from splap_editor.io.ply import PlyError

POINTS = np.arange(12, dtype=np.float64).reshape(4, 3)
EDGES = np.array([[0, 1], [3, 1]])


def test_plyfile_reads_the_graph(tmp_path):
    write_edges_ply(tmp_path / "a.ply", POINTS, EDGES, np.array([0.25, np.inf]), np.array([1.5, 2.5]))
    ply = plyfile.PlyData.read(tmp_path / "a.ply")
    np.testing.assert_array_equal(np.stack([ply["vertex"][c] for c in "xyz"], axis=1), POINTS)
    np.testing.assert_array_equal(np.stack([ply["edge"]["vertex1"], ply["edge"]["vertex2"]], axis=1), EDGES)
    np.testing.assert_array_equal(ply["edge"]["offset"], [0.25, np.inf])
    np.testing.assert_array_equal(ply["edge"]["length"], [1.5, 2.5])


def test_a_graph_without_edges_is_written(tmp_path):
    none = np.empty(0)
    write_edges_ply(tmp_path / "a.ply", POINTS, np.empty((0, 2), int), none, none)
    assert len(plyfile.PlyData.read(tmp_path / "a.ply")["edge"].data) == 0


def test_arrays_that_do_not_match_are_refused(tmp_path):
    lengths = np.ones(2)
    for arguments, message in (
        ((POINTS[:, :2], EDGES, lengths, lengths), r"positions must have shape \(N, 3\), got \(4, 2\)"),
        ((POINTS, EDGES.astype(float), lengths, lengths), "edges must be whole numbers"),
        ((POINTS, EDGES[:, :1], lengths, lengths), "edges must be whole numbers of shape"),
        ((POINTS, EDGES + 1, lengths, lengths), "edges must be rows 0 to 3, got 1 to 4"),
        ((POINTS, EDGES, lengths[:1], lengths), r"offsets must have shape \(2,\), got \(1,\)"),
        ((POINTS, EDGES, lengths, lengths[:1]), r"lengths must have shape \(2,\), got \(1,\)"),
    ):
        with pytest.raises(ValueError, match=message):
            write_edges_ply(tmp_path / "a.ply", *arguments)
    with pytest.raises(PlyError, match="cannot be written"):
        write_edges_ply(tmp_path / "no" / "a.ply", POINTS, EDGES, lengths, lengths)
