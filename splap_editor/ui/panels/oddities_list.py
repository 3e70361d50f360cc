"""What is odd about the splats, each finding with a button that selects them."""

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from splap_editor.session.detective import Oddity, oddities
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.plain_text import PlainLabel


class OdditiesList(QWidget):
    """Looks for them in the background when a scene is opened."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.found: list[Oddity] | None = None
        self.buttons: list[QPushButton] = []
        self._rows: list[QWidget] = []
        self._list = QVBoxLayout(self)
        self._list.setContentsMargins(0, 0, 0, 0)
        self._list.setSpacing(STEP)
        self.status = PlainLabel()
        self.status.setProperty("tone", "quiet")
        self._list.addWidget(self.status)
        # A scene that is gone need not be looked through to the end.
        self._search = LatestJob(session.detail_worker, "lint", cancels=True)
        SceneFollower(session, self._on_scene_changed)

    def _on_scene_changed(self) -> None:
        scene = self._session.shown_scene
        self._show(scene, None)
        splats, ellipses = scene.splats, scene.ellipses

        def done(found: list[Oddity]) -> None:
            if self._session.scene is scene:
                self._show(scene, found)

        def failed(error: Exception) -> None:
            self.status.setText(f"The splats could not be looked through: {error}")

        self._search.ask(lambda job: oddities(splats, ellipses), done, failed=failed)

    def _show(self, scene: Scene, found: list[Oddity] | None) -> None:
        self.found = found
        for row in self._rows:
            self._list.removeWidget(row)
            row.hide()
            row.deleteLater()
        self._rows, self.buttons = [], []
        self.status.setText("Looking for odd splats…" if found is None else "Nothing odd about the splats.")
        self.status.setVisible(not found)
        for oddity in found or ():
            row = QWidget()
            line = QHBoxLayout(row)
            line.setContentsMargins(0, 0, 0, 0)
            line.addWidget(PlainLabel(oddity.sentence, wordWrap=True), 1)
            button = QPushButton("Select", flat=True)
            button.clicked.connect(lambda _=False, oddity=oddity: self._select(scene, oddity))
            line.addWidget(button, 0, Qt.AlignmentFlag.AlignTop)
            self._list.addWidget(row)
            self._rows.append(row)
            self.buttons.append(button)

    def _select(self, scene: Scene, oddity: Oddity) -> None:
        if self._session.scene is scene:
            mask = np.zeros(scene.splats.n_splats, bool)
            mask[oddity.rows] = True
            self._session.steps.change_mask("selection", mask, "Select odd splats")
