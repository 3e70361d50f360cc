"""What a splat looks like, in the arrays that the graphics card reads."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.splats.occupancy import LENGTHS
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import Splats

SH_C0 = 0.28209479177387814
MIN_CONTRIBUTION = 1.0 / 255.0


@dataclass(frozen=True, eq=False)
class Glyphs:
    """Shapes of N splats in file order, one standard deviation long.

    Parameters
    ----------
    means : (N, 3) float
        Centres in world units.
    axes_u, axes_v : (N, 3) float
        In-plane axes in world units; ``u × v`` is the front side. A splat with
        a zero axis is drawn by no mode but points.
    thickness : (N,) float
        Standard deviation along the normal, world units, zero for 2DGS.
    cutoffs : (N,) float
        Radius in standard deviations where the splat ends, √λ; 0: no region.
    """

    means: NDArray[np.floating]
    axes_u: NDArray[np.floating]
    axes_v: NDArray[np.floating]
    thickness: NDArray[np.floating]
    cutoffs: NDArray[np.floating]

    def __post_init__(self):
        n = len(self.means)
        for name, shape in (
            ("means", (n, 3)),
            ("axes_u", (n, 3)),
            ("axes_v", (n, 3)),
            ("thickness", (n,)),
            ("cutoffs", (n,)),
        ):
            got = np.shape(getattr(self, name))
            if got != shape:
                raise ValueError(f"{name} must have shape {shape}, got {got}")


def cutoff_radii(opacities: ArrayLike, thresholds: ArrayLike | None = None) -> NDArray[np.float64]:
    """Mahalanobis radius √λ at which each splat ends, ``λ = -2 ln max(V, 1/(255 α))``.

    Parameters
    ----------
    opacities : (N,) float
        Opacity α in [0, 1].
    thresholds : (N,) float, optional
        SpikingGS cut-off ``V``.

    Returns
    -------
    (N,) float64
        0 where the splat has no region (``α <= 1/255``, ``V >= 1`` or non-finite numbers).
    """
    floor = MIN_CONTRIBUTION / np.maximum(np.asarray(opacities, np.float64), 1e-30)
    if thresholds is not None:
        floor = np.maximum(floor, np.asarray(thresholds, np.float64))
    floor = np.where(np.isfinite(floor), floor, 1.0)
    return np.sqrt(np.maximum(-2.0 * np.log(np.minimum(floor, 1.0)), 0.0))


def splat_glyphs(splats: Splats) -> Glyphs:
    """Glyphs of all splats of a file, inert ones included.

    The two largest axes span the glyph unless the file fixes a normal axis.
    Rows with a number that is not finite or too large to compute with, or a
    zero quaternion, get zero axes and the origin as centre, so that nothing of
    them is drawn.

    Parameters
    ----------
    splats : Splats
        As read.

    Returns
    -------
    Glyphs
        float64 arrays in file order.
    """
    scales = np.zeros((splats.n_splats, 3))
    scales[:, : splats.n_scales] = splats.scales
    quats = np.asarray(splats.quats, np.float64)
    means = np.asarray(splats.means, np.float64)
    sound = (np.abs(means) < LENGTHS[1]).all(1) & (scales < LENGTHS[1]).all(1)
    sound &= np.isfinite(quats).all(1) & (quats != 0).any(1)
    quats = np.where(sound[:, None], quats, [1.0, 0.0, 0.0, 0.0])
    scales = np.where(sound[:, None], scales, 0.0)
    if splats.n_scales == 2:
        normal = np.full(splats.n_splats, 2)
    elif splats.normal_axis is not None:
        normal = np.full(splats.n_splats, splats.normal_axis)
    else:
        normal = np.argmin(scales, axis=1)
    axes = quats_to_matrices(quats) * scales[:, None, :]
    rows = np.arange(splats.n_splats)
    return Glyphs(
        means=np.where(sound[:, None], means, 0.0),
        axes_u=axes[rows, :, (normal + 1) % 3],
        axes_v=axes[rows, :, (normal + 2) % 3],
        thickness=scales[rows, normal],
        cutoffs=np.where(sound, cutoff_radii(splats.opacities, splats.thresholds), 0.0),
    )


def base_colors(splats: Splats) -> NDArray[np.uint8]:
    """(N, 4) uint8 RGBA: the view-independent colour, and the opacity; a non-finite row is transparent."""
    rgb = 0.5 + SH_C0 * np.asarray(splats.sh0, np.float64)
    return rgba_bytes(rgb, splats.opacities)


def rgba_bytes(rgb: ArrayLike, opacities: ArrayLike) -> NDArray[np.uint8]:
    """Bytes of colours (N, 3) and opacities (N,) in [0, 1], clipped; NaN becomes 0."""
    colors = np.column_stack([np.asarray(rgb, np.float64), np.asarray(opacities, np.float64)])
    return np.rint(np.nan_to_num(np.clip(colors, 0.0, 1.0)) * 255.0).astype(np.uint8)
