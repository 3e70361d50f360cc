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
from splap_editor.io.splat_files import name_filter
from splap_editor.io.video import VIDEOS
from splap_editor.ui.actions.file_actions import folder_to_write
from splap_editor.ui.theme import STEP
from splap_editor.ui.timeline.frame_export import FrameOrder
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import form_label
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.viewport.screenshot import LARGEST_PX

KINDS = {"ply": "A PLY for each frame", "pictures": "A picture of each frame", "turntable": "Pictures all round"}
N_ROUND = 72

_SPLATS = f"Splats ({name_filter(to_write=True)})"
_PICTURES = f"PNG pictures or a video (*.png {' '.join(f'*{ending}' for ending in VIDEOS)})"


class FramesDialog(QDialog):
    """Asks what, which frames and how large, then for a name.

    Parameters
    ----------
    source : Path
        The open PLY.
    timeline : Timeline
        Without keys only the turntable is of use, and offered first.
    size : (int, int)
        Of pictures at first: that of the viewport.
    order : callable
        Given a `FrameOrder`.
    """

    def __init__(
        self,
        parent: QWidget,
        source: Path,
        timeline: Timeline,
        size: tuple[int, int],
        order: Callable[[FrameOrder], None],
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export frames")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._source, self._order = source, order
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
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        buttons.addButton("Export…", QDialogButtonBox.ButtonRole.AcceptRole).setDefault(True)
        buttons.accepted.connect(self._ask_for_path)
        buttons.rejected.connect(self.reject)
        self._rows: dict[str, tuple[QWidget, ...]] = {}
        grid = QGridLayout()
        grid.setHorizontalSpacing(3 * STEP)
        grid.setVerticalSpacing(2 * STEP)
        self._add_row(grid, "kind", "What", self.kind)
        self._add_row(grid, "frames", "Frames", self.first, PlainLabel("to"), self.last)
        self._add_row(grid, "number", "Pictures", self.number)
        self._add_row(grid, "size", "Size", self.width_field, PlainLabel("×"), self.height_field)
        self._add_row(grid, "transparent", "", self.transparent)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(5 * STEP, 5 * STEP, 5 * STEP, 4 * STEP)
        layout.setSpacing(4 * STEP)
        layout.addLayout(grid)
        layout.addWidget(buttons)
        self.kind.currentIndexChanged.connect(self._show)
        self.kind.setCurrentIndex(0 if timeline.keys else 1 if timeline.camera_keys else 2)
        self._show()

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
        shown = {"ply": ("frames",), "pictures": ("frames", "size", "transparent")}
        for name, widgets in self._rows.items():
            is_shown = name == "kind" or name in shown.get(kind, ("number", "size", "transparent"))
            for widget in widgets:
                widget.setVisible(is_shown)

    def _ask_for_path(self) -> None:
        suffix = "ply" if self.kind.currentData() == "ply" else "png"
        suggested = folder_to_write(self._source) / f"{self._source.stem}.{suffix}"
        dialog = QFileDialog(self.parentWidget(), "Name the frames", str(suggested))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        # Each frame gets a number of its own: the name itself is never written.
        dialog.setOption(QFileDialog.Option.DontConfirmOverwrite)
        dialog.setNameFilter(_SPLATS if suffix == "ply" else _PICTURES)
        dialog.setDefaultSuffix(suffix)
        dialog.fileSelected.connect(lambda name: self.export_to(Path(name)))
        dialog.open()

    def export_to(self, path: Path) -> None:
        """Order the frames under a name."""
        QSettings().setValue("files/folder", str(path.parent))
        first, last = sorted((int(self.first.value()), int(self.last.value())))
        kind = self.kind.currentData()
        frames = range(1, int(self.number.value()) + 1) if kind == "turntable" else range(first, last + 1)
        size = int(self.width_field.value()), int(self.height_field.value())
        self._order(FrameOrder(kind, frames, path, size, self.transparent.isChecked()))
        self.accept()
