"""What the table of actions is made of."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from splap_editor.ui.actions.conditions import State, always


@dataclass(frozen=True)
class ActionSpec:
    """One thing a person can ask for.

    Parameters
    ----------
    action_id : str
        ``"file.open"``: how widgets, settings and tests name it.
    act : callable
        The method of one of the window's ``*Actions`` that carries it out, unbound. That of a checkable action
        without a group takes the new state.
    text : str
        As in the menu; an ellipsis when a dialog follows.
    shortcuts : tuple of str
        As `QKeySequence` reads them; the first is shown.
    icon : str
        File name in ``resources/icons``, or empty.
    tip : str
        One sentence on what it does; the tooltip adds text and shortcut.
    needs : callable
        Whether it can be used.
    menu : str
        Title of the menu; a slash names a submenu. Empty: in no menu.
    group : str
        Checkable actions of one group exclude each other.
    checkable : bool
        Shows a state, kept right by whoever changes it.
    breaks : bool
        A separator stands before it in the menu.
    """

    action_id: str
    act: Callable[..., Any]
    text: str
    shortcuts: tuple[str, ...] = ()
    icon: str = ""
    tip: str = ""
    needs: Callable[[State], bool] = always
    menu: str = ""
    group: str = ""
    checkable: bool = False
    breaks: bool = False

    @property
    def label(self) -> str:
        """The text without mnemonic and ellipsis, for tooltips and the help sheet."""
        return self.text.replace("&", "").removesuffix("…")
