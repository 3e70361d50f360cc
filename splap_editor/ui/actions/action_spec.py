"""What the table of actions is made of."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ActionSpec:
    """One thing a person can ask for.

    Parameters
    ----------
    action_id : str
        ``"file.open"``: the part before the dot names the object that carries it out, the part after it the method.
    text : str
        As in the menu; an ellipsis when a dialog follows.
    shortcuts : tuple of str
        As `QKeySequence` reads them; the first is shown.
    icon : str
        File name in ``resources/icons``, or empty.
    tip : str
        One sentence on what it does; the tooltip adds text and shortcut.
    needs : str
        Name of the condition under which it can be used; empty: always.
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
    text: str
    shortcuts: tuple[str, ...] = ()
    icon: str = ""
    tip: str = ""
    needs: str = ""
    menu: str = ""
    group: str = ""
    checkable: bool = False
    breaks: bool = False

    @property
    def label(self) -> str:
        """The text without mnemonic and ellipsis, for tooltips and the help sheet."""
        return self.text.replace("&", "").removesuffix("…")
