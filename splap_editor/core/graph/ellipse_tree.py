"""Search among ellipses of very different sizes for those that touch one another.

The ellipses are split into classes of similar size, each with its own implicit
binary tree over its Morton order:

    slot 1 ─┬─ 2 ─┬─ 4 ── leaf: ellipses 0 to 3 of the class
            │     └─ 5 ── leaf: ellipses 4 to 7
            └─ 3 ─┬─ 6 …

A slot knows the box of its centres and how far its ellipses extend from them
along each axis, which bounds the touch scale from below: along any direction,
``|p_i - p_j| ≤ f (extent_i + extent_j) + ε``. With the sizes in one tree alike,
a handful of huge ellipses loosens no bound but theirs.
"""

from dataclasses import dataclass
from itertools import pairwise

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.ellipse_offset import disc_rows, one_way_touch, two_way_touch
from splap_editor.core.index_spaces import NodesByPlace, Places
from splap_editor.core.splats.occupancy import Ellipses

_LEAF = 4
_BLOCK = 1024
_CLASS_RATIO = 3.0
"""Largest over smallest reach in one size class."""


@dataclass(frozen=True, eq=False)
class EllipseTree:
    """Ellipses sorted by size class, then along the Morton curve, with a tree of boxes per class.

    Parameters
    ----------
    nodes : (n,) int64
        Node at each place of the sorted order.
    places : (n,) int64
        Place of each node, the inverse.
    discs : (n, 12) float64
        `ellipse_offset.disc_rows` in the sorted order.
    reaches : (n,) float64
        Major semi-axes in the sorted order, world units.
    classes : (C, 4) int64
        First place, end place, first slot and number of leaves (a power of two)
        of each class, small ellipses first. Slot 1 of a class is its root.
    boxes : (S, 9) float64
        Least and greatest corner of the centres and largest extents along x, y, z in each slot; an
        empty slot's box is inverted and infinitely far from everything.
    """

    nodes: NodesByPlace
    places: Places
    discs: NDArray[np.float64]
    reaches: NDArray[np.float64]
    classes: NDArray[np.int64]
    boxes: NDArray[np.float64]

    @property
    def arrays(self) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
        """What the compiled searches take, in their order: nodes, discs, reaches, classes, boxes."""
        return self.nodes, self.discs, self.reaches, self.classes, self.boxes

    def label_ranges(self, labels: NDArray[np.integer]) -> NDArray[np.int32]:
        """Least and greatest label in each slot.

        Parameters
        ----------
        labels : (n,) int
            A label per place of the sorted order.

        Returns
        -------
        (S, 2) int32
            An empty slot has its least above its greatest.
        """
        values = np.stack([labels, labels], axis=1).astype(np.int32)
        ranges = np.empty((len(self.boxes), 2), np.int32)
        top = np.iinfo(np.int32).max
        for first, end, slot, n_leaves in self.classes:
            padded = np.tile(np.array([top, -1], np.int32), (n_leaves * _LEAF, 1))
            padded[: end - first] = values[first:end]
            blocks = padded.reshape(n_leaves, _LEAF, 2)
            level = np.stack([blocks[:, :, 0].min(axis=1), blocks[:, :, 1].max(axis=1)], axis=1)
            while True:
                ranges[slot + len(level) : slot + 2 * len(level)] = level
                if len(level) == 1:
                    break
                level = np.stack(
                    [np.minimum(level[::2, 0], level[1::2, 0]), np.maximum(level[::2, 1], level[1::2, 1])], axis=1
                )
        return ranges


