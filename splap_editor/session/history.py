"""Undo and redo: commands that hold before and after, on a list with a cursor."""

from typing import Protocol

from splap_editor.session.signals import Signal


class Command(Protocol):
    """One undoable step."""

    label: str
    """What the step did, as shown in the Edit menu: "Move handle"."""

    @property
    def nbytes(self) -> int:
        """Memory the step keeps alive, in bytes."""
        ...

    def do(self) -> None:
        """Put the *after* state in place."""
        ...

    def undo(self) -> None:
        """Put the *before* state back."""
        ...


class History:
    """Commands done so far, unlimited in number, bounded in bytes.

    The cursor moves only after a command has succeeded, so a step that raises
    leaves history and model as they were. The oldest steps are forgotten
    first when the kept bytes pass the bound; the newest step always stays.

    Parameters
    ----------
    max_bytes : int
        Memory that the steps together may keep alive.
    """

    def __init__(self, max_bytes: int = 256 << 20) -> None:
        self.changed = Signal()
        self.max_bytes = max_bytes
        self._commands: list[Command] = []
        self._cursor = 0
        self._saved: int | None = 0

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to take back."""
        return self._cursor > 0

    @property
    def can_redo(self) -> bool:
        """Whether there is a step to repeat."""
        return self._cursor < len(self._commands)

    @property
    def undo_label(self) -> str:
        """Label of the step that `undo` would take back, or an empty string."""
        return self._commands[self._cursor - 1].label if self.can_undo else ""

    @property
    def redo_label(self) -> str:
        """Label of the step that `redo` would repeat, or an empty string."""
        return self._commands[self._cursor].label if self.can_redo else ""

    @property
    def is_dirty(self) -> bool:
        """Whether anything changed since `mark_saved`."""
        return self._cursor != self._saved

    @property
    def nbytes(self) -> int:
        """Memory the kept steps hold, in bytes."""
        return sum(command.nbytes for command in self._commands)

    def push(self, command: Command) -> None:
        """Do a command and make it the newest step; steps undone before are forgotten."""
        command.do()
        if self._saved is not None and self._saved > self._cursor:
            self._saved = None
        self._commands[self._cursor :] = [command]
        self._cursor += 1
        self._forget_oldest()
        self.changed.emit()

    def undo(self) -> bool:
        """Take the newest step back; False when there is none."""
        if not self.can_undo:
            return False
        self._commands[self._cursor - 1].undo()
        self._cursor -= 1
        self.changed.emit()
        return True

    def redo(self) -> bool:
        """Repeat the step last taken back; False when there is none."""
        if not self.can_redo:
            return False
        self._commands[self._cursor].do()
        self._cursor += 1
        self.changed.emit()
        return True

    def mark_saved(self) -> None:
        """Remember the current state as the one on disk."""
        self._saved = self._cursor
        self.changed.emit()

    def clear(self) -> None:
        """Forget every step; the current state counts as saved."""
        self._commands.clear()
        self._cursor = 0
        self._saved = 0
        self.changed.emit()

    def set_max_bytes(self, max_bytes: int) -> None:
        """Change the bound; the oldest steps that no longer fit are forgotten at once."""
        self.max_bytes = max_bytes
        before = len(self._commands)
        self._forget_oldest()
        if len(self._commands) != before:
            self.changed.emit()

    def _forget_oldest(self) -> None:
        kept = self.nbytes
        while kept > self.max_bytes and self._cursor > 1:
            kept -= self._commands.pop(0).nbytes
            self._cursor -= 1
            if self._saved is not None:
                self._saved = self._saved - 1 if self._saved > 0 else None
