"""Where to export to, and in which form."""

import os
from collections.abc import Mapping
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from splap_editor.session.scene import Scene
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.columns_list import ColumnsList
from splap_editor.ui.widgets.number_field import set_tone
from splap_editor.ui.widgets.plain_text import PlainLabel


class ExportDialog(QDialog):
    """Asks for a path; says before anything is written what stands in the way."""

    def __init__(self, parent: QWidget, suggested: Path, scene: Scene, lacks: Mapping[str, str]) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export PLY")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._source = scene.file.path
        self.path_field = QLineEdit(str(suggested))
        self.path_field.setMinimumWidth(420)
        browse = QPushButton("Browse…")
        browse.setAutoDefault(False)
        browse.clicked.connect(self._on_browse_clicked)
        line = QHBoxLayout()
        line.addWidget(self.path_field, 1)
        line.addWidget(browse)
        n = scene.splats.n_splats
        facts = PlainLabel(
            f"{n:,} splats in the file's own order and layout; rows that did not move stay as they are.", wordWrap=True
        )
        facts.setProperty("tone", "quiet")
        self.note = PlainLabel(wordWrap=True)
        self.third_scale = QCheckBox("Add a thin third scale, for viewers that only know 3DGS")
        self.third_scale.setVisible(scene.splats.n_scales == 2)
        self.columns = ColumnsList(lacks)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        self.accept_button = buttons.addButton("Export", QDialogButtonBox.ButtonRole.AcceptRole)
        self.accept_button.setDefault(True)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(5 * STEP, 5 * STEP, 5 * STEP, 4 * STEP)
        layout.setSpacing(3 * STEP)
        layout.addWidget(facts)
        layout.addLayout(line)
        layout.addWidget(self.third_scale)
        layout.addWidget(self.columns)
        layout.addWidget(self.note)
        layout.addStretch(1)
        layout.addWidget(buttons)
        self.path_field.textChanged.connect(self._check)
        self._check()

    @property
    def path(self) -> Path:
        """The file to write; ``.ply`` is added where no ending was given."""
        path = Path(os.path.expanduser(self.path_field.text().strip()))
        # While it is typed it may be the root or "..", which have no name for an ending.
        has_ending = path.suffix or path.name in ("", "..")
        return path if has_ending else path.with_suffix(".ply")

    @property
    def as_3dgs(self) -> bool:
        """Whether a third scale is added."""
        return self.third_scale.isVisibleTo(self) and self.third_scale.isChecked()

    def _check(self) -> None:
        try:
            text, tone, is_possible = self._verdict()
        except OSError as error:
            text, tone, is_possible = f"{error.strerror or error}.", "danger", False
        self.note.setText(text)
        set_tone(self.note, tone)
        self.accept_button.setEnabled(is_possible)

    def _verdict(self) -> tuple[str, str, bool]:
        """What to say of the path, in which tone, and whether it can be written."""
        if not self.path_field.text().strip():
            return "Name a file.", "quiet", False
        if self.path.is_dir():
            return "This is a folder.", "danger", False
        if not self.path.parent.is_dir():
            return "There is no such folder.", "danger", False
        if not os.access(self.path.parent, os.W_OK):
            return "This folder cannot be written to.", "danger", False
        if not self.path.exists():
            return "", "quiet", True
        if self.path.resolve() == self._source.resolve():
            return "This is the file that is open; it will be replaced.", "warning", True
        return "This file exists and will be replaced.", "warning", True

    def _on_browse_clicked(self) -> None:
        dialog = QFileDialog(self, "Export PLY", str(self.path))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setOption(QFileDialog.Option.DontConfirmOverwrite)
        dialog.setNameFilter("Splat PLY (*.ply)")
        dialog.setDefaultSuffix("ply")
        dialog.fileSelected.connect(self.path_field.setText)
        dialog.open()