def ellipse_tree(ellipses: Ellipses) -> EllipseTree:
    """Sort ellipses for searching.

    Parameters
    ----------
    ellipses : Ellipses
        Occupancy ellipses; none at all gives a tree without classes.

    Returns
    -------
    EllipseTree
        About 250 bytes per ellipse.
    """
    reaches = ellipses.reaches
    smallest = float(reaches.min(initial=np.inf))
    sizes = (np.log(reaches / smallest) / np.log(_CLASS_RATIO)).astype(np.int64)
    nodes = np.argsort(sizes, kind="stable")
    places = np.empty_like(nodes)
    places[nodes] = np.arange(len(nodes))
    reaches = reaches[nodes]
    rows = disc_rows(ellipses)[nodes]
    extents = np.sqrt(rows[:, 3:6] ** 2 + rows[:, 6:9] ** 2)
    bounds = np.append(np.flatnonzero(np.diff(sizes[nodes], prepend=-1)), len(nodes))
    classes = np.zeros((len(bounds) - 1, 4), np.int64)
    boxes, slot = [], 0
    for c, (first, end) in enumerate(pairwise(bounds)):
        box = _class_boxes(rows[first:end, :3], extents[first:end])
        classes[c] = first, end, slot, len(box) // 2
        boxes.append(box)
        slot += len(box)
    return EllipseTree(nodes, places, rows, reaches, classes, np.concatenate(boxes) if boxes else np.empty((0, 9)))


