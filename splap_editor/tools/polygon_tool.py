"""Selecting splats in an outline whose corners are clicked."""

from splap_editor.session.selection import SelectionMode
from splap_editor.tools.bindings import Binding
from splap_editor.tools.select_tool import SelectTool, picking
from splap_editor.tools.tool import KeyEvent, PointerEvent, ToolContext


class PolygonTool(SelectTool):
    """Each click sets a corner, Return closes; a drag looks around.

    Corners are places on the screen: when the camera moves they stay where they are.
    """

    name = "polygon"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.corners: list[tuple[float, float]] = []

    def corner(self, event: PointerEvent) -> None:
        """Set a corner."""
        self.corners.append(event.xy)
        self._show()

    def hover(self, event: PointerEvent) -> bool:
        """Show the side that a click would add."""
        if self.corners:
            self._show(event.xy)
        return False

    def back(self, event: KeyEvent) -> bool:
        """Take the last corner back."""
        if not self.corners:
            return False
        self.corners.pop()
        self._show()
        return True

    def close(self, event: KeyEvent, mode: SelectionMode) -> bool:
        """Select what is inside; fewer than three corners enclose nothing and stay."""
        if len(self.corners) < 3:
            return bool(self.corners)
        viewport = self.context.viewport
        screen = viewport.screen_points()
        picked = viewport.in_lasso(screen, self.corners)
        self.let_go(event)
        self.select(picked if self.is_through else viewport.visible_only(screen, picked), mode)
        return True

    def let_go(self, event: KeyEvent) -> bool:
        """Forget the corners."""
        had = bool(self.corners)
        self.corners = []
        self._show()
        return had

    def cancel(self) -> None:
        """Forget the corners."""
        super().cancel()
        if self.corners:
            self.corners = []
            self._show()

    def _show(self, *ends: tuple[float, float]) -> None:
        self.context.hud.show(outline=(*self.corners, *ends))

    bindings = (
        Binding(("Any+Click",), corner, "A corner of an outline", "a corner"),
        *picking(close, "The splats inside the outline", "select", gesture="Return", also="Enter"),
        Binding(("Backspace",), back, "Take the last corner back"),
        Binding(("Esc",), let_go, "Forget the outline", "forget"),
    )
