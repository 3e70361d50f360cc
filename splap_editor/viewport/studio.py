"""Pictures of a scene without a window on the screen: frames of an animation, and views all round."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.splats.main_subject import main_subject
from splap_editor.core.splats.spherical_harmonics import view_colors
from splap_editor.core.splats.splats import Splats
from splap_editor.viewport.camera import View, orbited
from splap_editor.viewport.glyphs import base_colors, rgba_bytes, splat_glyphs
from splap_editor.viewport.scene_view import suggested_up
from splap_editor.viewport.screenshot import screenshot
from splap_editor.viewport.splat_actor import SplatFlag, SplatLook
from splap_editor.viewport.viewport import Viewport


class Studio:
    """A scene set up off screen, drawn from any side in any pose. Only for one thread.

    Parameters
    ----------
    splats : Splats
        At rest.
    look : SplatLook
        How they are drawn.
    width, height : int
        Size of the pictures in pixels.
    hidden : (N,) bool, optional
        Splats that are left out of the picture.
    removed : (N,) bool, optional
        Splats that are left out of the scene, its size included.
    """

    def __init__(
        self,
        splats: Splats,
        look: SplatLook,
        width: int,
        height: int,
        *,
        hidden: FileMask | None = None,
        removed: FileMask | None = None,
    ) -> None:
        self._splats = splats
        self._size = width, height
        self._window = vtkRenderWindow()
        self._window.SetOffScreenRendering(True)
        self._window.SetSize(width, height)
        self.viewport = Viewport(self._window)
        self._rest = splat_glyphs(splats)
        subject = None
        if removed is not None:
            subject = main_subject(np.asarray(splats.means)[~removed], splats.opacities[~removed])
            hidden = removed if hidden is None else hidden | removed
        self.viewport.splats.load(self._rest, base_colors(splats), subject)
        if subject is not None:
            self.viewport.splats.set_subject(subject, removed)
        if hidden is not None and hidden.any():
            self.viewport.splats.set_flags(np.where(hidden, np.uint8(SplatFlag.HIDDEN), np.uint8(0)))
        self.viewport.splats.look = look
        self._kernels: AdaptedKernels | None = None

    def close(self) -> None:
        """Let go of the graphics."""
        self.viewport.close()
        self._window.Finalize()

    def home(self) -> View:
        """View of the whole scene at rest, from the side and from above, as the window opens with."""
        self.viewport.camera.world_up = np.array(suggested_up(self._splats))
        self.viewport.reset_camera()
        return self.viewport.camera.view

    def pose(self, kernels: AdaptedKernels | None) -> None:
        """Show adapted kernels, or the rest pose."""
        self._kernels = kernels
        if kernels is None:
            self.viewport.splats.move(self._rest.means, self._rest.axes_u, self._rest.axes_v)
        else:
            axes = kernels.axes_f32
            self.viewport.splats.move(kernels.means_f32, axes[:, 0], axes[:, 1])

    def picture(self, view: View, *, is_transparent: bool = False) -> NDArray[np.uint8]:
        """(H, W, 4) uint8 RGBA of the scene from a view; see `screenshot`."""
        self.viewport.camera.view = view
        self._color(self.viewport.projection.eye)
        return screenshot(self.viewport, *self._size, is_transparent=is_transparent)

    def _color(self, eye: NDArray[np.float64]) -> None:
        splats, kernels = self._splats, self._kernels
        if not splats.shN.shape[1]:
            return
        means = np.ascontiguousarray(splats.means, np.float32) if kernels is None else kernels.means_f32
        rest = np.broadcast_to(np.eye(3), (splats.n_splats, 3, 3))
        rgb = view_colors(splats.sh0, splats.shN, means, rest if kernels is None else kernels.rotations, eye)
        self.viewport.splats.set_colors(rgba_bytes(rgb, splats.opacities))


def drawn_round(
    view: View,
    n: int,
    up: NDArray[np.float64],
    draw: Callable[[View], NDArray[np.uint8]],
    *,
    progress: Progress = no_progress,
) -> Iterator[NDArray[np.uint8]]:
    """Draw ``n`` views once round the focal point at equal angles, the first the given one; the scene turns right."""
    for done in range(n):
        yield draw(orbited(view, 2.0 * np.pi * done / n, 0.0, up))
        progress((done + 1) / n)
