"""Motions of handles: the way from rest to a transform, and which rotations a handle leaves open."""

import math

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.arap.rotation_fit import nearest_rotations
from splap_editor.core.deformer import Handles

_EASY_TURN = math.radians(60.0)
_EASY_SHIFT = 0.25
"""A motion up to this (in units of the scene scale) needs no stop on the way."""

_LINE = 1e-6
"""Singular value ratio below which a handle's nodes lie on one line."""


def eased_transforms(handles: Handles, transforms: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Transforms a share of the way from rest to ``transforms``.

    Each handle turns at constant speed about its own centre, which moves on a straight line; stretch grows linearly.

    Parameters
    ----------
    handles : Handles
        Gives the centres.
    transforms : (H, 4, 4) float64
        World transforms, rest → moved.
    share : float
        0 gives rest, 1 exactly ``transforms``.

    Returns
    -------
    (H, 4, 4) float64
        The transforms on the way.
    """
    if share >= 1.0 or len(transforms) == 0:
        return transforms
    linear, shift = transforms[:, :3, :3], transforms[:, :3, 3]
    turns = nearest_rotations(linear)
    stretch = (1.0 - share) * np.eye(3) + share * np.swapaxes(turns, 1, 2) @ linear
    moved = np.einsum("hij,hj->hi", linear, handles.centers) + shift
    eased = np.tile(np.eye(4), (len(transforms), 1, 1))
    eased[:, :3, :3] = _powers(turns, share) @ stretch
    center = handles.centers + share * (moved - handles.centers)
    eased[:, :3, 3] = center - np.einsum("hij,hj->hi", eased[:, :3, :3], handles.centers)
    return eased


def n_easy_stops(handles: Handles, transforms: NDArray[np.float64], scene_scale: float) -> int:
    """Into how many parts to cut the way to ``transforms`` so that each is a small motion; at least 1."""
    if len(transforms) == 0:
        return 1
    angles = _angles(nearest_rotations(transforms[:, :3, :3]))
    moved = np.einsum("hij,hj->hi", transforms[:, :3, :3], handles.centers) + transforms[:, :3, 3]
    shifts = np.linalg.norm(moved - handles.centers, axis=1) / scene_scale
    return min(20, max(1, math.ceil(angles.max() / _EASY_TURN), math.ceil(shifts.max() / _EASY_SHIFT)))


def turns_left_open(handles: Handles, rest: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Handles whose node positions alone do not say how they are turned: fewer than three nodes, or all on a line.

    Parameters
    ----------
    handles : Handles
        The handles.
    rest : (n, 3) float64
        Rest positions of all nodes.

    Returns
    -------
    (H,) bool
        True where a rotation is left open.
    """
    is_open = np.ones(handles.n_handles, bool)
    for label in range(handles.n_handles):
        points = rest[handles.indices[handles.labels == label]]
        if len(points) >= 3:
            values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
            is_open[label] = values[1] <= _LINE * values[0]
    return is_open


def _angles(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation angles in radians, 0 to π, accurate at both ends."""
    axial = _axial(rotations)
    return np.arctan2(np.linalg.norm(axial, axis=1), np.trace(rotations, axis1=1, axis2=2) - 1.0)


def _axial(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the sine of the angle times the axis."""
    R = rotations
    return np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)


def _powers(rotations: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Rotations about the same axes by ``share`` of the angles."""
    angles = _angles(rotations)
    axial = _axial(rotations)
    # Near a half turn the axial vector vanishes; the symmetric part still holds the axis, up to a sign nobody can tell.
    symmetric = 0.5 * (rotations + np.swapaxes(rotations, 1, 2)) - np.cos(angles)[:, None, None] * np.eye(3)
    column = np.argmax(np.diagonal(symmetric, axis1=1, axis2=2), axis=1)
    axes = np.take_along_axis(symmetric, column[:, None, None], axis=2)[:, :, 0]
    axes = np.where(np.einsum("hi,hi->h", axes, axial)[:, None] < 0.0, -axes, axes)
    axes = np.where((angles < 2.0)[:, None], axial, axes)
    axes = axes / np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-300)
    K = np.zeros_like(rotations)
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -axes[:, 2], axes[:, 1], -axes[:, 0]
    K -= np.swapaxes(K, 1, 2)
    turned = share * angles[:, None, None]
    return np.eye(3) + np.sin(turned) * K + (1.0 - np.cos(turned)) * K @ K
