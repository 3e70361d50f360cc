"""Slow twins of the spherical harmonics: the basis by scipy, a turned function by sampling and fitting."""

import numpy as np
from scipy.special import sph_harm_y


def real_basis(directions, degree):
    """(N, (degree + 1)² - 1) real harmonics with the Condon-Shortley phase, orders -l to l, the constant left out."""
    polar = np.arccos(np.clip(directions[:, 2], -1.0, 1.0))
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    columns = []
    for band in range(1, degree + 1):
        for order in range(-band, band + 1):
            harmonic = sph_harm_y(band, abs(order), polar, azimuth)
            columns.append(
                harmonic.real if order == 0 else np.sqrt(2.0) * (harmonic.imag if order < 0 else harmonic.real)
            )
    return np.stack(columns, axis=1)


def turned_coefficients(coefficients, rotation, n_samples=500, seed=0):
    """(K, 3) least-squares coefficients of the function whose value along d is that at rest along ``rotationᵀ d``."""
    directions = np.random.default_rng(seed).normal(size=(n_samples, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    degree = round((len(coefficients) + 1) ** 0.5) - 1
    values = real_basis(directions @ rotation, degree) @ coefficients
    return np.linalg.lstsq(real_basis(directions, degree), values, rcond=None)[0]
