"""Taking two parts apart where they touch, by a stroke over each."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from splap_editor.core.graph.options import Separation
from splap_editor.engine.surface import Surface
from splap_editor.session.mends import edges_between, with_cut
from splap_editor.session.seam_preview import FoundSeam, found_seam
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, ToolContext
from splap_editor.tools.two_part_tool import TwoPartTool

WIDEST = 24


class SeparateTool(TwoPartTool):
    """A stroke or click on each of two parts shows the seam between them; Return cuts it, Escape drops it.

    With nothing pointed at, Return takes the selection apart from the rest.
    """

    name = "separate"
    looking = "Looking for the seam …"
    color = (1.0, 0.25, 0.25)

    def __init__(self, context: ToolContext) -> None:
        self.wider = 0
        super().__init__(context)

    def wanted(self) -> Separation:
        """The separation of both parts."""
        return Separation(self.parts[0], self.parts[1], self.wider)

    def finder(self) -> Callable[[Surface, Separation], FoundSeam]:
        """Find the seam."""
        return found_seam

    def drop(self) -> None:
        """Forget both parts, and show no seam."""
        self.wider = 0
        super().drop()

    def widen(self, event: KeyEvent) -> bool:
        """Cut a seam more, or one fewer."""
        if len(self.parts) < 2:
            return False
        self.wider = int(np.clip(self.wider + (1 if event.key == "BracketRight" else -1), -WIDEST, WIDEST))
        self.ask()
        return True

    def cut(self, event: KeyEvent) -> bool:
        """Cut the seam that is shown, or between the selection and the rest: one step of the history."""
        session = self.context.session
        scene = session.scene
        if scene is None or scene.surface is None:
            return False
        graph = scene.edit.graph
        if not self.parts and scene.selection.any():
            pairs = edges_between(scene.ellipses, scene.surface.graph, scene.selection, ~scene.selection)
            wanted = with_cut(graph, pairs)
        elif self.found is not None and len(self.found.rows):
            wanted = replace(graph, separate=(*graph.separate, self.found.stroke))
        else:
            return bool(self.parts)
        self.drop()
        if wanted != graph:
            session.steps.change_edit(scene.edit.with_options(wanted), "Separate")
        return True

    def shown(self, found: Any, positions: np.ndarray) -> tuple[list[np.ndarray], str]:
        """Contacts that would be cut, and the line of the seam through their middles."""
        if not len(found.rows):
            return [], "Nothing joins the two parts"
        contacts = positions[found.rows]
        n = len(contacts)
        text = f"Seam {found.length:.3g} long, {n:,} contact{'' if n == 1 else 's'} · Return cuts · [ ] narrower, wider"
        return [*contacts, *contacts.mean(axis=1)[found.line]], text

    bindings = (
        Binding(("Drag",), TwoPartTool.draw, "A stroke over one part, then over the other", "stroke over each part"),
        Binding(("Click",), TwoPartTool.place, "One place on a part instead of a stroke", on="the surface"),
        Binding(("[", "]"), widen, "Narrower or wider seam", "narrower, wider"),
        Binding(("Return", "Enter"), cut, "Cut the seam, or between selection and the rest", "cut"),
        Binding(("Esc",), TwoPartTool.let_go, "Forget both parts", "forget"),
    )
