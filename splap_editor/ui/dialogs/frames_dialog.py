"""What to export of an animation."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QSettings, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from splap_editor.core.timeline import LAST_FRAME, Timeline
from splap_editor.engine.frames import holds_all_frames
from splap_editor.io.formats.table import FORMATS, format_to_write, stem_of
from splap_editor.io.ply import SplatFile
from splap_editor.io.splat_files import FormatError, name_filter
from splap_editor.io.video import VIDEOS
from splap_editor.session.jobs import Threads
from splap_editor.ui.actions.file_actions import folder_to_write
from splap_editor.ui.theme import STEP
from splap_editor.ui.timeline.frame_export import FrameOrder
from splap_editor.ui.widgets.format_choice import FormatChoice
from splap_editor.ui.widgets.number_field import NumberField, set_tone
from splap_editor.ui.widgets.options_form import form_label
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.viewport.screenshot import LARGEST_PX

KINDS = {"splats": "The splats of each frame", "pictures": "A picture of each frame", "turntable": "Pictures all round"}
N_ROUND = 72

_SPLATS = f"Splats ({name_filter(to_write=True)})"
_PICTURES = f"PNG pictures or a video (*.png {' '.join(f'*{ending}' for ending in VIDEOS)})"


class FramesDialog(QDialog):
    """Asks what, which frames and how large, then for a name; of splats it says first what their format loses.

    Parameters
    ----------
    file : SplatFile
        The open file.
    timeline : Timeline
        Without keys only the turntable is of use, and offered first.
    size : (int, int)
        Of pictures at first: that of the viewport.
    order : callable
        Given a `FrameOrder`.
    threads : Threads
        Where it is worked out what a format loses.
    """

    def __init__(
        self,
        parent: QWidget,
        file: SplatFile,
        timeline: Timeline,
        size: tuple[int, int],
        order: Callable[[FrameOrder], None],
        threads: Threads,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export frames")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._source, self._order = file.path, order
        self._name: Path | None = None
        self._replaced: Path | None = None
        self.kind = QComboBox()
        for kind, text in KINDS.items():
            self.kind.addItem(text, kind)
        self.first = NumberField(1, LAST_FRAME, decimals=0, step=1)
        self.last = NumberField(1, LAST_FRAME, decimals=0, step=1)
        self.last.show_value(timeline.n_frames)
        self.number = NumberField(1, 10_000, decimals=0, step=1)
        self.number.show_value(N_ROUND)
        self.width_field = NumberField(1, LARGEST_PX, decimals=0, step=10, unit="px")
        self.height_field = NumberField(1, LARGEST_PX, decimals=0, step=10, unit="px")
        self.width_field.show_value(size[0])
        self.height_field.show_value(size[1])
        self.transparent = QCheckBox("Transparent background")
        of_ply = "A file for each frame, in the order and layout of the one open."
        if file.layout.columns is None:
            of_ply = "A file for each frame, in the order of the one open, no longer compressed."
        self.choice = FormatChoice(file, threads, of_ply, is_edited=True)
        self.choice.chosen.connect(self._on_format_chosen)
        self.choice.told.connect(self._show_whether_possible)
        self.finished.connect(self.choice.give_up)
        self.note = PlainLabel(wordWrap=True)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        # Focus goes to it while Export is off, and Return shall not mean it then.
        buttons.button(QDialogButtonBox.StandardButton.Cancel).setAutoDefault(False)
        self.accept_button = buttons.addButton("Export…", QDialogButtonBox.ButtonRole.AcceptRole)
        self.accept_button.setDefault(True)
        buttons.accepted.connect(self._ask_for_path)
        buttons.rejected.connect(self.reject)
        self._rows: dict[str, tuple[QWidget, ...]] = {}
        layout = QVBoxLayout(self)
        layout.setContentsMargins(5 * STEP, 5 * STEP, 5 * STEP, 4 * STEP)
        layout.setSpacing(4 * STEP)
        layout.addLayout(self._form())
        layout.addWidget(self.choice)
        layout.addWidget(self.note)
        layout.addStretch(1)
        layout.addWidget(buttons)
        self.kind.currentIndexChanged.connect(self._show)
        self.kind.setCurrentIndex(0 if timeline.keys else 1 if timeline.camera_keys else 2)
        self._show()

    def _form(self) -> QGridLayout:
        """What is asked for, a row each."""
        grid = QGridLayout()
        grid.setHorizontalSpacing(3 * STEP)
        grid.setVerticalSpacing(2 * STEP)
        self._add_row(grid, "kind", "What", self.kind)
        self._add_row(grid, "frames", "Frames", self.first, PlainLabel("to"), self.last)
        self._add_row(grid, "number", "Pictures", self.number)
        self._add_row(grid, "size", "Size", self.width_field, PlainLabel("×"), self.height_field)
        self._add_row(grid, "transparent", "", self.transparent)
        return grid

    def _add_row(self, grid: QGridLayout, name: str, text: str, *widgets: QWidget) -> None:
        label = form_label(text, widgets[0])
        line = QHBoxLayout()
        line.setSpacing(STEP)
        for widget in widgets:
            line.addWidget(widget, 0 if isinstance(widget, QLabel) else 1)
        grid.addWidget(label, len(self._rows), 0)
        grid.addLayout(line, len(self._rows), 1)
        self._rows[name] = (label, *widgets)

    def _show(self) -> None:
        kind = self.kind.currentData()
        shown = {"splats": ("frames",), "pictures": ("frames", "size", "transparent")}
        for name, widgets in self._rows.items():
            is_shown = name == "kind" or name in shown.get(kind, ("number", "size", "transparent"))
            for widget in widgets:
                widget.setVisible(is_shown)
        self.choice.setVisible(kind == "splats")
        self._name = None
        self._say("", "quiet")
        self._show_whether_possible()

    def _show_whether_possible(self) -> None:
        self.accept_button.setEnabled(self.kind.currentData() != "splats" or self.choice.is_told)

    def _say(self, text: str, tone: str) -> None:
        self.note.setText(text)
        set_tone(self.note, tone)
        self.note.setVisible(bool(text))

    def _on_format_chosen(self, name: str) -> None:
        self.choice.show_format(FORMATS[name])
        self._name = None
        self._say("", "quiet")

    def _ask_for_path(self) -> None:
        of_splats = self.kind.currentData() == "splats"
        suffix = self.choice.format.suffixes[0] if of_splats else ".png"
        suggested = self._name or folder_to_write(self._source) / f"{stem_of(self._source)}{suffix}"
        dialog = QFileDialog(self.parentWidget(), "Name the frames", str(suggested))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        # Most frames get a number of their own, and the name itself is not written; where it is, `_is_clear` says so.
        dialog.setOption(QFileDialog.Option.DontConfirmOverwrite)
        dialog.setNameFilter(_SPLATS if of_splats else _PICTURES)
        dialog.setDefaultSuffix(suffix[1:])
        # A filter gives the name its own first ending.
        dialog.selectFile(str(suggested))
        dialog.fileSelected.connect(lambda name: self.export_to(Path(name)))
        dialog.open()

    def export_to(self, path: Path) -> None:
        """Order the frames under a name; what is to be known of the name first is said instead, once."""
        QSettings().setValue("files/folder", str(path.parent))
        kind = self.kind.currentData()
        if not self._is_clear(path):
            self._name = path
            return
        first, last = sorted((int(self.first.value()), int(self.last.value())))
        frames = range(1, int(self.number.value()) + 1) if kind == "turntable" else range(first, last + 1)
        size = int(self.width_field.value()), int(self.height_field.value())
        as_3dgs = self.choice.as_3dgs
        self._order(FrameOrder(kind, frames, path, size, self.transparent.isChecked(), as_3dgs))
        self.accept()

    def _is_clear(self, path: Path) -> bool:
        """Whether all is said that is to be known of a name: what its format loses, and that a file is replaced."""
        if self.kind.currentData() == "splats":
            try:
                row = format_to_write(path)
            except FormatError as error:
                self._say(str(error), "danger")
                return False
            if row.name != self.choice.format.name:
                self.choice.show_format(row)
                self._say(f"{path.name} is {row.title}: see above what that loses, then export.", "warning")
                return False
        if holds_all_frames(path) and path.exists() and path != self._replaced:
            self._replaced = path
            self._say(f"{path.name} exists: it is replaced when you export again.", "warning")
            return False
        return True
