"""What is known of a splat among its nearest, splat by splat."""

import numpy as np


def local_evidence(neighbors, distances, ellipses, logits, thickness, strays):
    """(n, 9) evidence, and (len(strays), n, k) who is tied to whom."""
    centers, normals, reaches = ellipses.centers, ellipses.normals, ellipses.reaches
    n, k = neighbors.shape
    found, ties = np.zeros((n, 9)), np.zeros((len(strays), n, k), bool)

    def reach(node, direction):
        along = ellipses.semi_axes[node] @ direction
        return np.sqrt(along @ along + (thickness * reaches[node]) ** 2)

    for i in range(n):
        near, spacing = neighbors[i], distances[i, -1]
        steps = (centers[near] - centers[i]) / distances[i][:, None]
        touches = distances[i] <= [reach(i, u) + reach(j, u) for j, u in zip(near, steps, strict=True)]
        found[i] = (
            np.log(spacing) - np.log(distances[near, -1]).mean(),
            np.log(spacing / reaches[i]),
            (distances[i] <= distances[near, -1]).mean(),
            np.abs((steps * normals[near]).sum(axis=1)).mean(),
            np.abs(steps @ normals[i]).mean(),
            np.abs(normals[near] @ normals[i]).mean(),
            np.log(reaches[i]) - np.log(reaches[near]).mean(),
            logits[i] - logits[near].mean(),
            touches.mean(),
        )
        for m, stray in enumerate(strays):
            ties[m, i] = touches & (distances[i] <= stray * np.minimum(spacing, distances[near, -1]))
    return found, ties