def _class_boxes(centers: NDArray[np.float64], extents: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2 leaves, 9) boxes of one class's slots; slot 0 is unused."""
    n_leaves = 1 << (-(-len(centers) // _LEAF) - 1).bit_length()
    padded = np.full((n_leaves * _LEAF, 9), -np.inf)
    # Negated least corners, so that one maximum serves all nine.
    padded[: len(centers), :3] = -centers
    padded[: len(centers), 3:6] = centers
    padded[: len(centers), 6:] = extents
    boxes = np.empty((2 * n_leaves, 9))
    level = padded.reshape(n_leaves, _LEAF, 9).max(axis=1)
    while True:
        boxes[len(level) : 2 * len(level)] = level
        if len(level) == 1:
            break
        level = np.maximum(level[::2], level[1::2])
    boxes[:, :3] *= -1.0
    boxes[0] = 0.0
    return boxes


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _extents(discs, i):
    """How far an ellipse extends from its centre along x, y and z."""
    return (
        np.sqrt(discs[i, 3] ** 2 + discs[i, 6] ** 2),
        np.sqrt(discs[i, 4] ** 2 + discs[i, 7] ** 2),
        np.sqrt(discs[i, 5] ** 2 + discs[i, 8] ** 2),
    )


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _box_bound(boxes, slot, discs, i, extents, epsilon):
    """Least touch scale that any ellipse of a slot can have with this one, and squared distance to the slot's box.

    Both inf for an empty slot.
    """
    dx = max(boxes[slot, 0] - discs[i, 0], discs[i, 0] - boxes[slot, 3], 0.0)
    dy = max(boxes[slot, 1] - discs[i, 1], discs[i, 1] - boxes[slot, 4], 0.0)
    dz = max(boxes[slot, 2] - discs[i, 2], discs[i, 2] - boxes[slot, 5], 0.0)
    squared = dx * dx + dy * dy + dz * dz
    if squared == np.inf:
        return np.inf, np.inf
    # The floor stands for extents that vanish, along the normal of an ellipse that lies along the axes.
    x = (dx - epsilon) / max(extents[0] + boxes[slot, 6], 1e-290)
    y = (dy - epsilon) / max(extents[1] + boxes[slot, 7], 1e-290)
    z = (dz - epsilon) / max(extents[2] + boxes[slot, 8], 1e-290)
    return max(x, y, z) * (1.0 - 1e-12), squared


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _may_touch_one_way(discs, reaches, i, j, epsilon, limit):
    """Whether the touch scale in at least one direction may be within the limit: the extents along the centre line."""
    x, y, z = discs[j, 0] - discs[i, 0], discs[j, 1] - discs[i, 1], discs[j, 2] - discs[i, 2]
    squared = x * x + y * y + z * z
    # The factor allows for rounding: a pair at the limit must be looked at from both of its ends.
    limit *= 1.0 + 1e-12
    if squared > (limit * (reaches[i] + reaches[j]) + epsilon) ** 2:
        return False
    a = (x * discs[i, 3] + y * discs[i, 4] + z * discs[i, 5]) ** 2
    b = (x * discs[j, 3] + y * discs[j, 4] + z * discs[j, 5]) ** 2
    a += (x * discs[i, 6] + y * discs[i, 7] + z * discs[i, 8]) ** 2
    b += (x * discs[j, 6] + y * discs[j, 7] + z * discs[j, 8]) ** 2
    return squared <= limit * (np.sqrt(a) + np.sqrt(b)) + epsilon * np.sqrt(squared)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _may_meet(discs, i, j, epsilon, limit):
    """Whether the heights of ellipse j, grown to the limit, above ellipse i come within the tolerance."""
    nx, ny, nz = discs[i, 9], discs[i, 10], discs[i, 11]
    height = (discs[j, 0] - discs[i, 0]) * nx + (discs[j, 1] - discs[i, 1]) * ny + (discs[j, 2] - discs[i, 2]) * nz
    u = discs[j, 3] * nx + discs[j, 4] * ny + discs[j, 5] * nz
    v = discs[j, 6] * nx + discs[j, 7] * ny + discs[j, 8] * nz
    return abs(height) - epsilon <= limit * (1.0 + 1e-12) * np.sqrt(u * u + v * v)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def may_touch(discs, reaches, i, j, epsilon, limit):
    """Whether the touch scale may be within the limit: bounds that cost a fraction of it."""
    return (
        _may_touch_one_way(discs, reaches, i, j, epsilon, limit)
        and _may_meet(discs, i, j, epsilon, limit)
        and _may_meet(discs, j, i, epsilon, limit)
    )


@nb.njit(nogil=True, cache=True, parallel=True, error_model="numpy")
def nearest_touches(
    queries, nodes, discs, reaches, classes, boxes, labels, ranges, epsilon, limit, ratio, partners, scales
):
    """Find, for some ellipses, the others with the smallest touch scales.

    Depth first, nearer box first; the search radius shrinks with the worst
    partner found so far. Runs in parallel, a block of queries at a time.

    Parameters
    ----------
    queries : (Q,) int64
        Places in the sorted order, ascending.
    nodes, discs, reaches, classes, boxes
        Arrays of `EllipseTree`.
    labels : (n,) int32
        Per place; ellipses with the query's own label are no partners.
    ranges : (S, 2) int32
        `EllipseTree.label_ranges` of these labels.
    epsilon : float
        World units.
    limit : float
        Largest touch scale to accept.
    ratio : float
        Ellipses of more than so many times the query's reach are no partners.
    partners : (Q, m) int32
        Filled with nodes by rising touch scale, then node; -1 where there are fewer.
    scales : (Q, m) float64
        Filled with their touch scales, inf where there are fewer.
    """
    m = partners.shape[1]
    for block in nb.prange((len(queries) + _BLOCK - 1) // _BLOCK):
        stack = np.empty(128, np.int64)
        bounds = np.empty(128)
        start = block * _BLOCK
        for q in range(start, min(start + _BLOCK, len(queries))):
            me = queries[q]
            reach, label = reaches[me], labels[me]
            extents = _extents(discs, me)
            for k in range(m):
                partners[q, k], scales[q, k] = -1, np.inf
            own = 0
            while classes[own, 1] <= me:
                own += 1
            # Its own class first: there are the best partners, which narrow the search among the others.
            for step in range(len(classes)):
                first, end, base, n_leaves = classes[(own + step) % len(classes)]
                stack[0], bounds[0], height = 1, 0.0, 1
                while height > 0:
                    height -= 1
                    slot = stack[height]
                    worst = min(limit, scales[q, m - 1])
                    if bounds[height] > worst:
                        continue
                    if ranges[base + slot, 0] == label and ranges[base + slot, 1] == label:
                        continue
                    if slot < n_leaves:
                        left, right = 2 * slot, 2 * slot + 1
                        f_left, a = _box_bound(boxes, base + left, discs, me, extents, epsilon)
                        f_right, b = _box_bound(boxes, base + right, discs, me, extents, epsilon)
                        if a < b:
                            left, right, f_left, f_right = right, left, f_right, f_left
                        if f_left <= worst:
                            stack[height], bounds[height] = left, f_left
                            height += 1
                        if f_right <= worst:
                            stack[height], bounds[height] = right, f_right
                            height += 1
                        continue
                    leaf = first + (slot - n_leaves) * _LEAF
                    for other in range(leaf, min(leaf + _LEAF, end)):
                        worst = min(limit, scales[q, m - 1])
                        if labels[other] == label or reaches[other] > ratio * reach:
                            continue
                        if not may_touch(discs, reaches, me, other, epsilon, worst):
                            continue
                        f = -1.0
                        if queries[start] <= other < me and reach <= ratio * reaches[other]:
                            f = _found_before(queries, start, q, other, nodes[me], partners, scales)
                        if f < 0.0:
                            f = two_way_touch(discs, me, other, epsilon, worst)
                        if f <= worst:
                            _insert(partners, scales, q, nodes[other], f)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _found_before(queries, start, q, other, node, partners, scales):
    """What the finished search of an earlier place of the block says about its touch scale with a node.

    The touch scale if it listed the node; inf if it turned it down for so many better ones that it is no better here
    than the worst at hand, or because it exceeds the limit; -1 if it says nothing.
    """
    # The block's places ascend, so this one is at most as many rows back as it is places back.
    row = q - (queries[q] - other)
    if row < start or queries[row] != other:
        return -1.0
    m = partners.shape[1]
    for k in range(m):
        if partners[row, k] == node:
            return scales[row, k]
    worst = scales[row, m - 1]
    return np.inf if worst == np.inf or worst > scales[q, m - 1] else -1.0


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _insert(partners, scales, q, node, f):
    """Put a contact into a row ordered by touch scale, then node, if it is better than the last."""
    k = partners.shape[1] - 1
    if f > scales[q, k] or (f == scales[q, k] and node > partners[q, k]):
        return
    while k > 0 and (scales[q, k - 1] > f or (scales[q, k - 1] == f and partners[q, k - 1] > node)):
        scales[q, k], partners[q, k] = scales[q, k - 1], partners[q, k - 1]
        k -= 1
    scales[q, k], partners[q, k] = f, node


@nb.njit(nogil=True, cache=True, error_model="numpy")
def offset_pairs(start, nodes, discs, reaches, classes, boxes, epsilon, pairs):
    """List the pairs with a normal-wise offset of at most ε in at least one direction.

    Parameters
    ----------
    start : int
        Place in the sorted order to begin at.
    nodes, discs, reaches, classes, boxes
        Arrays of `EllipseTree`.
    epsilon : float
        World units.
    pairs : (P, 2) int32
        Filled with nodes. A pair is listed at the end that comes later in the
        sorted order, which is the one of the larger size class.

    Returns
    -------
    int, int
        Place of the first ellipse whose pairs did not all fit, n if all did; number of pairs listed.
    """
    stack = np.empty(128, np.int64)
    count = 0
    for me in range(start, len(discs)):
        complete, extents = count, _extents(discs, me)
        for c in range(len(classes)):
            first, end, base, n_leaves = classes[c]
            if first >= me:
                break
            stack[0], height = 1, 1
            while height > 0:
                height -= 1
                slot = stack[height]
                if _box_bound(boxes, base + slot, discs, me, extents, epsilon)[0] > 1.0:
                    continue
                if slot < n_leaves:
                    stack[height], stack[height + 1] = 2 * slot, 2 * slot + 1
                    height += 2
                    continue
                leaf = first + (slot - n_leaves) * _LEAF
                for other in range(leaf, min(leaf + _LEAF, end, me)):
                    if not _may_touch_one_way(discs, reaches, me, other, epsilon, 1.0):
                        continue
                    if (
                        one_way_touch(discs, me, other, epsilon, 1.0) > 1.0
                        and one_way_touch(discs, other, me, epsilon, 1.0) > 1.0
                    ):
                        continue
                    if count == len(pairs):
                        return me, complete
                    pairs[count, 0], pairs[count, 1] = nodes[other], nodes[me]
                    count += 1
    return len(discs), count
