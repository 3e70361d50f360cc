"""A session shown in a viewport: it follows the scene's signals, and has colours and order made for each view."""

from collections.abc import Callable, Iterable
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.index_spaces import FileRows, RowsByPlace
from splap_editor.core.options import world_length
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.edit import PIN_COLOR, Handle
from splap_editor.engine.grading import Grading
from splap_editor.session.depictor import HandOver
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.pivot import Pivot, pivot_point
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.viewport.depiction import Depiction, Presented, SeenFrom, depiction, graded_depiction, presented
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.gizmo import Claim
from splap_editor.viewport.overlays import Mark, MarkShape, circle
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.splat_actor import DisplayMode, SplatFlag
from splap_editor.viewport.tints import edit_tints, fixed_tint, pin_rows, rgb
from splap_editor.viewport.viewport import Viewport
from splap_editor.viewport.weight_view import WeightView

REMOVED_TINT = (229, 72, 77, 190)
FREE_RING_COLOR = (0.75, 0.77, 0.82)


class SceneView:
    """Shows splats, selection, handles, what is free and what is fixed.

    Parameters
    ----------
    session : Session
        Followed. Its worker is told to prepare drawing order and colours along with each pose.
    viewport : Viewport
        Where it is drawn.
    """

    def __init__(self, session: Session, viewport: Viewport) -> None:
        self.viewport = viewport
        self._session = session
        self._scene: Scene | None = None
        self._of_file: Depiction | None = None
        self._depicted: Depiction | None = None
        self._grades: tuple[Grading, object] = (Grading(), None)
        self._depicts: Splats | None = None
        self._presented: tuple[AdaptedKernels | None, Presented | None] = (None, None)
        self.preferred_up: tuple[float, float, float] | None = None
        self._shows_tints = True
        self._fixed_tint = "auto"
        self._tinted_for: tuple[object, ...] = ()
        self._paints: dict[str, NDArray[np.uint8]] = {}
        self._marks: dict[str, tuple[tuple[FileRows, tuple[int, int, int, int]], ...]] = {}
        self._view_job = LatestJob(session.view_worker, "view")
        self._grade_job = LatestJob(session.view_worker, "grade")
        self._is_dragged = False
        self._claim: Claim | None = None
        self._seen = SeenFrom(np.zeros(3), np.array([0.0, 0.0, -1.0], np.float32), False)
        viewport.splats.view_turned = self._on_view_turned
        session.prepare_for(self)
        self._follower = SceneFollower(
            session,
            self._on_scene_changed,
            pose_changed=self._show_pose,
            selection_changed=self._show_flags,
            hidden_changed=self._show_flags,
            removed_changed=self._show_removed,
            surface_changed=self._on_surface_changed,
            edit_changed=self._show_edit,
            preview_changed=self._show_edit,
            up_changed=self._show_place,
            active_handles_changed=self._show_handles,
            pivot_changed=self._show_handles,
        )
        session.state_changed.connect(self._show_tints)
        self.weights = WeightView(session, viewport, self.paint)

    def close(self) -> None:
        """Let go of session and viewport."""
        self._follower.close()
        self._session.prepare_for(None)
        self._scene = None
        self._view_job.drop()
        self._grade_job.drop()
        self.viewport.close()

    @property
    def shows_tints(self) -> bool:
        """Whether handles, pins and what is fixed are tinted."""
        return self._shows_tints

    @shows_tints.setter
    def shows_tints(self, on: bool) -> None:
        self._shows_tints = on
        self._show_tints()

    @property
    def fixed_tint(self) -> str:
        """How what cannot move is tinted: a name of `FIXED_TINTS`."""
        return self._fixed_tint

    @fixed_tint.setter
    def fixed_tint(self, name: str) -> None:
        self._fixed_tint = name
        self._show_tints()

    def paint(self, colors: NDArray[np.uint8] | None, layer: str = "weights") -> None:
        """Lay colours (N, 4) uint8, the fourth their share, over the splats in place of the tints; None: the tints.

        Of several layers the one painted last is seen.
        """
        if colors is None:
            self._paints.pop(layer, None)
        elif layer in self._paints:
            self._paints[layer] = colors
        else:
            self._paints = {**self._paints, layer: colors}
        self._tinted_for = ("stale",)
        self._show_tints()

    def mark(self, marks: Iterable[tuple[FileRows, tuple[int, int, int, int]]], layer: str = "inspect") -> None:
        """Lay a colour and its share, 0..255, over some file rows, above tints and paint; none: no marks of a layer."""
        marks = tuple(marks)
        if marks or layer in self._marks:
            self._marks.pop(layer, None)
            if marks:
                self._marks[layer] = marks
            self._tinted_for = ("stale",)
            self._show_tints()

    def marks(self, layer: str) -> tuple[tuple[FileRows, tuple[int, int, int, int]], ...]:
        """Rows and colours of a layer's marks, the last on top."""
        return self._marks.get(layer, ())

    def rows_of_handles(self, handle_ids: Iterable[int]) -> FileRows:
        """File rows that these handles hold, empty while nothing is bound."""
        bound = self._session.bound
        if bound is None or self._scene is None:
            return np.empty(0, np.int64)
        wanted = set(handle_ids)
        labels = [i for i, handle in enumerate(bound.edit.active_handles) if handle.handle_id in wanted]
        nodes = bound.handles.indices[np.isin(bound.handles.labels, labels)]
        return self._scene.ellipses.rows[nodes]

    def rows_of_pins(self, pin_ids: Iterable[int]) -> FileRows:
        """File rows that these pins hold."""
        scene = self._session.shown_scene
        rows = [pin_rows(scene, scene.edit.pin(pin_id)) for pin_id in pin_ids]
        return np.concatenate(rows) if rows else np.empty(0, np.int64)

    def claim_gizmo(self, claim: Claim | None) -> None:
        """Have the gizmo stand elsewhere; None: at the chosen handles again."""
        self._claim = claim
        self._show_handles()

    def show_free_ring(self, is_shown: bool) -> None:
        """Draw the free radius about each active handle, facing the viewer."""
        scene, rings = self._scene, self.viewport.rings
        rings.hide("free")
        free = scene.edit.options[ReachOptions].free_radius if is_shown and scene is not None else None
        if scene is not None and free is not None:
            radius = world_length(free, scene.ellipses.scene_scale)
            direction = self.viewport.projection.direction
            chosen = scene.active_handles
            handles = [each for each in scene.edit.active_handles if each.frees and each.handle_id in chosen]
            loops = [circle(handle.region.center, direction, radius) for handle in handles]
            rings.show("free", loops, FREE_RING_COLOR, opacity=0.8)
        self.viewport.request_render()

    # Preparing on the session's worker ----------------------------------------------------------------------------

    def depict(self, splats: Splats) -> HandOver:
        """Make shapes and colours of a scene that is being opened."""
        made = depiction(splats)

        def hand_over() -> None:
            self._of_file = self._depicted = made
            self._depicts = splats

        return hand_over

    def presenter(self) -> Callable[[AdaptedKernels], HandOver]:
        """Sort and colour kernels of the scene on screen, for the view as it is when they have been made."""
        depicted = self._depicted
        assert depicted is not None  # the scene on screen has been depicted before

        def present(kernels: AdaptedKernels) -> HandOver:
            made = presented(depicted, kernels, self._seen)

            def hand_over() -> None:
                self._presented = kernels, made

            return hand_over

        return present

    # Following the scene ------------------------------------------------------------------------------------------

    def _on_scene_changed(self) -> None:
        self._scene = scene = self._session.shown_scene
        self._tinted_for, self._paints, self._marks = (), {}, {}
        self._grade_job.drop()
        self._grades = Grading(), None
        self.viewport.gizmo.detach()
        if self._depicts is not scene.splats:
            self.depict(scene.splats)()
        depicted = self._depicted = self._of_file
        assert depicted is not None
        self.viewport.splats.load(depicted.rest, depicted.colors, scene.ellipses.subject, depicted.by_contribution)
        self.viewport.splats.set_subject(scene.ellipses.subject, scene.edit.removed)
        scene.up = self.preferred_up or suggested_up(scene.splats)
        self.viewport.camera.world_up = np.array(scene.up, np.float64)
        self.viewport.show_place(scene.edit.place)
        self.viewport.reset_camera()
        self._show_flags()
        self._show_handles()
        self._show_grades()

    @property
    def _shown(self) -> Scene | None:
        """The scene, unless there is nothing of it in the picture."""
        return self._scene if self.viewport.splats.deformed is not None else None

    def _show_pose(self) -> None:
        scene, splats, depicted = self._shown, self.viewport.splats, self._depicted
        if scene is None or depicted is None:
            return
        kernels, (presents, made) = scene.kernels, self._presented
        if kernels is None:
            rest = depicted.rest
            splats.move(rest.means, rest.axes_u, rest.axes_v)
            self._ask_for_view()
        else:
            made = made if presents is kernels else None
            order = made.order if made is not None else None
            splats.move(kernels.means_f32, kernels.axes_f32[:, 0], kernels.axes_f32[:, 1], order=order)
            if made is not None and made.colors is not None:
                splats.set_colors(made.colors)
        self._show_tints()

    def _show_flags(self) -> None:
        scene = self._shown
        if scene is None:
            return
        flags = scene.selection * np.uint8(SplatFlag.SELECTED) | scene.unseen * np.uint8(SplatFlag.HIDDEN)
        self.viewport.splats.set_flags(flags)

    def _show_removed(self) -> None:
        """Take removed splats out of the picture, or tint them in it."""
        self._show_flags()
        self._show_subject()
        self._tinted_for = ("stale",)
        self._show_tints()

    def _show_subject(self) -> None:
        """Have home, framing and clipping follow the subject of the splats that are left."""
        scene = self._shown
        if scene is not None:
            self.viewport.splats.set_subject(scene.ellipses.subject, scene.edit.removed)

    def _on_surface_changed(self) -> None:
        self._show_subject()
        self._show_grades()

    def _show_grades(self) -> None:
        """Have the splats' colours graded as the edit says, and drawn once they are.

        Only the newest of several waits, so that a slider that is dragged is followed as fast as it goes.
        """
        scene, of_file = self._shown, self._of_file
        if scene is None or of_file is None:
            return
        grading = scene.shown_edit.grading
        # A falloff goes along the surface; without one nothing changes with it.
        surface = scene.surface if grading.needs_surface else None
        before, along = self._grades
        if surface is along and grading.like(before):
            return
        self._grades = grading, surface
        splats = scene.splats

        def graded(job: Job) -> Depiction:
            shown = grading.graded_so_far(splats, surface)
            return of_file if shown is splats else graded_depiction(of_file, shown)

        def done(depicted: Depiction) -> None:
            if self._shown is scene:
                self._depicted = depicted
                if not len(depicted.shN):
                    self.viewport.splats.set_colors(depicted.colors)
                self.viewport.splats.set_original_colors(None if depicted is of_file else of_file.colors)
                self._ask_for_view()

        self._grade_job.ask(graded, done)

    def _show_edit(self) -> None:
        self._show_grades()
        self._show_place()
        self._show_handles()

    def _show_place(self) -> None:
        """Put the scene where the edit says.

        What a pointer drags moves before a camera at rest. With any other change the camera goes along, so that the
        subject keeps its place and size in the picture; where up was moved along with the scene all of it stays.
        """
        scene, camera = self._shown, self.viewport.camera
        if scene is None:
            return
        place, was_dragged = scene.shown_edit.place, self._is_dragged
        self._is_dragged = scene.preview is not None
        stands_up = not np.array_equal(scene.up, camera.world_up)
        camera.world_up = np.array(scene.up, np.float64)
        if place != camera.place:
            view, is_dragged = camera.view, self._is_dragged or was_dragged
            self.viewport.show_place(place, None if is_dragged else scene.ellipses.subject.center)
            if stands_up:
                camera.view = view

    def _show_handles(self) -> None:
        scene, viewport = self._shown, self.viewport
        if scene is None:
            return
        handles = scene.shown_edit.active_handles
        viewport.markers.show(_marks_of_edit(scene))
        if viewport.gizmo.dragged is None:
            chosen = {handle.handle_id: handle for handle in handles}
            self._place_gizmo(scene, [chosen[handle_id] for handle_id in scene.active_handles if handle_id in chosen])
        self._show_tints()
        viewport.gizmo_changed()

    def _place_gizmo(self, scene: Scene, handles: list[Handle]) -> None:
        gizmo, claim = self.viewport.gizmo, self._claim
        shown = claim or Claim(None)
        gizmo.acts, gizmo.carries_all = shown.acts, shown.carries_all
        if shown.frame is not None:
            gizmo.attach(shown.frame)
            return
        if claim is not None or not handles:
            gizmo.detach()
            return
        frame = np.eye(4)
        frame[:3, :3] = quats_to_matrices(np.array([handles[-1].pose.rotate]))[0]
        frame[:3, 3] = pivot_point(scene.pivot, scene.pivot_at, handles)
        self.viewport.gizmo.attach(frame)

    def _show_tints(self) -> None:
        """Tint what handles hold in their colours and darken what is fixed, once something is bound."""
        scene, depicted, bound = self._shown, self._depicted, self._session.bound
        if scene is None or depicted is None:
            return
        paint = next(reversed(self._paints.values()), None)
        edit = scene.edit
        colors = tuple(handle.color for handle in edit.active_handles)
        is_known = bound is not None and len(bound.edit.active_handles) == len(colors) > 0
        is_tinted = self._shows_tints and (is_known or bool(edit.pins))
        regions = tuple(id(pin.region) for pin in edit.pins)
        wanted: tuple[object, ...] = (
            (bound if is_known else None, colors, regions, self._fixed_tint) if is_tinted else ()
        )
        if paint is not None:
            wanted = ("painted",)
        if wanted == self._tinted_for:
            return
        self._tinted_for = wanted
        shows_removed = scene.shows_removed and scene.edit.removed is not None
        if not wanted and not self._marks and not shows_removed:
            self.viewport.splats.set_tints(None)
            return
        if paint is not None:
            tints = paint
        elif wanted:
            fixed = fixed_tint(self._fixed_tint, depicted.colors)
            tints = edit_tints(scene, bound if is_known else None, fixed)
        else:
            tints = np.zeros((scene.splats.n_splats, 4), np.uint8)
        if self._marks or shows_removed:
            tints = tints.copy()
            if shows_removed:
                tints[scene.removed] = REMOVED_TINT
            for marked, rgba in chain.from_iterable(self._marks.values()):
                tints[marked] = rgba
        self.viewport.splats.set_tints(tints)

    # Colours and order of a view ----------------------------------------------------------------------------------

    def _on_view_turned(self, projection: Projection) -> None:
        is_blended = self.viewport.splats.mode is DisplayMode.SPLATS
        self._seen = SeenFrom(projection.eye, projection.direction.astype(np.float32), is_blended)
        self._ask_for_view()

    def _ask_for_view(self) -> None:
        """Have colours and order made for the view; while that is under way, the view as it is afterwards waits."""
        self._view_job.when_free(self._present)

    def _present(self) -> None:
        scene, depicted = self._scene, self._depicted
        if scene is None or depicted is None:
            return
        kernels, seen, splats = scene.kernels, self._seen, self.viewport.splats
        sorts_original = seen.is_blended and splats.has_original

        def present(job: Job) -> tuple[Presented, RowsByPlace | None]:
            made = presented(depicted, kernels, seen)
            return made, depth_order(depicted.rest_means, seen.direction) if sorts_original else None

        def done(both: tuple[Presented, RowsByPlace | None]) -> None:
            if self._shown is not scene:
                return
            made, original_order = both
            if original_order is not None:
                splats.set_original_order(original_order)
            if scene.kernels is kernels:
                if made.order is not None:
                    splats.set_order(made.order)
                if made.colors is not None:
                    splats.set_colors(made.colors)

        self._view_job.ask(present, done)


def _marks_of_edit(scene: Scene) -> list[Mark]:
    """Marks of pins and handles, the active one on top, and of the placed pivot."""
    marks: list[Mark] = []
    for pin in scene.edit.pins:
        is_chosen = pin.pin_id in scene.active_pins
        marks.append(Mark(pin.region.center, rgb(PIN_COLOR), MarkShape.SQUARE, is_chosen=is_chosen))
    for handle in scene.shown_edit.active_handles:
        is_chosen, is_active = handle.handle_id in scene.active_handles, handle.handle_id == scene.active_handle
        marks.append(Mark(handle.moved_center, rgb(handle.color), is_chosen=is_chosen, is_active=is_active))
    marks.sort(key=lambda mark: (mark.is_chosen, mark.is_active))
    if scene.pivot is Pivot.POINT and scene.pivot_at is not None:
        marks.append(Mark(scene.pivot_at, (255, 255, 255), MarkShape.CROSS))
    return marks


def suggested_up(splats: Splats) -> tuple[float, float, float]:
    """Guess which way is up: -Y for captures posed by structure from motion, as most of three scales are, else Z."""
    return (0.0, 0.0, 1.0) if splats.n_scales == 2 else (0.0, -1.0, 0.0)
