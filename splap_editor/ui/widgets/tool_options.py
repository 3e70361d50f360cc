"""The bar over the viewport: options of the chosen tool at the left, the display at the right."""

from dataclasses import replace

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QToolButton, QWidget

from splap_editor.tools.handle_tool import RADIUS_RANGE, HandleTool
from splap_editor.tools.select_tool import SelectTool
from splap_editor.tools.tool import ToolManager
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import NumberField, ScrubLabel

NAMES = {"handle": "Handle", "pin": "Pin", "select": "Select", "inspect": "Inspect"}


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
        self._title = QLabel()
        self._title.setMinimumWidth(52)
        self._title.setStyleSheet("font-weight: 600;")
        self._pages = {name: self._page(name) for name in tools.tools}
        layout = QHBoxLayout(self)
        layout.setContentsMargins(3 * STEP, STEP, 2 * STEP, STEP)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self._title)
        for page in self._pages.values():
            layout.addWidget(page)
        layout.addStretch(1)
        for group in (
            ("edit.undo", "edit.redo"),
            ("display.ellipses", "display.splats", "display.points"),
            ("handle.local", "view.orthographic", "view.frame_selection"),
            ("view.panels",),
        ):
            layout.addSpacing(STEP)
            strip = QHBoxLayout()
            strip.setSpacing(2)
            for action_id in group:
                strip.addWidget(_icon_button(actions, action_id))
            layout.addLayout(strip)
        self._through = actions["select.through"]
        self._add_through(actions)
        tools.chosen_changed.connect(self._show)
        self._show()

    def _page(self, name: str) -> QWidget:
        tool = self._tools.tools[name]
        page = QWidget()
        row = QHBoxLayout(page)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(STEP)
        if isinstance(tool, HandleTool):
            field = NumberField(100 * RADIUS_RANGE[0], 100 * RADIUS_RANGE[1], decimals=1, step=0.5, unit="%")
            field.setToolTip("Radius of the disc on the surface, of the size of the scene; [ and ] change it too")
            field.setFixedWidth(64)
            field.committed.connect(lambda share: tool.set_radius(share / 100))
            grip = ScrubLabel("Reach", field)
            grip.moved.connect(lambda share: tool.set_radius(share / 100))
            tool.radius_changed.connect(lambda: field.show_value(100 * tool.radius))
            field.show_value(100 * tool.radius)
            row.addWidget(grip)
            row.addWidget(field)
        elif isinstance(tool, SelectTool):
            field = NumberField(3, 400, decimals=0, step=2, unit="px")
            field.setToolTip("Radius of the brush; [ and ] change it too")
            field.setFixedWidth(64)
            field.committed.connect(lambda size: self._set_brush(tool, size))
            grip = ScrubLabel("Brush", field)
            grip.moved.connect(lambda size: self._set_brush(tool, size))

            def show() -> None:
                for part in (grip, field):
                    part.setVisible(tool.options.shape == "brush")
                field.show_value(tool.options.brush_px)
                self._show()

            tool.options_changed.connect(show)
            row.addWidget(grip)
            row.addWidget(field)
            for part in (grip, field):
                part.setVisible(tool.options.shape == "brush")
        return page

    def _add_through(self, actions: ActionSet) -> None:
        for name, tool in self._tools.tools.items():
            if isinstance(tool, SelectTool):
                button = _icon_button(actions, "select.through")
                button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
                button.setText("Through")
                self._pages[name].layout().addWidget(button)

    @staticmethod
    def _set_brush(tool: SelectTool, size: float) -> None:
        tool.set_options(replace(tool.options, brush_px=size))

    def _show(self) -> None:
        chosen = self._tools.chosen
        for name, page in self._pages.items():
            page.setVisible(self._tools.tools[name] is chosen)
        shape = chosen.options.shape if isinstance(chosen, SelectTool) else ""
        self._title.setText({"lasso": "Lasso", "brush": "Brush"}.get(shape, NAMES.get(chosen.name, chosen.name)))


def _icon_button(actions: ActionSet, action_id: str) -> QToolButton:
    button = QToolButton(autoRaise=True)
    button.setDefaultAction(actions[action_id])
    button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonIconOnly)
    button.setIconSize(QSize(18, 18))
    button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    return button
