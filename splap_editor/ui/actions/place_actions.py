"""The whole object: put back, brought to the origin."""

from splap_editor.core.place import Place, recentred, recentred_on
from splap_editor.session.session import Session
from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.conditions import has_scene, is_placed

A = ActionSpec


class PlaceActions:
    """Each is one undoable step."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def recentre(self) -> None:
        """Put the middle of the subject at the origin."""
        scene = self._session.shown_scene
        center = scene.ellipses.subject.center
        place = recentred(recentred_on(scene.edit.place, center), center)
        self._session.steps.change_place(place, "Recentre object")

    def reset(self) -> None:
        """Put it back where the file has it."""
        self._session.steps.change_place(Place(), "Reset place")


PLACE_TABLE: tuple[ActionSpec, ...] = (
    A(
        "place.recentre",
        PlaceActions.recentre,
        "Re&centre on subject",
        tip="Put the middle of the main subject at the origin of what is written.",
        needs=has_scene,
        menu="&Edit/Whole o&bject",
    ),
    A(
        "place.reset",
        PlaceActions.reset,
        "&Reset place",
        tip="Put the whole object back where the file has it.",
        needs=is_placed,
        menu="&Edit/Whole o&bject",
    ),
)
