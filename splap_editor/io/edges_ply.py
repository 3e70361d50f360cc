"""The splat graph as a PLY of vertices and edges."""

import os

import numpy as np
from numpy.typing import NDArray

from splap_editor.io.atomic_file import whole_file
from splap_editor.io.ply_header import PlyError

_EDGE = np.dtype([("vertex1", "<i4"), ("vertex2", "<i4"), ("offset", "<f4"), ("length", "<f4")])


def write_edges_ply(
    path: str | os.PathLike[str],
    positions: NDArray[np.floating],
    edges: NDArray[np.integer],
    offsets: NDArray[np.floating],
    lengths: NDArray[np.floating],
) -> None:
    """Write a graph as a binary PLY, whole or not at all.

    Parameters
    ----------
    path : path
        File to create or replace.
    positions : (N, 3) float
        Every splat's centre, in file order; world units.
    edges : (E, 2) int
        The two file rows that each edge joins.
    offsets, lengths : (E,) float
        Normal-wise offset δ and distance of the centres, world units. An
        offset of +inf says that neither normal column meets the other ellipse.

    Raises
    ------
    PlyError
        If the file cannot be written.
    ValueError
        If the arrays do not match.
    """
    positions, edges = np.asarray(positions), np.asarray(edges)
    n_edges = len(edges)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise ValueError(f"positions must have shape (N, 3), got {positions.shape}")
    if edges.shape != (n_edges, 2) or edges.dtype.kind not in "iu":
        raise ValueError(f"edges must be whole numbers of shape (E, 2), got {edges.dtype} {edges.shape}")
    if n_edges and not (edges.min() >= 0 and edges.max() < len(positions)):
        raise ValueError(f"edges must be rows 0 to {len(positions) - 1}, got {edges.min()} to {edges.max()}")
    table = np.empty(n_edges, _EDGE)
    table["vertex1"], table["vertex2"] = edges.T
    for name, values in (("offset", offsets), ("length", lengths)):
        if np.shape(values) != (n_edges,):
            raise ValueError(f"{name}s must have shape ({n_edges},), got {np.shape(values)}")
        table[name] = values
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(positions)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element edge {n_edges}",
        "property int vertex1",
        "property int vertex2",
        "property float offset",
        "property float length",
        "end_header",
    ]
    with whole_file(path, PlyError) as file:
        file.write(("\n".join(header) + "\n").encode())
        file.write(np.ascontiguousarray(positions, "<f4").tobytes())
        file.write(table.tobytes())
