"""What the gizmo, and G, R and S, move: the chosen handles, the whole object, the shape of a crop."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.pose import Pose
from splap_editor.engine.edit import Handle
from splap_editor.session.session import Session
from splap_editor.viewport.gizmo_parts import Act

_LABELS = {Act.TRANSLATE: "Move handle", Act.ROTATE: "Turn handle", Act.SCALE: "Scale handle"}


class Mover(Protocol):
    """Follows one transform from its start to its end; everything is worked out from the state at the start."""

    def begin(self) -> bool:
        """Remember the state; False: there is nothing to move."""
        ...

    def show(self, delta: NDArray[np.float64]) -> None:
        """Preview the state at the start moved by a similarity (4, 4) of the coordinates that were drawn then."""
        ...

    def take(self, act: Act) -> None:
        """Keep what is previewed."""
        ...

    def drop(self) -> None:
        """Go back to the state at the start."""
        ...


class HandleMover:
    """Moves the chosen handles by one transform about their common pivot; a step of the history at its end."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._starts: dict[int, tuple[Handle, Pose]] = {}

    def begin(self) -> bool:
        """Remember the poses."""
        scene = self._session.scene
        handles = scene.edit.active_handles if scene is not None else ()
        chosen = scene.active_handles if scene is not None else ()
        self._starts = {h.handle_id: (h, h.pose) for h in handles if h.handle_id in chosen}
        return bool(self._starts)

    def show(self, delta: NDArray[np.float64]) -> None:
        """Preview the handles."""
        poses = {
            handle_id: pose.moved(delta, np.asarray(handle.region.center, np.float64))
            for handle_id, (handle, pose) in self._starts.items()
        }
        self._session.drag.preview(poses)

    def take(self, act: Act) -> None:
        """Make the poses a step."""
        self._session.drag.commit(_LABELS[act] + ("s" if len(self._starts) > 1 else ""))

    def drop(self) -> None:
        """Bring the poses from before back."""
        self._session.drag.cancel()
