"""Undo, redo, and the background work."""

from splap_editor.session.session import Session
from splap_editor.tools.tool_manager import ToolManager


class EditActions:
    """Undo, redo, and the background work."""

    def __init__(self, session: Session, tools: ToolManager) -> None:
        self._session = session
        self._tools = tools

    def undo(self) -> None:
        """Take the last step back; a drag under way is dropped first."""
        self._tools.cancel()
        self._session.history.undo()

    def redo(self) -> None:
        """Repeat the step taken back."""
        self._tools.cancel()
        self._session.history.redo()

    def stop(self) -> None:
        """Cancel the background work."""
        self._session.halt()

    def resume(self) -> None:
        """Go on with it."""
        self._session.resume()
