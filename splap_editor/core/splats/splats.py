"""Gaussian splats as their file holds them."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask, FileRows

LARGEST_COORDINATE = 1e30
"""Largest coordinate and size of a splat, and largest move of a handle, in world units."""


@dataclass(frozen=True, eq=False)
class Splats:
    """Gaussian splats in file order, with the file's own numbers.

    Stored values (log-scales, logits, raw quaternions) are kept so that a
    splat nobody touched is written back bit for bit; everything else is
    derived. Arrays may be views into the file's buffer: never write to them.

    Parameters
    ----------
    means : (N, 3) float
        Centres in world units.
    log_scales : (N, 2) or (N, 3) float
        Natural logarithm of the standard deviations along the local axes.
        Two columns: 2DGS, whose third extent is zero. ``-inf`` and ``-1e10``
        are legal and mean zero.
    quats : (N, 4) float
        Rotations local → world as w, x, y, z; any length but zero.
    logit_opacities : (N,) float
        ``log(α / (1 - α))``; ``+inf`` is legal and means opaque.
    sh0 : (N, 3) float
        Degree-0 spherical-harmonic coefficients; colour is
        ``0.5 + 0.28209479 sh0`` before the view-dependent part.
    shN : (N, K, 3) float
        Coefficients of degrees 1 and up, ``K = (degree + 1)² - 1``.
    thresholds : (N,) float, optional
        SpikingGS cut-off ``V``: the kernel is zero where it falls below.
    filter_radii : (N,) float, optional
        Mip-splatting 3-D filter in world units (GOF, RaDe-GS ``filter_3D``).
    normal_axis : int, optional
        Local axis (0, 1, 2) that is the surface normal; None takes the axis
        of the smallest scale, splat by splat.
    """

    means: NDArray[np.floating]
    log_scales: NDArray[np.floating]
    quats: NDArray[np.floating]
    logit_opacities: NDArray[np.floating]
    sh0: NDArray[np.floating]
    shN: NDArray[np.floating]
    thresholds: NDArray[np.floating] | None = None
    filter_radii: NDArray[np.floating] | None = None
    normal_axis: int | None = None

    @property
    def n_splats(self) -> int:
        """Number of splats N, inert ones included."""
        return len(self.means)

    @property
    def n_scales(self) -> int:
        """Number of stored scales per splat, 2 or 3."""
        return self.log_scales.shape[1]

    @property
    def sh_degree(self) -> int:
        """Spherical-harmonic degree, 0 to 4."""
        return round((self.shN.shape[1] + 1) ** 0.5) - 1

    @cached_property
    def thinness(self) -> NDArray[np.float64]:
        """(N,) smallest by middle scale: 0 is a disc, 1 a ball or a needle; 0 for two scales, NaN where undefined."""
        if self.n_scales == 2:
            return np.zeros(self.n_splats)
        # A signalling NaN complains when it is made wider.
        with np.errstate(invalid="ignore", over="ignore"):
            scales = np.sort(np.asarray(self.log_scales, np.float64), axis=1)
            return np.exp(scales[:, 0] - scales[:, 1])

    @cached_property
    def is_flat(self) -> bool:
        """Whether they are discs: half of them thinner than a tenth of their width, nearly all than half of it."""
        ratios = self.thinness[np.isfinite(self.thinness)]
        if not ratios.size:
            return True
        middle, high = np.percentile(ratios, (50, 95))
        return bool(middle < 0.1 and high < 0.5)

    def at(self, rows: FileMask | FileRows) -> "Splats":
        """Splats of some rows, by a mask (N,) or by their numbers, as copies."""
        held: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        taken: dict[str, Any] = {name: part[rows] for name, part in held.items() if isinstance(part, np.ndarray)}
        return replace(self, **taken)

    @cached_property
    def scales(self) -> NDArray[np.float64]:
        """(N, 2 or 3) effective standard deviations in world units, the 3-D filter included."""
        scales = np.exp(np.asarray(self.log_scales, np.float64))
        if self.filter_radii is None:
            return scales
        return np.sqrt(scales**2 + np.asarray(self.filter_radii, np.float64)[:, None] ** 2)

    @cached_property
    def opacities(self) -> NDArray[np.float64]:
        """(N,) effective opacities in [0, 1], dimmed by the 3-D filter as GOF does."""
        with np.errstate(over="ignore"):
            opacities = 1.0 / (1.0 + np.exp(-np.asarray(self.logit_opacities, np.float64)))
        if self.filter_radii is None:
            return opacities
        raw = np.exp(np.asarray(self.log_scales, np.float64))
        with np.errstate(divide="ignore", invalid="ignore"):
            return opacities * np.prod(raw / self.scales, axis=1)
