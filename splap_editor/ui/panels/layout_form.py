"""Overriding what a file was taken for."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QGridLayout, QWidget

from splap_editor.io.layout import AXIS_NAMES
from splap_editor.io.layouts import suiting_layouts
from splap_editor.io.ply import SplatFile
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.options_form import form_label

AXIS_WORDS = {None: "Thinnest axis", 0: "Axis 0", 1: "Axis 1", 2: "Axis 2"}


class LayoutForm(QWidget):
    """Two choices: the layout, and the local axis that is the normal.

    `chosen` gives what ``Session.open(layout=...)`` takes, None to have the
    file recognised. The form shows what the file was read as until it is
    read anew.
    """

    chosen = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._file: SplatFile | None = None
        self.layouts = Choice(toolTip="Read the file as another trainer's.")
        self.axes = Choice(toolTip="The local axis that points out of the surface.")
        for box in (self.layouts, self.axes):
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.layouts.activated.connect(lambda index: self._choose_layout(self.layouts.itemData(index)))
        self.axes.activated.connect(lambda index: self._choose_axis(self.axes.itemData(index)))
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        for row, (text, box) in enumerate((("Read as", self.layouts), ("Normal", self.axes))):
            grid.addWidget(form_label(text, box), row, 0)
            grid.addWidget(box, row, 1)

    def show_file(self, file: SplatFile) -> None:
        """Show what a file was read as, and what else it could be."""
        if self._file is None or self._file.table is not file.table:
            self.layouts.clear()
            self.layouts.addItem("Recognise it", None)
            for name in suiting_layouts(file.table):
                self.layouts.addItem(name, name)
            self.axes.clear()
            axes = (2,) if file.layout.n_scales == 2 else tuple(AXIS_NAMES)
            for axis in axes:
                self.axes.addItem(AXIS_WORDS[axis], -1 if axis is None else axis)
        self._file = file
        self.layouts.setCurrentIndex(self.layouts.findData(file.layout.name))
        axis = file.layout.normal_axis
        self.axes.setCurrentIndex(self.axes.findData(-1 if axis is None else axis))

    def _choose_layout(self, name: str | None) -> None:
        file = self._file
        if file is None:
            return
        layout = file.layout
        self.show_file(file)
        is_new = layout.is_chosen if name is None else name != layout.name
        if is_new:
            self.chosen.emit(name)

    def _choose_axis(self, axis: int) -> None:
        file = self._file
        if file is None:
            return
        layout = file.layout
        self.show_file(file)
        wanted = None if axis < 0 else axis
        if wanted != layout.normal_axis:
            self.chosen.emit(f"{layout.name}@{AXIS_NAMES[wanted]}")
