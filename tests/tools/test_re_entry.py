"""What a tool shows is told to others, and comes back to no tool by the way."""

import sys
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import splap_editor.tools
from splap_editor.core.options import options_of
from splap_editor.session.signals import Signal
from splap_editor.tools.tool import Held, Hud, ToolContext
from splap_editor.tools.tool_table import TOOLS

FOLDER = str(Path(splap_editor.tools.__file__).parent)


def entered(frame):
    """The tool, mover or stroke that a frame is a method of; None: another frame."""
    owner = frame.f_locals.get("self") if frame.f_code.co_filename.startswith(FOLDER) else None
    return None if isinstance(owner, Hud | Held | ToolContext) else owner


@contextmanager
def re_entries():
    """Collects calls of a tool, mover or stroke that a signal made while the same one was in its ``show``."""
    found = set()

    def watch(frame, event, _):
        owner = entered(frame) if event == "call" else None
        if owner is None:
            return
        by_signal, above = False, frame.f_back
        while above is not None:
            by_signal = by_signal or above.f_code is Signal.emit.__code__
            if by_signal and above.f_code.co_name in ("show", "_show") and entered(above) is owner:
                found.add(f"{above.f_code.co_qualname} → {frame.f_code.co_qualname}")
            above = above.f_back

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        yield found
    finally:
        sys.setprofile(before)


def other(value, known):
    """Another value of an option."""
    if known.choices:
        return next(choice for choice in known.choices if choice != value)
    return not value if isinstance(value, bool) else type(value)(1.1 * value + 0.01)


def test_no_signal_re_enters_a_tool_while_it_shows_something(hand):
    hand.placed()
    at, gizmo = hand.surface(), hand.viewport.gizmo
    with re_entries() as found:
        for entry in TOOLS:
            hand.tools.choose(entry.name)
            hand.click(at)
            hand.key("G", "X", ".", "1", "Esc", "]", "[")
            start = hand.viewport.projection.pixel(gizmo.frame[:3, 3]) if gizmo.is_shown else at
            hand.drag(start, start + 9, start + 20)
            for kind in entry.kind.option_kinds:
                held = hand.context.held(kind)
                for option, known in options_of(kind).items():
                    held.set(replace(held.value, **{option: other(getattr(held.value, option), known)}))
            hand.key("Esc")
    hand.settle()
    assert found == set()
