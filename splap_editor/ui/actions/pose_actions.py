"""Copying, pasting and mirroring the poses of the chosen handles."""

from splap_editor.core.pose import Pose
from splap_editor.core.splats.symmetry import Plane, object_center, symmetry_plane
from splap_editor.session.jobs import Job
from splap_editor.session.pose_tools import NoMirrorImageError, mirrored_handles, pasted_poses
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.widgets.toast import Toast


class PoseActions:
    """Each is one undoable step.

    Parameters
    ----------
    session : Session
    toast : Toast
        Where refusals are said.
    """

    def __init__(self, session: Session, toast: Toast) -> None:
        self._session = session
        self._toast = toast
        self._copied: tuple[Pose, ...] = ()
        self._symmetry: Plane | None = None
        SceneFollower(session, self._on_scene_changed)

    def copy(self) -> None:
        """Remember the poses of the chosen handles."""
        scene = self._session.shown_scene
        self._copied = tuple(scene.edit.handle(handle_id).pose for handle_id in scene.active_handles)
        n = len(self._copied)
        self._toast.say("Copied the pose." if n == 1 else f"Copied {n} poses.")

    def paste(self) -> None:
        """Give the chosen handles the poses copied last."""
        scene = self._session.shown_scene
        if self._copied:
            self._session.steps.change_edit(pasted_poses(scene.edit, scene.active_handles, self._copied), "Paste pose")
        else:
            self._toast.say("No pose was copied yet: choose a handle and press Ctrl+C.")

    def mirror_across(self, *, axis: int) -> None:
        """Mirror left and right (0), front and back (1), or up and down (2)."""
        scene = self._session.shown_scene
        # Row by row the axes of the placed scene in the file's coordinates.
        self._mirror(Plane(object_center(scene.ellipses.centers), scene.edit.place.rotation[axis]))

    def mirror_symmetry(self) -> None:
        """Mirror about the object's own symmetry plane, which is looked for first."""
        if self._symmetry is not None:
            self._mirror(self._symmetry)
            return
        scene = self._session.shown_scene
        handle_ids, edit = scene.active_handles, scene.edit
        centers = scene.ellipses.centers

        def done(plane: Plane) -> None:
            self._symmetry = plane if self._session.scene is scene else None
            # What was changed meanwhile is not overwritten: the person asks again.
            if self._session.scene is scene and scene.edit is edit and scene.active_handles == handle_ids:
                self._mirror(plane)

        def look(job: Job) -> Plane:
            return symmetry_plane(centers, progress=job.progress("symmetry"))

        self._session.worker.submit(Job("symmetry", "Looking for the symmetry of the object", look, done))

    def _mirror(self, plane: Plane) -> None:
        scene = self._session.shown_scene
        try:
            edit, counterparts = mirrored_handles(scene.edit, scene.active_handles, plane, scene.ellipses)
        except NoMirrorImageError as error:
            self._toast.fail(f"The handle was not mirrored: {error}.")
            return
        self._session.steps.change_edit(edit, "Mirror handle")
        scene.set_active_handles(counterparts)

    def _on_scene_changed(self) -> None:
        self._symmetry = None
