"""Tables of bindings: what they read, and what is made of them."""

import pytest

from splap_editor.tools.bindings import Binding, answering, chord, hint_of
from splap_editor.tools.navigate_tool import NavigateTool
from splap_editor.tools.tool_table import FIRST, TOOLS, bindings_by_group
from splap_editor.tools.transform_tool import TransformTool

NONE = frozenset()


def test_a_chord_is_a_name_and_its_modifiers():
    assert chord("Shift+Ctrl+Drag") == ("Drag", {"Shift", "Ctrl"})
    assert chord("Any+Wheel") == ("Wheel", None)
    assert chord("[") == ("BracketLeft", NONE)
    with pytest.raises(ValueError, match="Strg"):
        chord("Strg+Drag")


def test_modifiers_are_exact_unless_any():
    plain, any_ = Binding(("Drag",), print), Binding(("Any+Drag",), print)
    held = frozenset({"Ctrl"})
    assert list(answering((plain, any_), "Drag", held)) == [any_]
    assert list(answering((plain, any_), "Drag", NONE)) == [plain, any_]
    assert not list(answering((plain, any_), "Click", NONE))


def test_a_hint_tells_the_brief_rows():
    rows = (
        Binding(("Click",), print, "Do it", "do", on="the surface"),
        Binding(("Esc",), print, "Stop"),
        Binding(("Ctrl+Wheel", "[", "]"), print, "Resize", "size"),
    )
    assert hint_of(rows) == "Click on the surface: do  ·  Ctrl + wheel, [ ]: size"


def test_no_two_rows_of_a_tool_answer_the_same():
    for kind in (NavigateTool, TransformTool, *(entry.kind for entry in TOOLS)):
        for table in (kind.bindings, kind.active_bindings):
            chords = [chord(text) for row in table for text in row.chords]
            assert len(set(chords)) == len(chords), kind


def test_every_tool_that_can_be_chosen_is_told():
    told = {row for rows in bindings_by_group().values() for row in rows}
    for entry in TOOLS:
        assert set(entry.kind.bindings) <= told | {row for row in entry.kind.bindings if not row.sentence}
        assert hint_of(entry.kind.bindings), entry.name
    assert FIRST in {entry.name for entry in TOOLS}
