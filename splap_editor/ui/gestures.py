"""What mouse, trackpad and keyboard do, in blocks: the help sheet and the README's table are made of them."""

from collections.abc import Iterable, Iterator

from splap_editor.tools.bindings import Binding, capitalised
from splap_editor.tools.tool_table import bindings_by_group
from splap_editor.ui.actions.action_spec import ActionSpec

Rows = tuple[tuple[str, str], ...]

WIDGET_GESTURES: dict[str, Rows] = {
    "Look around": (("Hold O", "Show the original"),),
    "Quantities": (
        ("Drag over the histogram", "Select by value; Shift adds, Ctrl removes"),
        ("Drag the marks below it", "Ends of the colours; double click resets"),
    ),
    "Frames": (
        ("Drag the line", "Look at a frame"),
        ("Drag a diamond, Esc", "Move a key, drop it where it was"),
        ("Right click on a diamond", "Delete the key"),
    ),
    "Numbers": (
        ("Drag a label sideways", "Change the number; Shift finely"),
        ("Return, Esc", "Take it, leave it: the keys are the picture's again"),
    ),
}
"""Gestures of single widgets, beside those of the tools."""


def key_blocks(specs: Iterable[ActionSpec]) -> dict[str, Rows]:
    """Keys and what they do, by title: tools, widgets, then the menus."""
    blocks = {title: tuple(_rows(bindings)) for title, bindings in bindings_by_group().items()}
    for title, rows in WIDGET_GESTURES.items():
        blocks[title] = (*blocks.get(title, ()), *rows)
    for spec in specs:
        if spec.shortcuts:
            title = f"{spec.menu.split('/')[0].replace('&', '')} menu"
            blocks[title] = (*blocks.get(title, ()), (" or ".join(spec.shortcuts[:2]), spec.label))
    return blocks


def _rows(bindings: Iterable[Binding]) -> Iterator[tuple[str, str]]:
    """Rows of a table; what does the same is told once."""
    keys: dict[str, list[str]] = {}
    for binding in bindings:
        told = keys.setdefault(binding.sentence, [])
        if binding.keys not in told:
            told.append(binding.keys)
    return ((capitalised(", ".join(told)), sentence) for sentence, told in keys.items())
