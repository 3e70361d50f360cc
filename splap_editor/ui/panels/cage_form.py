"""How far one handle's bounded biharmonic weight reaches."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QGridLayout, QWidget

from splap_editor.core.options import options_of, world_length
from splap_editor.core.reach_options import CageOptions
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import NumberField, ScrubLabel
from splap_editor.ui.widgets.options_form import LABEL_PX

SMALLEST = 1e-6


class CageForm(QWidget):
    """Edits one cage radius: a number in the file's units, or None for the whole object.

    `changed` gives a radius to make an undoable step of; `previewed` one
    that is being dragged or typed.
    """

    changed = Signal(object)
    previewed = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.radius = NumberField(SMALLEST, 1e9, decimals=6, step=0.05)
        self.radius.setToolTip(options_of(CageOptions)["cage_radius"].sentence)
        self.radius.committed.connect(lambda radius: self.changed.emit(radius))
        self.radius.lineEdit().textEdited.connect(self._on_typed)
        self.grip = ScrubLabel("Cage", self.radius)
        self.grip.setMinimumWidth(LABEL_PX)
        self.grip.moved.connect(self._on_scrubbed)
        self.grip.finished.connect(lambda: self.changed.emit(self.radius.value()))
        self.whole = QCheckBox("Reaches the whole object")
        self.whole.setToolTip("No cage: the weight fades over all of it.")
        self.whole.clicked.connect(lambda on: self.changed.emit(None if on else CageOptions.cage_radius))
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        grid.addWidget(self.grip, 0, 0)
        grid.addWidget(self.radius, 0, 1)
        grid.addWidget(self.whole, 1, 0, 1, 2)

    def show_radius(self, radius: float | None, unit: float) -> None:
        """Show a radius; ``unit`` is a typical length, shown where there is no cage, from which the steps follow."""
        self.radius.setSingleStep(0.02 * unit)
        self.whole.setChecked(radius is None)
        for part in (self.grip, self.radius):
            part.setEnabled(radius is not None)
        usual = world_length(CageOptions.cage_radius, unit) or 0.0
        self.radius.show_value(usual if radius is None else radius)

    def _on_scrubbed(self, radius: float) -> None:
        self.radius.show_value(radius)
        self.previewed.emit(radius)

    def _on_typed(self, text: str) -> None:
        number, is_number = self.radius.locale().toDouble(text)
        if is_number and number >= SMALLEST:
            self.previewed.emit(number)
