"""What a worker makes of splats for the picture: shapes and colours of a scene, order and colours for a view."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.index_spaces import RowsByPlace
from splap_editor.core.splats.spherical_harmonics import view_colors
from splap_editor.core.splats.splats import Splats
from splap_editor.viewport.contribution import Contribution, contribution
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.glyphs import Glyphs, base_colors, splat_glyphs


@dataclass(frozen=True, eq=False)
class SeenFrom:
    """From where, and how, splats are looked at.

    Parameters
    ----------
    eye : (3,) float64
        World position of the camera.
    direction : (3,) float32
        Unit vector into the scene.
    is_blended : bool
        The drawing order matters.
    """

    eye: NDArray[np.float64]
    direction: NDArray[np.float32]
    is_blended: bool


@dataclass(frozen=True, eq=False)
class Presented:
    """What the worker made for one view of the splats: drawing order and colours, None where neither is wanted."""

    order: RowsByPlace | None
    colors: NDArray[np.uint8] | None


@dataclass(frozen=True, eq=False)
class Depiction:
    """What drawing a scene needs of its file, made once by the worker that opens it.

    Parameters
    ----------
    rest : Glyphs
        Shapes at rest.
    colors : (N, 4) uint8
        Colours that do not depend on the view, and opacities.
    by_contribution : Contribution
        Which splats give most.
    sh0, shN : (N, 3), (N, K, 3) float32
        Coefficients in the order in memory that reading them wants; empty where no colour depends on the view.
    """

    rest: Glyphs
    colors: NDArray[np.uint8]
    by_contribution: Contribution
    sh0: NDArray[np.float32]
    shN: NDArray[np.float32]

    @property
    def rest_means(self) -> NDArray[np.float32]:
        """(N, 3) centres at rest, as they are sorted and coloured by."""
        return np.ascontiguousarray(self.rest.means, np.float32)


def depiction(splats: Splats) -> Depiction:
    """Make shapes and colours of a scene at rest."""
    has_view = splats.shN.shape[1] > 0
    sh0 = np.ascontiguousarray(splats.sh0, np.float32) if has_view else np.empty((0, 3), np.float32)
    shN = np.ascontiguousarray(splats.shN, np.float32) if has_view else np.empty((0, 0, 3), np.float32)
    rest, colors = splat_glyphs(splats), base_colors(splats)
    return Depiction(rest, colors, contribution(rest, colors), sh0, shN)


def graded_depiction(depicted: Depiction, splats: Splats) -> Depiction:
    """Take the colours of graded splats; shapes and who gives most stay those of the file."""
    has_view = splats.shN.shape[1] > 0
    sh0 = np.ascontiguousarray(splats.sh0, np.float32) if has_view else depicted.sh0
    shN = np.ascontiguousarray(splats.shN, np.float32) if has_view else depicted.shN
    return replace(depicted, colors=base_colors(splats), sh0=sh0, shN=shN)


def presented(depicted: Depiction, kernels: AdaptedKernels | None, seen: SeenFrom) -> Presented:
    """Sort and colour splats for a view; for the worker."""
    means = depicted.rest_means if kernels is None else kernels.means_f32
    order = depth_order(means, seen.direction) if seen.is_blended else None
    if not len(depicted.shN):
        return Presented(order, None)
    rotations = np.broadcast_to(np.eye(3), (len(means), 3, 3)) if kernels is None else kernels.rotations
    rgb = view_colors(depicted.sh0, depicted.shN, means, rotations, seen.eye)
    np.nan_to_num(rgb, copy=False)
    np.minimum(rgb, 1.0, out=rgb)
    rgb *= 255.0
    rgb += 0.5
    colors = depicted.colors.copy()
    colors[:, :3] = rgb
    return Presented(order, colors)
