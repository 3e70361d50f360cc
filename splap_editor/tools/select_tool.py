"""What the selection tools have in common: a click, the modifiers, one step of the history."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.options import option
from splap_editor.session.selection import SelectionMode, combined_selection
from splap_editor.tools.bindings import Binding, Used
from splap_editor.tools.tool import PointerEvent, Tool, ToolContext

MODES = (
    ("", SelectionMode.REPLACE, ""),
    ("Shift+", SelectionMode.ADD, "Add"),
    ("Ctrl+", SelectionMode.REMOVE, "Remove"),
    ("Shift+Ctrl+", SelectionMode.INTERSECT, "Keep what is in both"),
)
"""What the modifiers mean, the one place where they do."""


@dataclass(frozen=True)
class SelectOptions:
    """What all selection tools share.

    Parameters
    ----------
    through : bool
        Also splats behind others.
    """

    through: bool = option(
        False, "Also select what lies behind; otherwise only what is visible.", label="Select through"
    )


class DrawnStroke(ABC):
    """A region drawn on the screen; the release selects what is in it."""

    def __init__(self, tool: "SelectTool", press: PointerEvent, mode: SelectionMode) -> None:
        self.tool = tool
        self.context = tool.context
        self.mode = mode
        self.before = self.context.session.shown_scene.selection
        self.path = [press.xy]

    @abstractmethod
    def move(self, event: PointerEvent) -> None:
        """Draw on."""

    @abstractmethod
    def inside(self, screen: NDArray[np.float32]) -> FileMask:
        """(N,) which `screen_points` are in the region."""

    def end(self, event: PointerEvent) -> None:
        """Select."""
        self.move(event)
        viewport = self.context.viewport
        screen = viewport.screen_points()
        picked = self.inside(screen)
        self.context.hud.clear()
        self.tool.select(picked if self.tool.is_through else viewport.visible_only(screen, picked), self.mode)

    def cancel(self) -> None:
        """Draw nothing."""
        self.context.hud.clear()


class SelectTool(Tool):
    """A click picks the splat under it; beside the object with no modifier it clears the selection."""

    option_kinds: ClassVar[tuple[type, ...]] = (SelectOptions,)

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self._shared = context.held(SelectOptions)

    @property
    def is_through(self) -> bool:
        """Whether what lies behind is selected too."""
        return self._shared.value.through

    def pick(self, event: PointerEvent, mode: SelectionMode) -> None:
        """Select the splat under the pointer."""
        picked = np.zeros_like(self.context.session.shown_scene.selection)
        hit = self.context.viewport.pick(*event.xy)
        if hit is not None:
            picked[hit.row] = True
        self.select(picked, mode)

    def select(self, picked: FileMask, mode: SelectionMode) -> None:
        """Let picked splats meet those selected: one step of the history."""
        session = self.context.session
        session.steps.change_mask(
            "selection", combined_selection(session.shown_scene.selection, picked, mode), "Select"
        )


def picking(
    act: Callable[..., Used],
    sentence: str,
    brief: str = "",
    *,
    gesture: str = "Drag",
    also: str = "",
    at_once: bool = False,
) -> tuple[Binding, ...]:
    """Rows for a gesture, or another, with each of the modifiers; ``act(tool, event, mode)``."""
    return tuple(
        Binding(
            tuple(held + each for each in (gesture, also) if each),
            partial(act, mode=mode),
            what or sentence,
            what.lower() or brief,
            at_once=at_once,
        )
        for held, mode, what in MODES
    )


CLICKS = tuple(
    replace(binding, brief="")
    for binding in picking(SelectTool.pick, "The splat under the pointer; beside it, none", gesture="Click")
)
