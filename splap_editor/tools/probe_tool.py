"""What lies under the cursor, for read-outs."""

from splap_editor.session.signals import Signal
from splap_editor.tools.tool import KeyEvent, PointerEvent, ToolContext


class ProbeTool:
    """Stands before the chosen tool, watches, and uses no event up.

    `changed` tells another `row` under the cursor. It looks only while
    something wants to know: see `is_on`.
    """

    name = "probe"
    hint = ""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self.changed = Signal()
        self.is_on = False
        self.row: int | None = None

    def pointer(self, event: PointerEvent) -> bool:
        """Look where the pointer goes, but not during a drag."""
        if event.kind == "move" and not event.buttons and self.is_on and self._context.session.scene is not None:
            hit = self._context.viewport.pick(*event.xy)
            self._take(hit.row if hit is not None else None)
        elif event.kind == "leave":
            self._take(None)
        return False

    def key(self, event: KeyEvent) -> bool:
        """Take no key."""
        return False

    def cancel(self) -> None:
        """Forget what was under the cursor."""
        self._take(None)

    def _take(self, row: int | None) -> None:
        if row != self.row:
            self.row = row
            self.changed.emit()
