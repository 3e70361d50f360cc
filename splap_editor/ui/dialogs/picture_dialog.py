"""A picture of the view, in any size."""

from pathlib import Path

from PySide6.QtCore import QSettings, QSize, QStandardPaths, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QVBoxLayout,
    QWidget,
)

from splap_editor.io.png import write_png
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import form_label
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.ui.widgets.toast import Toast
from splap_editor.viewport.screenshot import LARGEST_PX, screenshot
from splap_editor.viewport.viewport import Viewport

SIZES = {"Full HD": (1920, 1080), "4K": (3840, 2160), "Square": (2048, 2048)}


class PictureDialog(QDialog):
    """Asks for size and background, then for a name."""

    def __init__(self, parent: QWidget, viewport: Viewport, source: Path, toast: Toast) -> None:
        super().__init__(parent)
        self.setWindowTitle("Save picture")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._viewport, self._source, self._toast = viewport, source, toast
        projection = viewport.projection
        sizes = {"As in the window": (projection.width, projection.height), **SIZES}
        self.preset = QComboBox()
        for name, size in sizes.items():
            self.preset.addItem(name, QSize(*size))
        self.preset.addItem("Other", None)
        self.width_field = NumberField(1, LARGEST_PX, decimals=0, step=10, unit="px")
        self.height_field = NumberField(1, LARGEST_PX, decimals=0, step=10, unit="px")
        self.transparent = QCheckBox("Transparent background")
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        buttons.addButton("Save…", QDialogButtonBox.ButtonRole.AcceptRole).setDefault(True)
        buttons.accepted.connect(self._on_accepted)
        buttons.rejected.connect(self.reject)
        size_row = QHBoxLayout()
        size_row.addWidget(self.width_field, 1)
        size_row.addWidget(PlainLabel("×"))
        size_row.addWidget(self.height_field, 1)
        grid = QGridLayout()
        grid.setHorizontalSpacing(3 * STEP)
        grid.setVerticalSpacing(2 * STEP)
        grid.addWidget(form_label("Size", self.preset), 0, 0)
        grid.addWidget(self.preset, 0, 1)
        grid.addLayout(size_row, 1, 1)
        grid.addWidget(self.transparent, 2, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(5 * STEP, 5 * STEP, 5 * STEP, 4 * STEP)
        layout.setSpacing(4 * STEP)
        layout.addLayout(grid)
        layout.addWidget(buttons)
        self.preset.currentIndexChanged.connect(self._on_preset_chosen)
        for field in (self.width_field, self.height_field):
            field.committed.connect(lambda _: self.preset.setCurrentIndex(self.preset.count() - 1))
        self._on_preset_chosen()

    def _on_preset_chosen(self) -> None:
        size = self.preset.currentData()
        if size is not None:
            self.width_field.show_value(size.width())
            self.height_field.show_value(size.height())

    def _on_accepted(self) -> None:
        pictures = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.PicturesLocation)
        folder = Path(str(QSettings().value("files/pictures", pictures, type=str)))
        dialog = QFileDialog(self.parentWidget(), "Save picture", str(folder / f"{self._source.stem}.png"))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setNameFilter("PNG picture (*.png)")
        dialog.setDefaultSuffix("png")
        dialog.fileSelected.connect(lambda name: self.write(Path(name)))
        dialog.open()

    def write(self, path: Path) -> None:
        """Draw the picture and write it."""
        QSettings().setValue("files/pictures", str(path.parent))
        width, height = int(self.width_field.value()), int(self.height_field.value())
        try:
            pixels = screenshot(self._viewport, width, height, is_transparent=self.transparent.isChecked())
            write_png(path, pixels)
        except (ValueError, MemoryError) as error:
            self._toast.fail(f"The picture was not saved: {error}")
            return
        self._toast.say(f"Saved the picture as {path.name}.")
        self.accept()
