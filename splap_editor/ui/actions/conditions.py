"""When an action can be used: predicates over what the window holds."""

from dataclasses import dataclass

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.surface.fragments import fragments
from splap_editor.session.cards import has_edge as is_joined
from splap_editor.session.scene import Scene
from splap_editor.session.session import Session
from splap_editor.ui.actions.graph_actions import GraphActions


@dataclass(frozen=True, eq=False)
class State:
    """What the predicates look at.

    Parameters
    ----------
    session : Session
    graph : GraphActions
        Holds what is inspected.
    """

    session: Session
    graph: GraphActions

    @property
    def scene(self) -> Scene | None:
        """The scene shown."""
        return self.session.scene

    @property
    def splat_graph(self) -> SplatGraph | None:
        """Its graph, once it is prepared."""
        surface = self.scene.surface if self.scene is not None else None
        return surface.graph if surface is not None else None


def always(state: State) -> bool:
    """Whatever is open."""
    return True


def has_scene(state: State) -> bool:
    """A file is open."""
    return state.scene is not None


def has_surface(state: State) -> bool:
    """A file is open and prepared."""
    return state.scene is not None and state.scene.surface is not None


def has_selection(state: State) -> bool:
    """Splats are selected."""
    return state.scene is not None and bool(state.scene.selection.any())


def has_rest(state: State) -> bool:
    """Splats are selected, and others are not."""
    return state.scene is not None and has_selection(state) and not state.scene.selection.all()


def has_selection_on_surface(state: State) -> bool:
    """Splats are selected, and their neighbours known."""
    return has_surface(state) and has_selection(state)


def has_hidden(state: State) -> bool:
    """Splats are hidden."""
    return state.scene is not None and bool(state.scene.hidden.any())


def has_removed(state: State) -> bool:
    """Splats are removed."""
    return state.scene is not None and state.scene.edit.removed is not None


def has_removed_selected(state: State) -> bool:
    """Splats that are removed are selected."""
    return state.scene is not None and has_removed(state) and bool((state.scene.selection & state.scene.removed).any())


def can_delete(state: State) -> bool:
    """Handles or pins are chosen, or splats selected."""
    return has_chosen(state) or has_selection(state)


def has_weights(state: State) -> bool:
    """Handles have weights to be shown."""
    return state.scene is not None and has_handles(state) and state.scene.edit.deformer.has_weights


def has_handles(state: State) -> bool:
    """There are handles."""
    return state.scene is not None and bool(state.scene.edit.handles)


def has_active_handles(state: State) -> bool:
    """Handles are chosen."""
    return state.scene is not None and bool(state.scene.active_handles)


def has_chosen(state: State) -> bool:
    """Handles or pins are chosen."""
    return has_active_handles(state) or (state.scene is not None and bool(state.scene.active_pins))


def has_pins(state: State) -> bool:
    """Something is pinned."""
    return state.scene is not None and bool(state.scene.edit.pins)


def is_placed(state: State) -> bool:
    """The whole object is moved, turned or scaled."""
    return state.scene is not None and not state.scene.edit.place.is_identity


def has_keys(state: State) -> bool:
    """There are keys, of handles or the camera."""
    return state.scene is not None and not state.scene.edit.timeline.is_empty


def is_on_key(state: State) -> bool:
    """The frame shown has a key."""
    return state.scene is not None and state.scene.edit.timeline.frame in state.scene.edit.timeline.key_frames


def has_camera_keys(state: State) -> bool:
    """There are camera keys."""
    return state.scene is not None and bool(state.scene.edit.timeline.camera_keys)


def is_on_camera_key(state: State) -> bool:
    """The frame shown has a camera key."""
    return state.scene is not None and state.scene.edit.timeline.frame in state.scene.edit.timeline.camera_key_frames


def can_undo(state: State) -> bool:
    """A step can be taken back."""
    return state.session.history.can_undo


def can_redo(state: State) -> bool:
    """A step was taken back."""
    return state.session.history.can_redo


def is_busy(state: State) -> bool:
    """Something is being worked on in the background."""
    return state.session.is_busy("open", "edit", "prepare", "bind", "pose", "export", "export at rest", "frames")


def is_halted(state: State) -> bool:
    """The background work was stopped, or failed."""
    return state.session.state in ("halted", "failed")


def has_edge(state: State) -> bool:
    """The inspected edge joins its splats."""
    scene, graph, edge = state.scene, state.splat_graph, state.graph.inspected.edge
    return scene is not None and graph is not None and edge is not None and is_joined(scene.ellipses, graph, edge)


def has_fragments(state: State) -> bool:
    """The scene does not hang together."""
    graph = state.splat_graph
    return graph is not None and len(fragments(graph)) > 0


def has_mends(state: State) -> bool:
    """Edges were cut or added by hand or by strokes."""
    if state.scene is None or not has_surface(state):
        return False
    graph = state.scene.edit.graph
    return bool(graph.cut or graph.add or graph.separate or graph.join)
