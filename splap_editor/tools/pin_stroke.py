"""Putting a pin elsewhere by its mark."""

import numpy as np

from splap_editor.core.index_spaces import FileRow
from splap_editor.engine.edit import Pin
from splap_editor.session.placement import disc_rows, moved_pin
from splap_editor.tools.tool import CLICK_SLACK_PX, PointerEvent, ToolContext


class PinStroke:
    """The disc under the pointer glows; let go of, it is the pin's. A pin that is no disc stays where it is.

    Parameters
    ----------
    context : ToolContext
    pin : Pin
    press : PointerEvent
        On the pin's mark.
    """

    def __init__(self, context: ToolContext, pin: Pin, press: PointerEvent) -> None:
        self._context = context
        self._pin = pin
        self._press = press
        self._is_drag = False
        self._row: FileRow | None = None

    def move(self, event: PointerEvent) -> None:
        """Light up what it would hold here."""
        self._is_drag |= bool(np.hypot(*np.subtract(event.xy, self._press.xy)) > CLICK_SLACK_PX)
        if not self._is_drag or self._pin.reach is None:
            return
        hit = self._context.viewport.pick(*event.xy)
        row = None if hit is None else hit.row
        if row != self._row:
            self._row = row
            scene = self._context.session.shown_scene
            self._context.viewport.show_disc(None if row is None else disc_rows(scene, row, self._pin.reach))

    def end(self, event: PointerEvent) -> None:
        """Hold what glows instead."""
        self._context.viewport.show_disc(None)
        session = self._context.session
        if self._row is not None:
            pin = moved_pin(session.shown_scene, self._pin, self._row)
            session.steps.change_edit(session.shown_scene.edit.with_pin(pin), "Move pin")

    def cancel(self) -> None:
        """Leave the pin where it was."""
        self._context.viewport.show_disc(None)
