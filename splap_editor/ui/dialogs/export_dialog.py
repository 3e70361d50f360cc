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

from splap_editor.core.adaptation.options import USUAL_REPAIR
from splap_editor.io.formats.table import FORMATS, SplatFormat, format_named, format_to_write
from splap_editor.io.splat_files import FormatError, name_filter
from splap_editor.session.jobs import Threads
from splap_editor.session.scene import Scene
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.columns_list import ColumnsList
from splap_editor.ui.widgets.format_choice import FormatChoice
from splap_editor.ui.widgets.number_field import set_tone
from splap_editor.ui.widgets.plain_text import PlainLabel


class ExportDialog(QDialog):
    """Asks for a path; says before anything is written what stands in the way.

    Parameters
    ----------
    parent : QWidget
    suggested : Path
        The path at first.
    scene : Scene
    lacks : dict
        As of `ColumnsList`.
    threads : Threads
        Where it is worked out what a format loses.
    """

    def __init__(
        self, parent: QWidget | None, suggested: Path, scene: Scene, lacks: Mapping[str, str], threads: Threads
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._source, self._suggested = scene.file.path, suggested
        self.path_field = QLineEdit(str(suggested))
        self.path_field.setMinimumWidth(420)
        # What is typed first replaces the suggestion; a click keeps it to be changed.
        self.path_field.setFocus()
        self.path_field.selectAll()
        self.browse_button = browse = QPushButton("Browse…")
        browse.setAutoDefault(False)
        browse.clicked.connect(self._on_browse_clicked)
        line = QHBoxLayout()
        line.addWidget(self.path_field, 1)
        line.addWidget(browse)
        n = scene.splats.n_splats
        is_edited = not scene.edit.is_identity
        of_ply = f"{n:,} splats in the file's own order and layout; rows that did not move stay as they are."
        if is_edited and scene.file.layout.columns is None:
            of_ply = f"{n:,} splats in the file's own order, no longer compressed."
        self.choice = FormatChoice(scene.file, threads, of_ply, is_edited=is_edited)
        self.choice.chosen.connect(self._on_format_chosen)
        self.finished.connect(self.choice.give_up)
        self._limit = scene.edit.repair or USUAL_REPAIR
        self.repair_box = QCheckBox(f"Split splats drawn out to more than {self._limit:g} × their length")
        self.repair_box.setToolTip("A pulled surface shows no needles. The new rows come after those of the file.")
        self.repair_box.setChecked(scene.edit.repair > 0.0)
        self.repair_box.setVisible(bool(scene.edit.active_handles))
        self.note = PlainLabel(wordWrap=True)
        self.columns = ColumnsList(lacks)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        # Focus goes to it while Export is off, and Return shall not mean it then.
        buttons.button(QDialogButtonBox.StandardButton.Cancel).setAutoDefault(False)
        self.accept_button = buttons.addButton("Export", QDialogButtonBox.ButtonRole.AcceptRole)
        self.accept_button.setDefault(True)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(5 * STEP, 5 * STEP, 5 * STEP, 4 * STEP)
        layout.setSpacing(3 * STEP)
        layout.addLayout(line)
        layout.addWidget(self.choice)
        layout.addWidget(self.repair_box)
        layout.addWidget(self.columns)
        layout.addWidget(self.note)
        layout.addStretch(1)
        layout.addWidget(buttons)
        self.path_field.textChanged.connect(self._check)
        self.choice.told.connect(self._check)
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
        return self.choice.as_3dgs

    @property
    def repair(self) -> float:
        """Stretch beyond which splats are split; 0 for none."""
        return self._limit if self.repair_box.isChecked() else 0.0

    @property
    def format(self) -> SplatFormat:
        """The format that the name's ending means; a PLY where it means none."""
        found = format_named(self.path)
        return found if found is not None and found.can_be_written else FORMATS["ply"]

    @property
    def column_names(self) -> tuple[str, ...]:
        """Quantities to write too; only a PLY takes any."""
        return self.columns.names if self.format.is_lossless else ()

    def _check(self) -> None:
        self.choice.show_format(self.format)
        self.columns.setVisible(self.format.is_lossless)
        try:
            text, tone, is_possible = self._verdict()
        except OSError as error:
            text, tone, is_possible = f"{error.strerror or error}.", "danger", False
        self.note.setText(text)
        set_tone(self.note, tone)
        self.accept_button.setEnabled(is_possible and self.choice.is_told)

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
        try:
            format_to_write(self.path)
        except FormatError as error:
            return str(error), "danger", False
        if not self.path.exists():
            return "", "quiet", True
        if self.path.resolve() == self._source.resolve():
            return "This is the file that is open; it will be replaced.", "warning", True
        return "This file exists and will be replaced.", "warning", True

    def _on_format_chosen(self, name: str) -> None:
        row = FORMATS[name]
        path = self.path if self.path.name else self._suggested
        held = next((s for s in self.format.suffixes if path.name.lower().endswith(s)), path.suffix)
        stem = path.name[: len(path.name) - len(held)] if held else path.name
        self.path_field.setText(str(path.with_name(stem + row.suffixes[0])))

    def _on_browse_clicked(self) -> None:
        dialog = QFileDialog(self, "Export", str(self.path))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setOption(QFileDialog.Option.DontConfirmOverwrite)
        dialog.setNameFilter(f"Splats ({name_filter(to_write=True)})")
        dialog.setDefaultSuffix("ply")
        # A filter gives the name its own first ending.
        dialog.selectFile(str(self.path))
        dialog.fileSelected.connect(self.path_field.setText)
        dialog.open()
