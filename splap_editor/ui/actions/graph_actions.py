"""What the Graph menu does: edges in view, and mending them."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.presets import PRESETS, with_preset
from splap_editor.session.cards import has_edge
from splap_editor.session.mends import best_links, edges_between, fragment_links, fragments, with_added, with_cut
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.viewport.graph_view import SHOWN, GraphView
from splap_editor.viewport.inspect_view import InspectView


class GraphActions:
    """Cuts and joins; each is one undoable step of the edit.

    `kept_changed` tells that another selection is kept as side A.

    Parameters
    ----------
    session : Session
    graph_view : GraphView
    inspected : InspectView
    say : callable
        Tells the person what was done.
    """

    def __init__(
        self, session: Session, graph_view: GraphView, inspected: InspectView, say: Callable[[str], None]
    ) -> None:
        self.kept: FileMask | None = None
        self.kept_changed = Signal()
        self._session = session
        self._graph_view = graph_view
        self.inspected = inspected
        self._say = say
        SceneFollower(session, self._forget)

    # Edges in view ------------------------------------------------------------------------------------------------

    def off(self) -> None:
        """Draw no edges."""
        self._graph_view.set(shown="off")

    def near(self) -> None:
        """Draw those around the selection."""
        self._graph_view.set(shown="near")

    def all(self) -> None:
        """Draw every edge."""
        self._graph_view.set(shown="all")

    def cycle(self) -> None:
        """Go on to the next way of drawing edges."""
        self._graph_view.set(shown=SHOWN[(SHOWN.index(self._graph_view.options.shown) + 1) % len(SHOWN)])

    # Options ----------------------------------------------------------------------------------------------------------

    def take_preset(self, name: str = "paper") -> None:
        """Set the options that a preset names, for graph, deformers and splats alike."""
        edit = self._session.shown_scene.edit
        self._session.steps.change_edit(replace(edit, options=with_preset(edit.options, name)), PRESETS[name].label)
        self._say(PRESETS[name].sentence)

    # Mends --------------------------------------------------------------------------------------------------------

    def cut_edge(self) -> None:
        """Cut the inspected edge."""
        edge = self.inspected.edge
        if edge is not None and self._is_joined(edge):
            self._cut([edge], "Cut edge")

    def toggle_edge(self) -> None:
        """Cut the inspected edge, or join the two splats if there is none."""
        edge, scene = self.inspected.edge, self._session.scene
        if edge is None or scene is None or scene.surface is None:
            return
        if self._is_joined(edge):
            self.cut_edge()
        else:
            self._change(with_added(self._options, [edge]), "Add edge")

    def keep_selection(self) -> None:
        """Remember the selection as side A."""
        self.kept = self._session.shown_scene.selection.copy()
        self._say(f"Side A: {np.count_nonzero(self.kept):,} splats. Select side B, then cut or join.")
        self.kept_changed.emit()

    def cut_between(self) -> None:
        """Cut all edges between side A and the selection."""
        scene, kept = self._session.shown_scene, self.kept
        if kept is None:
            return
        pairs = edges_between(scene.ellipses, scene.prepared.graph, kept, scene.selection & ~kept)
        if not pairs:
            self._say("No edge joins side A and the selection.")
            return
        self._cut(pairs, "Cut between selections")
        self._say(f"Cut {_counted(len(pairs), 'edge')}.")

    def join(self) -> None:
        """Join side A and the selection by their best contacts."""
        scene, kept = self._session.shown_scene, self.kept
        if kept is None:
            return
        pairs = best_links(scene.ellipses, self._options.epsilon, kept, scene.selection)
        new = [pair for pair in pairs if not has_edge(scene.ellipses, scene.prepared.graph, pair)]
        if not new:
            self._say("Their best contacts are joined already." if pairs else "Side A or B has no splat to join.")
            return
        self._change(with_added(self._options, new), "Join selections")
        self._say(f"Joined by {_counted(len(new), 'edge')}.")

    def join_fragments(self) -> None:
        """Tie every fragment to what is around it."""
        scene = self._session.shown_scene
        pairs, n_left = fragment_links(scene.ellipses, scene.prepared.graph, self._options.epsilon)
        n = len(fragments(scene.prepared.graph)) - n_left
        left = f" {_counted(n_left, 'fragment')} too far away to join." if n_left else ""
        if pairs:
            self._change(with_added(self._options, pairs), "Join fragments")
        self._say(f"Joined {_counted(n, 'fragment')} by {_counted(len(pairs), 'edge')}.{left}")

    def clear_mends(self) -> None:
        """Take all cuts and additions back."""
        self._change(replace(self._options, cut=(), add=(), separate=(), join=()), "Clear mends")

    @property
    def _options(self) -> GraphOptions:
        return self._session.shown_scene.edit.graph

    def _is_joined(self, edge: tuple[int, int]) -> bool:
        scene = self._session.scene
        return scene is not None and scene.surface is not None and has_edge(scene.ellipses, scene.surface.graph, edge)

    def _cut(self, pairs: Iterable[tuple[int, int]], label: str) -> None:
        self._change(with_cut(self._options, pairs), label)

    def _change(self, options: GraphOptions, label: str) -> None:
        self._session.steps.change_edit(self._session.shown_scene.edit.with_options(options), label)

    def _forget(self) -> None:
        self.kept = None
        self.kept_changed.emit()


def _counted(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}"
