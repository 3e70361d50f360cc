"""The open file and what the artist made of it. Only the main thread touches it."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.deformer import Deformation
from splap_editor.core.index_spaces import FileMask, FileRow
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.deformation_check import DeformationCheck
from splap_editor.engine.edit import Edit
from splap_editor.engine.surface import Surface
from splap_editor.io.ply import SplatFile
from splap_editor.session.pivot import Pivot
from splap_editor.session.signals import Signal


class Scene:
    """A model: values, and a signal for each that changes. It draws nothing and starts no work.

    The rest pose is never overwritten: what is shown is the file's splats, or
    ``kernels`` where the edit moves something.
    """

    def __init__(self, file: SplatFile, ellipses: Ellipses) -> None:
        self.file = file
        self.ellipses = self.visible = ellipses
        self.surface: Surface | None = None
        self.edit = Edit()
        self.preview: Edit | None = None
        self.kernels: AdaptedKernels | None = None
        self.deformation: Deformation | None = None
        self.check: DeformationCheck | None = None
        self.selection = np.zeros(file.splats.n_splats, bool)
        self.shows_removed = False
        self.hidden = np.zeros(file.splats.n_splats, bool)
        self._nothing = np.zeros(file.splats.n_splats, bool)
        self.selection_sets: Mapping[str, FileMask] = {}
        self.active_handles: tuple[int, ...] = ()
        self.active_pins: tuple[int, ...] = ()
        self.pivot = Pivot.MEDIAN
        self.pivot_at: NDArray[np.float64] | None = None
        self.picked: FileRow | None = None
        self.up: tuple[float, float, float] = (0.0, 0.0, 1.0)
        self.surface_changed = Signal()
        self.edit_changed = Signal()
        self.preview_changed = Signal()
        self.pose_changed = Signal()
        self.check_changed = Signal()
        self.selection_changed = Signal()
        self.hidden_changed = Signal()
        self.removed_changed = Signal()
        self.selection_sets_changed = Signal()
        self.active_handles_changed = Signal()
        self.pivot_changed = Signal()
        self.picked_changed = Signal()
        self.up_changed = Signal()

    @property
    def splats(self) -> Splats:
        """The splats at rest, as the file holds them."""
        return self.file.splats

    @property
    def prepared(self) -> Surface:
        """The surface, for what is offered only once there is one; RuntimeError before."""
        if self.surface is None:
            raise RuntimeError("the scene is not prepared yet")
        return self.surface

    @property
    def removed(self) -> FileMask:
        """(N,) splats that the edit leaves out. Never written to."""
        removed = self.edit.removed
        return self._nothing if removed is None else removed

    @property
    def unseen(self) -> FileMask:
        """(N,) splats that are neither drawn nor picked: hidden, or removed while these are not shown."""
        removed = None if self.shows_removed else self.edit.removed
        return self.hidden if removed is None else self.hidden | removed

    @property
    def shown_edit(self) -> Edit:
        """The edit on screen: a drag's preview while there is one."""
        return self.preview if self.preview is not None else self.edit

    @property
    def active_handle(self) -> int | None:
        """Id of the handle chosen last, whose numbers are shown."""
        return self.active_handles[-1] if self.active_handles else None

    @property
    def positions(self) -> NDArray[np.floating]:
        """(N, 3) centres on screen, in world units and file order."""
        return self.splats.means if self.kernels is None else self.kernels.means

    def set_surface(self, surface: Surface | None) -> None:
        """Take the graph, Laplacian and kernel carriers with their ellipses, or none while they are made anew."""
        self.surface = surface
        if surface is not None:
            self.ellipses, self.visible = surface.ellipses, surface.visible
        self.surface_changed.emit()

    def set_edit(self, edit: Edit) -> None:
        """Replace the edit; the preview of a drag is dropped, and so is the choice of what is gone."""
        was_removed = self.edit.removal
        self.edit = edit
        self.preview = None
        known = {handle.handle_id for handle in edit.handles}
        kept = tuple(handle_id for handle_id in self.active_handles if handle_id in known)
        pins = {pin.pin_id for pin in edit.pins}
        kept_pins = tuple(pin_id for pin_id in self.active_pins if pin_id in pins)
        self.edit_changed.emit()
        if not edit.removal.like(was_removed):
            self.removed_changed.emit()
            if not self.shows_removed and (self.selection & self.removed).any():
                self.set_selection(self.selection & ~self.removed)
        self.set_active_handles(kept, kept_pins)

    def set_preview(self, edit: Edit | None) -> None:
        """Show an edit that is not in the history yet, or go back to the one that is."""
        self.preview = edit
        self.preview_changed.emit()

    def set_pose(self, kernels: AdaptedKernels | None, deformation: Deformation | None = None) -> None:
        """Show adapted kernels, or the rest pose; what a check found in the pose before is forgotten."""
        self.kernels = kernels
        self.deformation = deformation
        self.check = None
        self.pose_changed.emit()

    def set_check(self, check: DeformationCheck) -> None:
        """Take what a check found in the pose on screen."""
        self.check = check
        self.check_changed.emit()

    def set_selection(self, selection: FileMask) -> None:
        """Replace the (N,) selection mask."""
        self.selection = selection
        self.selection_changed.emit()

    def set_hidden(self, hidden: FileMask) -> None:
        """Replace the (N,) mask of splats that are neither drawn nor picked."""
        self.hidden = hidden
        self.hidden_changed.emit()

    def set_shows_removed(self, on: bool) -> None:
        """Draw removed splats so that they can be selected; those that are not drawn are not selected either."""
        self.shows_removed = on
        self.removed_changed.emit()
        if not on and (self.selection & self.removed).any():
            self.set_selection(self.selection & ~self.removed)

    def set_selection_sets(self, sets: Mapping[str, FileMask]) -> None:
        """Replace the selections kept by name, each an (N,) mask."""
        self.selection_sets = sets
        self.selection_sets_changed.emit()

    def set_active_handles(self, handle_ids: tuple[int, ...], pin_ids: tuple[int, ...] = ()) -> None:
        """Choose the handles that gizmo and keys act on, the one that is active in the last place, and pins."""
        if (handle_ids, pin_ids) != (self.active_handles, self.active_pins):
            self.active_handles, self.active_pins = handle_ids, pin_ids
            self.active_handles_changed.emit()

    def set_pivot(self, pivot: Pivot, at: NDArray[np.float64] | None = None) -> None:
        """Choose what the chosen handles turn about; ``at``: place the point, (3,) in world units."""
        self.pivot = pivot
        if at is not None:
            self.pivot_at = np.asarray(at, np.float64)
        self.pivot_changed.emit()

    def set_up(self, up: tuple[float, float, float]) -> None:
        """Say where up is in the placed scene; the view alone follows."""
        if up != self.up:
            self.up = up
            self.up_changed.emit()

    def set_picked(self, row: FileRow | None) -> None:
        """Choose the splat that is inspected, by file row, or none."""
        if row != self.picked:
            self.picked = row
            self.picked_changed.emit()
