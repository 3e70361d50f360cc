"""Moving, turning and scaling the whole object as one body."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.place import Place, recentred_on
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, Tool, ToolContext
from splap_editor.viewport.gizmo import Claim
from splap_editor.viewport.gizmo_parts import Act

_LABELS = {Act.TRANSLATE: "Move object", Act.ROTATE: "Turn object", Act.SCALE: "Scale object"}


class PlaceMover:
    """Puts the whole object elsewhere, about the middle of its subject; a step of the history at its end."""

    def __init__(self, context: ToolContext) -> None:
        self._session = context.session
        self._before = Place()

    def begin(self) -> bool:
        """Remember the place."""
        scene = self._session.scene
        if scene is not None:
            self._before = recentred_on(scene.edit.place, scene.ellipses.subject.center)
        return scene is not None

    def show(self, delta: NDArray[np.float64]) -> None:
        """Preview it carried on; the transform is of what was drawn at the start, the file before that place."""
        matrix = self._before.matrix
        self._session.drag.preview_place(self._before.followed_by(matrix @ delta @ np.linalg.inv(matrix)))

    def take(self, act: Act) -> None:
        """Make the place a step."""
        self._session.drag.commit(_LABELS[act])

    def drop(self) -> None:
        """Put the object back."""
        self._session.drag.cancel()


class PlaceTool(Tool):
    """Has the gizmo stand at the middle of the subject and move all of it; a drag beside it looks around."""

    name = "place"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.mover = PlaceMover(context)
        SceneFollower(context.session, self._on_subject_changed, surface_changed=self._on_subject_changed)

    @property
    def claim(self) -> Claim:
        """A gizmo at the middle of the subject, along its own axes where these are asked for."""
        scene = self.context.session.scene
        if scene is None:
            return Claim(None)
        frame = np.eye(4)
        frame[:3, 3] = scene.ellipses.subject.center
        return Claim(frame, carries_all=True)

    def _on_subject_changed(self) -> None:
        if self.context.mover is self.mover:
            self.context.claim(self.claim)

    def rest(self, event: KeyEvent) -> bool:
        """Leave the keys to what moves by them, which is asked before."""
        return False

    bindings = (Binding(("G", "R", "S"), rest, "Move, turn, scale the whole object", "move, turn, scale it all"),)
