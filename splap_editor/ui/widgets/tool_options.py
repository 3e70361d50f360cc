"""The bar over the viewport: options of the chosen tool at the left, the display at the right."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFrame,
    QHBoxLayout,
    QScrollArea,
    QSizePolicy,
    QToolBar,
    QToolButton,
    QWidget,
)

from splap_editor.tools.tool import Held
from splap_editor.tools.tool_manager import ToolManager
from splap_editor.tools.tool_table import TOOLS
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.theme import STEP, show_more_button
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import NumberField, ScrubLabel
from splap_editor.ui.widgets.options_form import FieldHint, hints_of
from splap_editor.ui.widgets.plain_text import PlainLabel

BUTTONS = (
    ("view.panels",),
    ("edit.undo", "edit.redo"),
    ("display.ellipses", "display.splats", "display.points"),
    ("handle.local", "view.orthographic", "view.frame_selection"),
)
"""Those at the end are the first to make room."""
LEAST_OPTIONS_PX = 80
"""A field and its name."""

TITLES = {entry.name: entry.title for entry in TOOLS}


class ToolOptionsBar(QWidget):
    """Changes with the tool; the display buttons stay.

    Parameters
    ----------
    tools : ToolManager
    actions : ActionSet
    """

    def __init__(self, tools: ToolManager, actions: ActionSet, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("headerBar")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._tools = tools
        self._title = PlainLabel()
        self._title.setMinimumWidth(64)
        self._title.setStyleSheet("font-weight: 600;")
        kinds = dict.fromkeys(kind for tool in tools.tools.values() for kind in tool.option_kinds)
        self.forms = {kind: HeldForm(tools.context.held(kind)) for kind in kinds}
        self._strip = _strip(actions)
        self._row = _row(self.forms.values())
        self._options = _scrolled(self._row)
        self._layout = layout = QHBoxLayout(self)
        layout.setContentsMargins(3 * STEP, STEP, 2 * STEP, STEP)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self._title)
        layout.addWidget(self._options)
        layout.addStretch(1)
        layout.addWidget(self._strip)
        tools.chosen_changed.connect(self._show)
        self._show()

    def minimumSizeHint(self) -> QSize:
        """The width at which options are scrolled and all buttons but two are put away."""
        return QSize(self._least_width + LEAST_OPTIONS_PX, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the options what they take, and the buttons the rest."""
        self._fit()
        super().resizeEvent(event)

    def showEvent(self, event: QShowEvent) -> None:
        """Fit what is shown for the first time."""
        super().showEvent(event)
        self._fit()

    @property
    def _least_width(self) -> int:
        """What all takes but the options."""
        margins, space = self._layout.contentsMargins(), 2 * self._layout.spacing()
        least = self._title.minimumSizeHint().expandedTo(self._title.minimumSize()).width()
        return margins.left() + least + space + self._strip.minimumSizeHint().width() + margins.right()

    def _fit(self) -> None:
        # Before it is shown a tool bar has other sizes, and keeps what it was asked for.
        if not self.isVisible():
            return
        room = max(self.width() - self._least_width, LEAST_OPTIONS_PX)
        self._options.setFixedWidth(min(self._row.sizeHint().width(), room))

    def _show(self) -> None:
        chosen = self._tools.chosen
        for kind, form in self.forms.items():
            form.setVisible(kind in chosen.option_kinds)
        self._title.setText(TITLES[chosen.name])
        self._fit()


class HeldForm(QWidget):
    """Options of a tool in a row, made from what their fields say about themselves; the tool's own changes show."""

    def __init__(self, held: Held) -> None:
        super().__init__()
        self._held = held
        self.editors: dict[str, QWidget] = {}
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(STEP)
        # A length would need the scene's size; tools count in shares of it, or in pixels.
        self._hints = {name: hint for name, hint in hints_of(held.value).items() if not hint.is_length}
        for name, hint in self._hints.items():
            self.editors[name] = self._editor(name, hint, row)
        held.changed.connect(self._show)
        self._show()

    def _editor(self, name: str, hint: FieldHint, row: QHBoxLayout) -> QWidget:
        if isinstance(getattr(self._held.value, name), bool):
            switch = QCheckBox(hint.label)
            switch.setToolTip(hint.tip)
            switch.toggled.connect(lambda on: self._take(name, on))
            row.addWidget(switch)
            return switch
        if hint.choices:
            choice = Choice()
            for value, text in hint.choices.items():
                choice.addItem(text, value)
            choice.setToolTip(hint.tip)
            choice.setAccessibleName(hint.label)
            choice.activated.connect(lambda index: self._take(name, choice.itemData(index)))
            row.addWidget(choice)
            return choice
        is_whole = isinstance(getattr(self._held.value, name), int)
        decimals = 0 if is_whole else hint.decimals
        field = NumberField(hint.low, hint.high, decimals=decimals, step=hint.step, unit=hint.unit)
        field.setToolTip(hint.tip)
        # Six of them fit beside the buttons of a small window.
        field.setMinimumWidth(40)
        field.setMaximumWidth(64)
        grip = ScrubLabel(hint.label, field)
        for told in (field.committed, grip.moved):
            told.connect(lambda number: self._take(name, round(number) if is_whole else number / hint.factor))
        row.addWidget(grip)
        row.addWidget(field)
        return field

    def _take(self, name: str, value: Any) -> None:
        self._held.set(replace(self._held.value, **{name: value}))

    def _show(self) -> None:
        for name, editor in self.editors.items():
            value = getattr(self._held.value, name)
            if isinstance(editor, QCheckBox):
                editor.setChecked(value)
            elif isinstance(editor, Choice):
                editor.setCurrentIndex(editor.findData(value))
            elif isinstance(editor, NumberField):
                editor.show_value(self._hints[name].factor * value)


def _row(forms: Iterable[HeldForm]) -> QWidget:
    """Forms beside each other."""
    row = QWidget()
    layout = QHBoxLayout(row)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(2 * STEP)
    for form in forms:
        layout.addWidget(form)
    return row


def _scrolled(row: QWidget) -> QScrollArea:
    """A row that is scrolled sideways where a small window has no room for all of it."""
    options = QScrollArea(widgetResizable=True)
    options.setFrameShape(QFrame.Shape.NoFrame)
    options.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    options.setWidget(row)
    # The buttons beside it say how high the bar is, from the first layout on: a picture that is laid out anew under
    # another height keeps the memory of both.
    options.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Ignored)
    options.setMinimumHeight(1)
    return options


def _strip(actions: ActionSet) -> QToolBar:
    """The buttons; those that a narrow window has no room for stand in the menu of its last one."""
    strip = QToolBar()
    strip.setObjectName("headerButtons")
    strip.setIconSize(QSize(18, 18))
    for k, group in enumerate(BUTTONS):
        if k:
            strip.addSeparator()
        strip.addActions([actions[action_id] for action_id in group])
    # What is wider than a button each does not grow; what is narrower puts buttons away.
    strip.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Fixed)
    for button in strip.findChildren(QToolButton):
        button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    show_more_button(strip)
    return strip
