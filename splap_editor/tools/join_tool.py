"""Tying two parts together across a gap: by a stroke across it, or one over each rim."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from splap_editor.core.graph.options import Joint
from splap_editor.core.index_spaces import FileMask, FileRow
from splap_editor.engine.surface import Surface
from splap_editor.session.jobs import Job
from splap_editor.session.joint_preview import FoundJoint, default_reach, found_joint, gap_in, rims_of
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, ToolContext
from splap_editor.tools.two_part_tool import TwoPartTool

STEP = 1.25
"""A press of a bracket makes the reach so many times as large or as small."""

MOST_STEPS = 16


class JoinTool(TwoPartTool):
    """A stroke across a gap, or one over each of its rims, shows the contacts that would tie them; Return adds them.

    With nothing pointed at, Return shows what would tie the selection to the rest.
    """

    name = "join"
    looking = "Looking for contacts …"
    color = (0.25, 0.95, 0.45)

    def __init__(self, context: ToolContext) -> None:
        self.steps = 0
        super().__init__(context)

    def wanted(self) -> Joint:
        """The joint of both parts."""
        a, b = self.parts
        return Joint(a, b, default_reach(a, b) * STEP**self.steps)

    def finder(self) -> Callable[[Surface, Joint], FoundJoint]:
        """Find the contacts."""
        return found_joint

    def take_rows(self, *parts: tuple[int, ...]) -> None:
        """Take some file rows as a part; those of a stroke across a gap as both."""
        surface = self.context.session.shown_scene.surface
        if len(parts) == 1 and len(self.parts) != 1 and surface is not None:
            (rows,) = parts
            split = gap_in(surface, rows)
            if split is not None:
                parts = rows[:split], rows[split:]
        super().take_rows(*parts)

    def drop(self) -> None:
        """Forget both parts, and show no contacts."""
        self.steps = 0
        super().drop()

    def stretch(self, event: KeyEvent) -> bool:
        """Reach farther, or less far."""
        if len(self.parts) < 2:
            return False
        self.steps = int(np.clip(self.steps + (1 if event.key == "BracketRight" else -1), -MOST_STEPS, MOST_STEPS))
        self.ask()
        return True

    def tie(self, event: KeyEvent) -> bool:
        """Add the contacts that are shown, in one step of the history; with nothing pointed at, take the selection."""
        session = self.context.session
        scene = session.scene
        if scene is None or scene.surface is None:
            return False
        if not self.parts and scene.selection.any():
            self._take_selection(scene.surface, scene.selection.copy())
        elif self.found is not None and len(self.found.rows):
            graph, joint = scene.edit.graph, self.found.stroke
            self.drop()
            session.steps.change_edit(scene.edit.with_options(replace(graph, join=(*graph.join, joint))), "Join")
        else:
            return bool(self.parts)
        return True

    def _take_selection(self, surface: Surface, selection: FileMask) -> None:
        """Take the rims of the gap between the selection and the rest as the two parts."""
        self.context.hud.show(text=self.looking)

        def make(job: Job) -> tuple[tuple[FileRow, ...], tuple[FileRow, ...]]:
            return rims_of(surface, selection)

        def take(rims: tuple[tuple[FileRow, ...], tuple[FileRow, ...]]) -> None:
            scene = self.context.session.scene
            if scene is not None and scene.surface is surface and not self.parts:
                super(JoinTool, self).take_rows(*rims)

        self._job.ask(make, take)

    def shown(self, found: Any, positions: np.ndarray) -> tuple[list[np.ndarray], str]:
        """Contacts that would be added."""
        within = f"within {found.stroke.reach:.3g}"
        if not len(found.rows):
            return [], f"No splats to join {within} · ] reaches farther"
        n = len(found.rows)
        text = f"{n:,} contact{'' if n == 1 else 's'} {within} · Return joins · [ ] reach less, farther"
        return list(positions[found.rows]), text

    bindings = (
        Binding(("Drag",), TwoPartTool.draw, "A stroke across a gap, or over each of its rims", "stroke across a gap"),
        Binding(("Click",), TwoPartTool.place, "One place on a rim instead of a stroke", on="the surface"),
        Binding(("[", "]"), stretch, "Reach less far or farther", "reach"),
        Binding(("Return", "Enter"), tie, "Add the contacts, or show those of selection and rest", "join"),
        Binding(("Esc",), TwoPartTool.let_go, "Forget both rims", "forget"),
    )
