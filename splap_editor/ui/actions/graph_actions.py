"""What the Graph menu does: edges in view, and mending them."""

from collections.abc import Callable, Iterable
from dataclasses import replace

from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.presets import PRESETS, with_preset
from splap_editor.session.cards import has_edge
from splap_editor.session.mends import fragment_links, with_added, with_cut
from splap_editor.session.session import Session
from splap_editor.viewport.graph_view import SHOWN, GraphView
from splap_editor.viewport.inspect_view import InspectView


class GraphActions:
    """Cuts and joins; each is one undoable step of the edit.

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
        self._session = session
        self._graph_view = graph_view
        self.inspected = inspected
        self._say = say

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

    def join_fragments(self) -> None:
        """Tie every fragment that looks like a piece of the surface to what is around it."""
        scene = self._session.shown_scene
        links = fragment_links(scene.splats, scene.ellipses, scene.prepared.graph)
        if links.pairs:
            self._change(with_added(self._options, links.pairs), "Join fragments")
        said = [f"Joined {_counted(links.n_tied, 'fragment')} by {_counted(len(links.pairs), 'contact')}."]
        said.append("It is in one piece." if links.n_pieces == 1 else f"{links.n_pieces:,} pieces are left.")
        why = ((links.n_far, "too far from everything"), (links.n_unlike, "unlike what is near"))
        left = " and ".join(f"{n:,} {reason}" for n, reason in why if n)
        if left:
            said.append(f"Left on purpose: {left}. The Join tool ties what belongs there all the same.")
        self._say(" ".join(said))

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


def _counted(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}"
