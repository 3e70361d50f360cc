"""Slow twin of surface-preserving kernel adaptation, splat by splat with numpy's own decompositions."""

import numpy as np


def corner_carriers(ellipses, neighborhoods, i):
    """Three corners of node i's triangle, each with the nodes that carry it and their weights."""
    center, (major, minor) = ellipses.centers[i], ellipses.semi_axes[i]
    half_root_3 = 0.5 * np.sqrt(3.0)
    corners = [center + major, center - 0.5 * major + half_root_3 * minor, center - 0.5 * major - half_root_3 * minor]
    candidates = np.concatenate([[i], neighborhoods.indices[neighborhoods.indptr[i] : neighborhoods.indptr[i + 1]]])
    for corner in corners:
        distances = np.linalg.norm(ellipses.centers[candidates] - corner, axis=1)
        nearest = np.argsort(distances, kind="stable")[:3]
        if distances[nearest[0]] == 0.0:
            nearest = nearest[:1]
            yield corner, candidates[nearest], np.ones(1)
        else:
            weights = 1.0 / distances[nearest]
            yield corner, candidates[nearest], weights / weights.sum()


def neighbourhood_map(ellipses, neighborhoods, deformation, i, size=6, damping=0.02):
    """Affine map of node i's nearest geodesic neighbours, its linear part, damped to the rotation times the growth."""
    near = neighborhoods.indices[neighborhoods.indptr[i] : neighborhoods.indptr[i + 1]][:size]
    rest = ellipses.centers[near] - ellipses.centers[i]
    moved = deformation.positions[near] - deformation.positions[i]
    rotation = deformation.rotations[i]
    if not rest.any():
        return rotation
    share = damping * np.sum(rest**2)
    growth = np.sqrt(np.sum(moved**2) / np.sum(rest**2))
    # Rows of one least-squares problem: the neighbours, and three weak ones that hold it to the similarity.
    left = np.concatenate([rest, np.sqrt(share) * np.eye(3)])
    right = np.concatenate([moved, np.sqrt(share) * growth * rotation.T])
    return np.linalg.lstsq(left, right, rcond=None)[0].T


def adapted_ellipse(ellipses, neighborhoods, deformation, i):
    """Centre, covariance at one standard deviation, and rotation of node i's ellipse after a deformation."""
    moved, carried_by = [], [i]
    for corner, carriers, weights in corner_carriers(ellipses, neighborhoods, i):
        images = [
            deformation.positions[j]
            + neighbourhood_map(ellipses, neighborhoods, deformation, j) @ (corner - ellipses.centers[j])
            for j in carriers
        ]
        moved.append(np.asarray(weights) @ np.asarray(images))
        carried_by += list(carriers)
    moved = np.asarray(moved)
    center = moved.mean(axis=0)
    # The Steiner circumellipse has the covariance of the three corners times two.
    half_diameters = np.stack([moved[0] - center, (moved[1] - moved[2]) / np.sqrt(3.0)])
    covariance = half_diameters.T @ half_diameters / ellipses.cutoffs[i] ** 2
    # It goes no farther than the farthest of its own node and those that carry it.
    shift = center - ellipses.centers[i]
    farthest = np.linalg.norm(deformation.positions[carried_by] - ellipses.centers[carried_by], axis=1).max()
    if np.linalg.norm(shift) > farthest:
        center = ellipses.centers[i] + shift * farthest / np.linalg.norm(shift)
    lengths = np.linalg.norm(ellipses.semi_axes[i], axis=1)
    rest_frame = np.concatenate([ellipses.semi_axes[i] / lengths[:, None], ellipses.normals[i : i + 1]])
    left, _, right = np.linalg.svd((half_diameters / lengths[:, None]).T, full_matrices=False)
    plane = left @ right
    frame = np.column_stack([plane, np.cross(plane[:, 0], plane[:, 1])])
    return center, covariance, frame @ rest_frame
