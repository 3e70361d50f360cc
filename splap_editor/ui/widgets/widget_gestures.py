"""What pointer and keys do on a widget, told beside the code that does it."""

from typing import NamedTuple

Rows = tuple[tuple[str, str], ...]
"""A gesture or key, and what it does, as a sentence without its stop."""


class WidgetGestures(NamedTuple):
    """Gestures of one kind of widget, the class attribute ``gestures`` of a row of `splap_editor.ui.gestures.WIDGETS`.

    Parameters
    ----------
    group : str
        Title of the block in which the help sheet and the README's table tell them.
    rows : Rows
    """

    group: str
    rows: Rows
