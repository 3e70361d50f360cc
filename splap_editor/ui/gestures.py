"""What mouse, trackpad and keyboard do, in blocks: the help sheet and the README's table are made of them."""

from collections.abc import Iterable, Iterator

from splap_editor.tools.bindings import Binding, capitalised
from splap_editor.tools.tool_table import bindings_by_group
from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.panels.handle_rows import NameField
from splap_editor.ui.timeline.ruler import TimelineRuler
from splap_editor.ui.viewport_widget import ViewportWidget
from splap_editor.ui.widgets.histogram import Histogram
from splap_editor.ui.widgets.number_field import NumberField, ScrubLabel
from splap_editor.ui.widgets.widget_gestures import Rows

WIDGETS = (ViewportWidget, NameField, Histogram, TimelineRuler, ScrubLabel, NumberField)
"""Kinds of widgets with gestures of their own, beside those of the tools."""


def key_blocks(specs: Iterable[ActionSpec]) -> dict[str, Rows]:
    """Keys and what they do, by title: tools, widgets, then the menus."""
    blocks = {title: tuple(_rows(bindings)) for title, bindings in bindings_by_group().items()}
    for group, rows in (kind.gestures for kind in WIDGETS):
        blocks[group] = (*blocks.get(group, ()), *rows)
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
