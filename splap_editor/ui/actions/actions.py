"""The action table as live actions."""

from collections.abc import Callable

from PySide6.QtGui import QAction, QActionGroup, QKeySequence
from PySide6.QtWidgets import QWidget

from splap_editor.ui.actions.action_table import ACTIONS, ActionSpec
from splap_editor.ui.theme import icon


class ActionSet:
    """The table as live `QAction` objects.

    Parameters
    ----------
    owner : QWidget
        The window in which the shortcuts hold.
    performers : dict
        Objects that carry the actions out, by the first part of the ids. A method that belongs to a checkable action
        without a group takes the new state.
    is_met : callable
        ``is_met(condition)`` tells whether a ``needs`` holds.
    """

    def __init__(self, owner: QWidget, performers: dict[str, object], is_met: Callable[[str], bool]) -> None:
        self._is_met = is_met
        self._actions: dict[str, QAction] = {}
        groups: dict[str, QActionGroup] = {}
        for spec in ACTIONS:
            part, _, method = spec.action_id.partition(".")
            action = QAction(spec.text, owner)
            action.setObjectName(spec.action_id)
            action.setShortcuts([QKeySequence(keys) for keys in spec.shortcuts])
            action.setToolTip(tooltip(spec))
            action.setStatusTip(spec.tip)
            action.setCheckable(spec.checkable)
            if spec.icon:
                action.setIcon(icon(spec.icon))
                action.setIconVisibleInMenu(False)
            if spec.group:
                groups.setdefault(spec.group, QActionGroup(owner)).addAction(action)
            perform = getattr(performers[part], method)
            if spec.checkable and not spec.group:
                action.triggered.connect(perform)
            else:
                action.triggered.connect(lambda checked=False, perform=perform: perform())
            owner.addAction(action)
            self._actions[spec.action_id] = action
        self.refresh()

    def __getitem__(self, action_id: str) -> QAction:
        return self._actions[action_id]

    def refresh(self) -> None:
        """Enable what can be used."""
        for spec in ACTIONS:
            self._actions[spec.action_id].setEnabled(not spec.needs or self._is_met(spec.needs))

    def check(self, action_id: str, checked: bool = True) -> None:
        """Show a state without performing the action."""
        self._actions[action_id].setChecked(checked)


def tooltip(spec: ActionSpec) -> str:
    """Rich text: name, shortcut in the quiet colour, and what it does."""
    keys = f' &nbsp;<span style="color:#9fa1a8">{shown_keys(spec.shortcuts[0])}</span>' if spec.shortcuts else ""
    return f"<p style='white-space:pre'><b>{spec.label}</b>{keys}</p>{spec.tip}"


def shown_keys(shortcut: str) -> str:
    """Shortcut as the platform writes it."""
    return QKeySequence(shortcut).toString(QKeySequence.SequenceFormat.NativeText).replace("<", "&lt;")
