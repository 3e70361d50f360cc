"""What is open: the file, what wrote it, and what is odd about it."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QVBoxLayout, QWidget

from splap_editor.engine.scene_info import graph_info
from splap_editor.session.detective import reading, verdict
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.panels.layout_form import LayoutForm
from splap_editor.ui.panels.oddities_list import OdditiesList
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import set_tone
from splap_editor.ui.widgets.options_form import form_label
from splap_editor.ui.widgets.plain_text import PlainLabel, set_plain_tip

ROWS = {
    "file": "File",
    "layout": "Written by",
    "reading": "Meaning",
    "splats": "Splats",
    "colour": "Colour",
    "size": "Size",
    "surface": "Surface",
    "trust": "Trust",
}


class ScenePanel(QWidget):
    """Facts about the open file; the surface's are added once it is prepared, what is odd once it is looked through.

    `reread` asks for the file to be read again, as the layout that it gives.
    """

    reread = Signal(object)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._scene: Scene | None = None
        grid = QGridLayout()
        grid.setHorizontalSpacing(3 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        self.facts: dict[str, QLabel] = {}
        for row, (name, text) in enumerate(ROWS.items()):
            value = PlainLabel(wordWrap=True, textInteractionFlags=Qt.TextInteractionFlag.TextSelectableByMouse)
            label = form_label(text, value)
            label.setMinimumWidth(0)
            label.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
            grid.addWidget(label, row, 0)
            grid.addWidget(value, row, 1)
            self.facts[name] = value
        self.warnings = PlainLabel(wordWrap=True)
        self.warnings.setProperty("tone", "warning")
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        layout.addLayout(grid)
        layout.addWidget(self.warnings)
        self.layout_form = LayoutForm()
        self.layout_form.chosen.connect(lambda choice: self.reread.emit(choice))
        self.oddities = OdditiesList(session)
        layout.addWidget(self.layout_form)
        layout.addWidget(self.oddities)
        SceneFollower(session, self._on_scene_changed, surface_changed=self._show_surface, edit_changed=self._show_size)
        self._on_scene_changed()

    def _on_scene_changed(self) -> None:
        self._scene = scene = self._session.scene
        self.setEnabled(scene is not None)
        self.warnings.setVisible(False)
        if scene is None:
            for value in self.facts.values():
                value.setText("–")
            return
        splats, file = scene.splats, scene.file
        n_inert = splats.n_splats - scene.visible.n_nodes
        self.facts["file"].setText(file.path.name)
        set_plain_tip(self.facts["file"], str(file.path))
        self.facts["layout"].setText(f"{file.layout.name}: {file.layout.reason}")
        inert = f", {n_inert:,} too faint or broken to shape the surface" if n_inert else ""
        self.facts["splats"].setText(f"{splats.n_splats:,}{inert}")
        degree = splats.sh_degree
        self.facts["colour"].setText(f"view-dependent, degree {degree}" if degree else "the same from every side")
        self.facts["reading"].setText(reading(file.layout, splats))
        self._show_size()
        words, tone = verdict(splats)
        self.facts["trust"].setText(words)
        set_tone(self.facts["trust"], tone)
        self.layout_form.show_file(file)
        self.warnings.setText("\n".join(f"• {warning}" for warning in file.warnings))
        self.warnings.setVisible(bool(file.warnings))
        self._show_surface()

    def _show_size(self) -> None:
        """Tell the size as it is written; where that is another one, the file's too."""
        scene = self._scene
        if scene is not None:
            size, scale = scene.ellipses.scene_scale, scene.shown_edit.place.scale
            file = "" if scale == 1.0 else f", {size:.4g} in the file"
            self.facts["size"].setText(f"{scale * size:.4g} units{file}")

    def _show_surface(self) -> None:
        self._show_size()
        surface = self._scene.surface if self._scene is not None else None
        if surface is None:
            self.facts["surface"].setText("not prepared yet")
            return
        info = graph_info(surface.graph)
        n = info["n_components"]
        pieces = "in one piece" if n == 1 else f"in {n:,} pieces"
        self.facts["surface"].setText(f"{info['n_edges']:,} connections, {pieces}")
