"""As-rigid-as-possible deformation written down plainly: dense matrices, singular values, no acceleration."""

import numpy as np


def spokes_energy(weights, rest, positions, rotations, beta=0.0):
    """``½ Σ w_ij |x_ij - R_i e_ij|² + ¼ β Σ w_ij |R_i - R_j|²`` over ordered pairs; ``weights`` is dense."""
    edges = rest[:, None] - rest[None]
    moved = positions[:, None] - positions[None]
    strain = np.square(moved - np.einsum("iab,ijb->ija", rotations, edges)).sum(axis=2)
    bend = np.square(rotations[:, None] - rotations[None]).sum(axis=(2, 3))
    return 0.5 * (weights * strain).sum() + 0.25 * beta * (weights * bend).sum()


def closest_rotation(A):
    """Rotation R that maximises ``trace(Rᵀ A)``."""
    U, _, Vt = np.linalg.svd(A)
    U[:, 2] *= np.sign(np.linalg.det(U @ Vt))
    return U @ Vt


def local_global(weights, rest, held, targets, iterations, beta=0.0, given=None):
    """Plain local/global iterations from rest with the held nodes moved.

    ``given`` maps a node to a rotation that stays; all other rotations are fitted, one node after the other.
    """
    n = len(rest)
    given = given or {}
    positions = rest.copy()
    positions[held] = targets
    rotations = np.tile(np.eye(3), (n, 1, 1))
    for node, rotation in given.items():
        rotations[node] = rotation
    free = np.setdiff1d(np.arange(n), held)
    L = np.diag(weights.sum(axis=1)) - weights
    for _ in range(iterations):
        for i in range(n):
            if i in given:
                continue
            S = np.zeros((3, 3))
            for j in np.flatnonzero(weights[i]):
                S += weights[i, j] * np.outer(positions[i] - positions[j], rest[i] - rest[j])
                S += beta * weights[i, j] * rotations[j]
            rotations[i] = closest_rotation(S)
        mean = 0.5 * (rotations[:, None] + rotations[None])
        b = (weights[:, :, None] * np.einsum("ijab,ijb->ija", mean, rest[:, None] - rest[None])).sum(axis=1)
        positions[free] = np.linalg.solve(L[np.ix_(free, free)], b[free] - L[np.ix_(free, held)] @ targets)
    return positions, rotations
