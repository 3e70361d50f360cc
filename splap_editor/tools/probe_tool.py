"""What lies under the cursor, for read-outs."""

from splap_editor.core.index_spaces import FileRow
from splap_editor.session.signals import Signal
from splap_editor.tools.tool import PointerEvent, Tool, ToolContext


class ProbeTool(Tool):
    """Stands before the chosen tool, watches, and uses no event up.

    `changed` tells another `row` under the cursor. It looks only while
    something wants to know: see `is_on`.
    """

    name = "probe"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.changed = Signal()
        self.is_on = False
        self.row: FileRow | None = None

    def hover(self, event: PointerEvent) -> bool:
        """Look where the pointer goes, but not during a drag."""
        if self.is_on:
            hit = self.context.viewport.pick(*event.xy)
            self._take(hit.row if hit is not None else None)
        return False

    def left(self) -> None:
        """Nothing is under the pointer."""
        self._take(None)

    def cancel(self) -> None:
        """Forget what was under the cursor."""
        self._take(None)

    def _take(self, row: FileRow | None) -> None:
        if row != self.row:
            self.row = row
            self.changed.emit()
