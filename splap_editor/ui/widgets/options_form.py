"""A form made from the fields of a dataclass."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QCheckBox, QComboBox, QGridLayout, QLabel, QWidget

from splap_editor.core.options import Option, options_of, world_length
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.plain_text import PlainLabel

LABEL_PX = 84
"""All labels in front of fields are as wide, so that fields of several forms line up."""


@dataclass(frozen=True)
class FieldHint:
    """How one field is shown.

    Parameters
    ----------
    label, tip, unit : str
    low, high, step : float
        Range and step of a number.
    decimals : int
        Digits after the point of a float.
    choices : dict
        Values of a choice with the words for them; empty for numbers and switches.
    factor : float
        A number is shown so many times its value, as 100 for percent.
    only_for : (str, tuple), optional
        Name and values of another field without which this one means nothing.
    is_length : bool
        A `Length`: shown in the file's units as it comes out in the scene, its lowest number for no bound.
    """

    label: str
    tip: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 1e9
    step: float = 1.0
    decimals: int = 3
    choices: Mapping[Any, str] | None = None
    factor: float = 1.0
    only_for: tuple[str, tuple] | None = None
    is_length: bool = False


_WIDEST = 1e9
"""Bound of a number that has none of its own."""


NO_BOUND = "no bound"
"""A length that is None, in a field."""


def hints_of(group: Any) -> dict[str, FieldHint]:
    """Hints for the options of a group, or of its class, that a form can show."""
    unshown = ("pairs", "strokes")
    return {name: _hint(known) for name, known in options_of(group).items() if known.kind not in unshown}


def _hint(known: Option) -> FieldHint:
    factor = 100.0 if known.is_percent else 1.0
    decimals = known.decimals - 2 if known.is_percent else known.decimals
    # A field has no open end: the least number above the bound that it can show.
    low = known.above + 10.0**-known.decimals if known.above > known.least else known.least
    return FieldHint(
        known.label,
        known.sentence,
        "%" if known.is_percent else "px" if known.unit == "px" else "",
        factor * max(low, -_WIDEST),
        min(factor * known.most, _WIDEST),
        factor * known.step,
        decimals,
        {name: choice.label for name, choice in known.choices.items()},
        factor,
        known.only_for,
        known.kind == "length",
    )


class OptionsForm(QWidget):
    """Edits a frozen dataclass; each finished entry gives a new value.

    Fields come in their order in the class; one without a hint is not shown. Hints are made of the options of the class
    unless given. A length needs the scene's size to be shown.
    """

    changed = Signal(object)

    def __init__(self, value: Any, hints: Mapping[str, FieldHint] | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        hints = hints_of(value) if hints is None else hints
        self._value = value
        self._size = 1.0
        self._hints = {field.name: hints[field.name] for field in fields(value) if field.name in hints}
        self._editors: dict[str, QWidget] = {}
        self._labels: dict[str, QLabel] = {}
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        for row, (name, hint) in enumerate(self._hints.items()):
            editor = self._editor(name, hint, getattr(value, name))
            editor.setObjectName(name)
            editor.setToolTip(hint.tip)
            if isinstance(editor, QCheckBox):
                grid.addWidget(editor, row, 0, 1, 2)
            else:
                label = form_label(hint.label, editor)
                self._labels[name] = label
                grid.addWidget(label, row, 0)
                grid.addWidget(editor, row, 1)
            self._editors[name] = editor
        self.show_value(value)

    @property
    def value(self) -> Any:
        """What it shows."""
        return self._value

    def show_value(self, value: Any, size: float | None = None) -> None:
        """Show a value without telling anyone, in a scene of some size or the one shown before."""
        self._value = value
        self._size = self._size if size is None else size
        for name, editor in self._editors.items():
            held = getattr(value, name)
            editor.blockSignals(True)
            if isinstance(editor, QCheckBox):
                editor.setChecked(held)
            elif isinstance(editor, QComboBox):
                editor.setCurrentIndex(max(editor.findData(held), 0))
            elif isinstance(editor, NumberField) and self._hints[name].is_length:
                length = world_length(held, self._size)
                editor.setSingleStep(0.05 * self._size)
                editor.show_value(editor.minimum() if length is None else length)
            elif isinstance(editor, NumberField):
                editor.show_value(self._hints[name].factor * held)
            editor.blockSignals(False)
            only_for = self._hints[name].only_for
            is_meant = only_for is None or getattr(value, only_for[0]) in only_for[1]
            self.show_field(name, is_meant)

    def show_field(self, name: str, is_shown: bool) -> None:
        """Show or hide one field with its label."""
        self._editors[name].setVisible(is_shown)
        if name in self._labels:
            self._labels[name].setVisible(is_shown)

    def _editor(self, name: str, hint: FieldHint, value: Any) -> QWidget:
        if hint.choices:
            choices = Choice()
            for choice, words in hint.choices.items():
                choices.addItem(words, choice)
            choices.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            choices.currentIndexChanged.connect(lambda index: self._take(name, choices.itemData(index)))
            return choices
        if isinstance(value, bool):
            switch = QCheckBox(hint.label)
            switch.toggled.connect(lambda checked: self._take(name, checked))
            return switch
        if hint.is_length:
            field = NumberField(0.0, hint.high, decimals=4)
            field.setSpecialValueText(NO_BOUND)
            field.committed.connect(lambda number: self._take(name, number if number > field.minimum() else None))
            return field
        kind = type(value)
        decimals = 0 if kind is int else hint.decimals
        field = NumberField(hint.low, hint.high, decimals=decimals, step=hint.step, unit=hint.unit)
        field.committed.connect(lambda number: self._take(name, kind(_round(number / hint.factor))))
        return field

    def _take(self, name: str, held: Any) -> None:
        if getattr(self._value, name) != held:
            self.show_value(replace(self._value, **{name: held}))
            self.changed.emit(self._value)


def _round(number: float) -> float:
    """Number without the last digits, which a factor has changed."""
    return float(f"{number:.12g}")


def form_label(text: str, buddy: QWidget) -> QLabel:
    """Quiet label in front of a field."""
    label = PlainLabel(text)
    label.setProperty("tone", "quiet")
    label.setBuddy(buddy)
    label.setMinimumWidth(LABEL_PX)
    label.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
    label.setToolTip(buddy.toolTip())
    return label
