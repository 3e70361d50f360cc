"""Search among ellipses of very different sizes for those that touch one another.

The ellipses are split into classes of similar size, each with its own implicit
binary tree over its Morton order:

    slot 1 ─┬─ 2 ─┬─ 4 ── leaf: ellipses 0 to 7 of the class
            │     └─ 5 ── leaf: ellipses 8 to 15
            └─ 3 ─┬─ 6 …

A slot knows the box of its centres and its largest semi-axis, which bound the
touch scale from below: ``|p_i - p_j| ≤ f (reach_i + reach_j) + ε``. With the
sizes in one tree alike, a handful of huge ellipses loosens no bound but theirs.
"""

from dataclasses import dataclass
from itertools import pairwise

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.ellipse_offset import discs, one_way_touch, touch
from splap_editor.core.occupancy import Ellipses

_LEAF = 8
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
        Rows of `ellipse_offset.discs` in the sorted order.
    reaches : (n,) float64
        Major semi-axes in the sorted order, world units.
    classes : (C, 4) int64
        First place, end place, first slot and number of leaves (a power of two)
        of each class, small ellipses first. Slot 1 of a class is its root.
    boxes : (S, 7) float64
        Least and greatest corner of the centres and the largest reach in each slot; an empty slot's box
        is inverted and infinitely far from everything.
    """

    nodes: NDArray[np.int64]
    places: NDArray[np.int64]
    discs: NDArray[np.float64]
    reaches: NDArray[np.float64]
    classes: NDArray[np.int64]
    boxes: NDArray[np.float64]

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
    rows = discs(ellipses)[nodes]
    bounds = np.append(np.flatnonzero(np.diff(sizes[nodes], prepend=-1)), len(nodes))
    classes = np.zeros((len(bounds) - 1, 4), np.int64)
    boxes, slot = [], 0
    for c, (first, end) in enumerate(pairwise(bounds)):
        box = _class_boxes(rows[first:end, :3], reaches[first:end])
        classes[c] = first, end, slot, len(box) // 2
        boxes.append(box)
        slot += len(box)
    return EllipseTree(nodes, places, rows, reaches, classes, np.concatenate(boxes) if boxes else np.empty((0, 7)))


def _class_boxes(centers: NDArray[np.float64], reaches: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2 leaves, 7) boxes of one class's slots; slot 0 is unused."""
    n_leaves = 1 << (-(-len(centers) // _LEAF) - 1).bit_length()
    padded = np.full((n_leaves * _LEAF, 7), -np.inf)
    # Negated least corners, so that one maximum serves all seven.
    padded[: len(centers), :3] = -centers
    padded[: len(centers), 3:6] = centers
    padded[: len(centers), 6] = reaches
    boxes = np.empty((2 * n_leaves, 7))
    level = padded.reshape(n_leaves, _LEAF, 7).max(axis=1)
    while True:
        boxes[len(level) : 2 * len(level)] = level
        if len(level) == 1:
            break
        level = np.maximum(level[::2], level[1::2])
    boxes[:, :3] *= -1.0
    boxes[0] = 0.0
    return boxes


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _box_distance(box, disc):
    """Distance from an ellipse's centre to a box; inf for an empty one."""
    x = max(box[0] - disc[0], disc[0] - box[3], 0.0)
    y = max(box[1] - disc[1], disc[1] - box[4], 0.0)
    z = max(box[2] - disc[2], disc[2] - box[5], 0.0)
    return np.sqrt(x * x + y * y + z * z)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _may_touch(disc, other, epsilon, limit):
    """Whether the touch scale, in either direction, may be within the limit: the extents along the centre line."""
    x, y, z = other[0] - disc[0], other[1] - disc[1], other[2] - disc[2]
    squared = x * x + y * y + z * z
    a = np.sqrt((x * disc[3] + y * disc[4] + z * disc[5]) ** 2 + (x * disc[6] + y * disc[7] + z * disc[8]) ** 2)
    b = np.sqrt((x * other[3] + y * other[4] + z * other[5]) ** 2 + (x * other[6] + y * other[7] + z * other[8]) ** 2)
    # The factor allows for rounding: a pair at the limit must be looked at from both of its ends.
    return squared - epsilon * np.sqrt(squared) <= limit * (a + b) * (1.0 + 1e-12)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def nearest_touches(queries, rows, reaches, nodes, classes, boxes, labels, ranges, epsilon, limit, partners, scales):
    """Find, for some ellipses, the others with the smallest touch scales.

    Depth first, nearer box first; the search radius shrinks with the worst
    partner found so far.

    Parameters
    ----------
    queries : (Q,) int64
        Places in the sorted order.
    rows, reaches, nodes, classes, boxes
        Arrays of `EllipseTree`.
    labels : (n,) int32
        Per place; ellipses with the query's own label are no partners.
    ranges : (S, 2) int32
        `EllipseTree.label_ranges` of these labels.
    epsilon : float
        World units.
    limit : float
        Largest touch scale to accept.
    partners : (Q, m) int32
        Filled with nodes by rising touch scale, then node; -1 where there are fewer.
    scales : (Q, m) float64
        Filled with their touch scales, inf where there are fewer.
    """
    m = partners.shape[1]
    stack = np.empty(128, np.int64)
    gaps = np.empty(128)
    for q in range(len(queries)):
        me = queries[q]
        disc, reach, label, node = rows[me], reaches[me], labels[me], nodes[me]
        for k in range(m):
            partners[q, k], scales[q, k] = -1, np.inf
        for c in range(len(classes)):
            first, end, base, n_leaves = classes[c]
            stack[0], gaps[0], height = 1, _box_distance(boxes[base + 1], disc), 1
            while height > 0:
                height -= 1
                slot = stack[height]
                worst = min(limit, scales[q, m - 1])
                if gaps[height] > worst * (reach + boxes[base + slot, 6]) + epsilon:
                    continue
                if ranges[base + slot, 0] == label and ranges[base + slot, 1] == label:
                    continue
                if slot < n_leaves:
                    left, right = 2 * slot, 2 * slot + 1
                    a, b = _box_distance(boxes[base + left], disc), _box_distance(boxes[base + right], disc)
                    if a < b:
                        left, right, a, b = right, left, b, a
                    stack[height], gaps[height] = left, a
                    stack[height + 1], gaps[height + 1] = right, b
                    height += 2
                    continue
                start = first + (slot - n_leaves) * _LEAF
                for other in range(start, min(start + _LEAF, end)):
                    worst = min(limit, scales[q, m - 1])
                    if labels[other] == label or not _may_touch(disc, rows[other], epsilon, worst):
                        continue
                    # In one order for both ends of a pair, so that both get the same bits.
                    if node < nodes[other]:
                        f = touch(disc, rows[other], epsilon, worst)
                    else:
                        f = touch(rows[other], disc, epsilon, worst)
                    if f > worst or (f == scales[q, m - 1] and nodes[other] > partners[q, m - 1]):
                        continue
                    k = m - 1
                    while k > 0 and (
                        scales[q, k - 1] > f or (scales[q, k - 1] == f and partners[q, k - 1] > nodes[other])
                    ):
                        scales[q, k], partners[q, k] = scales[q, k - 1], partners[q, k - 1]
                        k -= 1
                    scales[q, k], partners[q, k] = f, nodes[other]


@nb.njit(nogil=True, cache=True, error_model="numpy")
def offset_pairs(start, rows, reaches, nodes, classes, boxes, epsilon, pairs):
    """List the pairs with a normal-wise offset of at most ε in at least one direction.

    Parameters
    ----------
    start : int
        Place in the sorted order to begin at.
    rows, reaches, nodes, classes, boxes
        Arrays of `EllipseTree`.
    epsilon : float
        World units.
    pairs : (P, 2) int32
        Filled with nodes. A pair is listed at the end that comes later in the
        sorted order, hence at its larger one.

    Returns
    -------
    int, int
        Place of the first ellipse whose pairs did not all fit, n if all did; number of pairs listed.
    """
    stack = np.empty(128, np.int64)
    count = 0
    for me in range(start, len(rows)):
        disc, reach, complete = rows[me], reaches[me], count
        for c in range(len(classes)):
            first, end, base, n_leaves = classes[c]
            if first >= me:
                break
            stack[0], height = 1, 1
            while height > 0:
                height -= 1
                slot = stack[height]
                box = boxes[base + slot]
                if _box_distance(box, disc) > reach + box[6] + epsilon:
                    continue
                if slot < n_leaves:
                    stack[height], stack[height + 1] = 2 * slot, 2 * slot + 1
                    height += 2
                    continue
                leaf = first + (slot - n_leaves) * _LEAF
                for other in range(leaf, min(leaf + _LEAF, end, me)):
                    if not _may_touch(disc, rows[other], epsilon, 1.0):
                        continue
                    if (
                        one_way_touch(disc, rows[other], epsilon, 1.0) > 1.0
                        and one_way_touch(rows[other], disc, epsilon, 1.0) > 1.0
                    ):
                        continue
                    if count == len(pairs):
                        return me, complete
                    pairs[count, 0], pairs[count, 1] = nodes[other], nodes[me]
                    count += 1
    return len(rows), count
