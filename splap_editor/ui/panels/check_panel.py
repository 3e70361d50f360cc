"""Places that the pose spoils, worst first: a click shows one, another takes the tool that cures it."""

from collections.abc import Callable

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QPushButton, QSizePolicy, QVBoxLayout, QWidget

from splap_editor.core.index_spaces import FileRows
from splap_editor.engine.deformation_check import FlawPlace
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.tools.tool_manager import ToolManager
from splap_editor.tools.two_part_tool import TwoPartTool
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import set_tone
from splap_editor.ui.widgets.plain_text import PlainLabel, set_plain_tip
from splap_editor.viewport.scene_view import SceneView

CURES = {
    "tear": ("join", "Join…", "Show what would tie both sides, with the Join tool; Return adds it"),
    "web": ("separate", "Separate…", "Show the seam between both sides, with the Separate tool; Return cuts it"),
}
"""Tool that cures a kind of flaw, and what its button says."""

TINTS = {"tear": (255, 64, 64, 190), "web": (255, 170, 0, 190), "spike": (214, 80, 255, 190)}
"""Colour over the splats of a place, and its share."""

MOST_LISTED = 12
HINT = "Once a drag has settled, places where it tears or draws out the surface are listed here."


class CheckPanel(QWidget):
    """Lists what `Scene.check` found in the pose on screen.

    Parameters
    ----------
    session : Session
    view : SceneView
        Where places are tinted.
    tools : ToolManager
    look_at : callable
        Flies to some file rows.
    """

    def __init__(
        self,
        session: Session,
        view: SceneView,
        tools: ToolManager,
        look_at: Callable[[FileRows], None],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._session, self._view, self._tools, self._look_at = session, view, tools, look_at
        self.status = PlainLabel(wordWrap=True)
        self.tinted = QCheckBox("Tint them on the surface")
        self.tinted.setChecked(True)
        self.tinted.toggled.connect(self._tint)
        self.places: list[QPushButton] = []
        self.cures: list[QPushButton | None] = []
        self._lines: list[QWidget] = []
        self._list = QVBoxLayout(self)
        self._list.setSpacing(STEP)
        self._list.addWidget(self.status)
        self._list.addWidget(self.tinted)
        SceneFollower(session, self._show, check_changed=self._show, pose_changed=self._show)
        self._show()

    @property
    def _found(self) -> tuple[FlawPlace, ...]:
        scene = self._session.scene
        return scene.check.places if scene is not None and scene.check is not None else ()

    def _show(self) -> None:
        scene = self._session.scene
        check = scene.check if scene is not None else None
        for line in self._lines:
            self._list.removeWidget(line)
            line.hide()
            line.deleteLater()
        self._lines, self.places, self.cures = [], [], []
        if check is None:
            self.status.setText(HINT)
        else:
            more = len(check.places) - MOST_LISTED
            self.status.setText(f"{str(check)[0].upper()}{str(check)[1:]}" + (f", {more:,} not listed" * (more > 0)))
        set_tone(self.status, "warning" if self._found else "quiet")
        self.tinted.setVisible(bool(self._found))
        for place in self._found[:MOST_LISTED]:
            self._add_line(place)
        self._tint()

    def _add_line(self, place: FlawPlace) -> None:
        line = QWidget()
        row = QHBoxLayout(line)
        row.setContentsMargins(0, 0, 0, 0)
        button = QPushButton(f"{place.kind.title()}: {place.size:.3g}", flat=True)
        button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        button.setStyleSheet("text-align: left;")
        set_plain_tip(button, f"Bring into view this {place}")
        button.clicked.connect(lambda: self._look_at(place.rows))
        row.addWidget(button, 1)
        cure = CURES.get(place.kind)
        other = None
        if cure is not None and len(place.a_rows) and len(place.b_rows):
            tool, text, tip = cure
            other = QPushButton(text)
            other.setToolTip(tip)
            other.clicked.connect(lambda: self._cure(tool, place))
            row.addWidget(other, 0, Qt.AlignmentFlag.AlignTop)
        self._list.addWidget(line)
        self._lines.append(line)
        self.places.append(button)
        self.cures.append(other)

    def _cure(self, name: str, place: FlawPlace) -> None:
        """Bring a place into view and point the tool that cures it at both sides."""
        self._look_at(place.rows)
        self._tools.choose(name)
        tool = self._tools.chosen
        assert isinstance(tool, TwoPartTool)
        tool.drop()
        tool.take_rows(*(tuple(rows.tolist()) for rows in (place.a_rows, place.b_rows)))

    def _tint(self) -> None:
        places = self._found if self.tinted.isChecked() else ()
        # The worst one is laid over the others.
        marks = [(np.asarray(place.rows), TINTS[place.kind]) for place in reversed(places)]
        self._view.mark(marks, layer="check")
