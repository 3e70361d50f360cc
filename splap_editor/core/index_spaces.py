"""The ways in which splats are numbered, and how to get from one to another.

An index means nothing without the space it counts in. A signature says which
by these names, and a variable by its own: ``rows`` and ``row``, ``nodes`` and
``node``, ``places``, ``problem_rows``. ::

    file row ── ellipses.node_of_row ──▶ node ◀── problem.nodes ── problem row
             ◀── ellipses.rows ─────────      ◀── tree.nodes ───── place by size
             ◀── depth_order ── place from back to front

==============  =====================================================================================================
file row        Line of the file's table, 0..N-1. What a person, a recipe and a picture know; masks (N,) go by it.
node            Active splat, 0..n-1, along a Morton curve; inert splats have none (-1). Graph and solvers go by it.
place           Position in an order of them: by size, carried (nodes first, then the inert), or back to front.
problem row     Row of one minimisation: the nodes it has to know, in ascending order; the free ones are its unknowns.
==============  =====================================================================================================
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FileRow: TypeAlias = int
FileRows: TypeAlias = NDArray[np.integer]
"""(k,) file rows, or (E, 2) where they come in pairs."""
FileMask: TypeAlias = NDArray[np.bool_]
"""(N,) which file rows."""
RowPair: TypeAlias = tuple[FileRow, FileRow]
"""An edge as a recipe has it."""

Node: TypeAlias = int
Nodes: TypeAlias = NDArray[np.integer]
"""(k,) nodes, or (E, 2) where they come in pairs."""
NodeMask: TypeAlias = NDArray[np.bool_]
"""(n,) which nodes."""

Places: TypeAlias = NDArray[np.integer]
"""(n,) place of each node in an order."""
RowsByPlace: TypeAlias = NDArray[np.integer]
"""(N,) file row at each place of an order, such as back to front."""
NodesByPlace: TypeAlias = NDArray[np.integer]
"""(n,) node at each place of an order."""

ProblemRows: TypeAlias = NDArray[np.integer]
"""(k,) rows of a linear system."""
