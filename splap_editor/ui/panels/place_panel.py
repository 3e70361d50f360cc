"""Where the whole object stands: its middle, its turn, its scale, which way is up."""

from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from splap_editor.core.place import Place, placed_points
from splap_editor.core.pose import SCALES, Pose
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.panels.pose_form import PoseForm
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.options_form import form_label

UPS = {
    "Z": (0.0, 0.0, 1.0),
    "Y": (0.0, 1.0, 0.0),
    "−Y": (0.0, -1.0, 0.0),
    "X": (1.0, 0.0, 0.0),
    "−X": (-1.0, 0.0, 0.0),
    "−Z": (0.0, 0.0, -1.0),
}


class PlacePanel(QWidget):
    """Numbers of the place, each entry one step: the position is that of the subject's middle as it is written.

    Parameters
    ----------
    session : Session
    actions : ActionSet
        Has those that recentre and reset.
    """

    def __init__(self, session: Session, actions: ActionSet, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.form = PoseForm(words=("Position", "Rotate", "Scale"), scale_range=SCALES)
        self.form.setToolTip("Of the middle of the subject, as it is written.")
        self.form.changed.connect(self._on_changed)
        self.form.previewed.connect(self._preview)
        self.up = Choice(toolTip="Turns the whole object so that what is up points along this axis in what is written.")
        for name, up in UPS.items():
            self.up.addItem(name, up)
        self.up.activated.connect(lambda index: self._session.steps.stand_up(self.up.itemData(index)))
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * STEP)
        grid.setColumnStretch(1, 1)
        grid.addWidget(form_label("Up axis", self.up), 0, 0)
        grid.addWidget(self.up, 0, 1)
        buttons = QHBoxLayout()
        for action_id, text in (("place.recentre", "Recentre"), ("place.reset", "Reset")):
            buttons.addWidget(_button(actions, action_id, text))
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self.form)
        layout.addLayout(grid)
        layout.addLayout(buttons)
        SceneFollower(
            session,
            self._show,
            edit_changed=self._show,
            preview_changed=self._show,
            surface_changed=self._show,
            up_changed=self._show,
        )
        self._show()

    def _show(self) -> None:
        scene = self._session.scene
        self.setEnabled(scene is not None)
        if scene is None:
            return
        place, center = scene.shown_edit.place, scene.ellipses.subject.center
        x, y, z = placed_points(center[None], place)[0].tolist()
        self.form.show_pose(Pose((x, y, z), place.rotate, place.scale), place.scale * scene.ellipses.scene_scale)
        index = list(UPS.values()).index(scene.up) if scene.up in UPS.values() else -1
        self.up.setCurrentIndex(index)

    def _place(self, pose: Pose) -> Place:
        """Place that is shown so."""
        assert isinstance(pose.scale, float | int)
        cx, cy, cz = self._session.shown_scene.ellipses.subject.center.tolist()
        x, y, z = pose.translate
        return Place((cx, cy, cz), (x - cx, y - cy, z - cz), pose.rotate, float(pose.scale))

    def _preview(self, pose: Pose) -> None:
        self._session.drag.preview_place(self._place(pose))

    def _on_changed(self, pose: Pose) -> None:
        if self._session.scene is not None:
            self._session.steps.change_place(self._place(pose), "Place object")


def _button(actions: ActionSet, action_id: str, text: str) -> QPushButton:
    action = actions[action_id]
    button = QPushButton(text)
    button.setToolTip(action.toolTip())
    button.clicked.connect(lambda: action.trigger())
    action.changed.connect(lambda: button.setEnabled(action.isEnabled()))
    button.setEnabled(action.isEnabled())
    return button
