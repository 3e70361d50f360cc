"""How splats are drawn."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QSizePolicy, QSlider, QToolButton, QVBoxLayout, QWidget

from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.display import Display
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Slider
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import FieldHint, OptionsForm, form_label

SLIDERS = {
    "size_factor": ("Size", 0.05, 2.0, 2, "1 draws each splat at its true size."),
    "opacity_cut": ("Opacity cut", 0.0, 1.0, 2, "Splats fainter than this are neither drawn nor picked."),
    "backface": ("Backface tint", 0.0, 1.0, 2, "Colours ellipses that are seen from behind."),
}

HINTS = {
    "background": FieldHint(
        "Background", choices={"dark": "Dark", "grey": "Middle grey", "light": "Light", "black": "Black"}
    ),
    "tints": FieldHint("Show what is free and what is fixed", "Handles and pins in their colours; the rest as below."),
    "fixed": FieldHint(
        "What is fixed",
        "How splats look that cannot move: too far from every handle.",
        choices={
            "auto": "Darker, or lighter on a dark object",
            "darker": "Darker",
            "lighter": "Lighter",
            "blue": "Blue",
            "none": "As it is",
        },
        only_for=("tints", (True,)),
    ),
}


class DisplayPanel(QWidget):
    """Modes as buttons of the action table, the rest as sliders with numbers."""

    def __init__(self, display: Display, actions: ActionSet, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._display = display
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        for names in (("ellipses", "splats", "points"), ("deformed", "original", "both")):
            layout.addLayout(_segments(actions, [f"display.{name}" for name in names]))
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        self.sliders: dict[str, QSlider] = {}
        self.fields: dict[str, NumberField] = {}
        for row, (name, (text, low, high, decimals, tip)) in enumerate(SLIDERS.items()):
            slider = Slider(Qt.Orientation.Horizontal)
            slider.setRange(round(low * 100), round(high * 100))
            slider.setToolTip(tip)
            slider.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            field = NumberField(low, high, decimals=decimals, step=0.05)
            field.setFixedWidth(56)
            field.setToolTip(tip)
            slider.valueChanged.connect(lambda value, name=name: self._display.set(**{name: value / 100}))
            field.committed.connect(lambda value, name=name: self._display.set(**{name: value}))
            grid.addWidget(form_label(text, field), row, 0)
            grid.addWidget(slider, row, 1)
            grid.addWidget(field, row, 2)
            self.sliders[name], self.fields[name] = slider, field
        layout.addLayout(grid)
        self.form = OptionsForm(display.options, HINTS)
        self.form.changed.connect(lambda options: display.set(**{name: getattr(options, name) for name in HINTS}))
        layout.addWidget(self.form)
        display.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        options = self._display.options
        for name, slider in self.sliders.items():
            value = getattr(options, name)
            slider.blockSignals(True)
            slider.setValue(round(100 * value))
            slider.blockSignals(False)
            self.fields[name].show_value(value)
        self.form.show_value(options)


def _segments(actions: ActionSet, action_ids: list[str]) -> QHBoxLayout:
    row = QHBoxLayout()
    row.setSpacing(0)
    for action_id in action_ids:
        button = QToolButton()
        button.setDefaultAction(actions[action_id])
        button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        button.setObjectName("segment")
        row.addWidget(button, 1)
    return row
