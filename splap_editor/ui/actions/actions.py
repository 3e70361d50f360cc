"""The action table as live actions."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from PySide6.QtGui import QAction, QActionGroup, QKeySequence
from PySide6.QtWidgets import QWidget

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.conditions import State
from splap_editor.ui.theme import icon


class ActionSet:
    """The table as live `QAction` objects.

    Parameters
    ----------
    owner : QWidget
        The window in which the shortcuts hold.
    specs : tuple of ActionSpec
    performers : iterable
        Objects that carry the actions out, one of each kind.
    state : State
        What tells which actions can be used.
    """

    def __init__(
        self, owner: QWidget, specs: tuple[ActionSpec, ...], performers: Iterable[object], state: State
    ) -> None:
        self.specs = specs
        self._state = state
        self._actions: dict[str, QAction] = {}
        performers = tuple(performers)
        groups: dict[str, QActionGroup] = {}
        for spec in specs:
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
            perform = _bound(spec.act, performers)
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
        for spec in self.specs:
            self._actions[spec.action_id].setEnabled(spec.needs(self._state))

    def check(self, action_id: str, checked: bool = True) -> None:
        """Show a state without performing the action."""
        self._actions[action_id].setChecked(checked)


def _bound(act: Callable[..., Any], performers: Iterable[object]) -> Callable[..., Any]:
    """Bind the method of an action to the object that has it.

    Raises
    ------
    LookupError
        None of the performers has it.
    """
    method = act.func if isinstance(act, partial) else act
    for performer in performers:
        if any(method in vars(kind).values() for kind in type(performer).__mro__):
            bound = method.__get__(performer)
            return partial(bound, *act.args, **act.keywords) if isinstance(act, partial) else bound
    raise LookupError(f"nothing in the window carries out {method.__qualname__}")


def tooltip(spec: ActionSpec) -> str:
    """Rich text: name, shortcut in the quiet colour, and what it does."""
    keys = f' &nbsp;<span style="color:#9fa1a8">{shown_keys(spec.shortcuts[0])}</span>' if spec.shortcuts else ""
    return f"<p style='white-space:pre'><b>{spec.label}</b>{keys}</p>{spec.tip}"


def shown_keys(shortcut: str) -> str:
    """Shortcut as the platform writes it."""
    return QKeySequence(shortcut).toString(QKeySequence.SequenceFormat.NativeText).replace("<", "&lt;")
