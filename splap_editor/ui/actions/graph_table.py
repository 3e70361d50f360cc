"""The Graph menu."""

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.conditions import (
    has_edge,
    has_fragments,
    has_mends,
    has_scene,
    has_surface,
)
from splap_editor.ui.actions.graph_actions import GraphActions

A = ActionSpec

GRAPH_TABLE: tuple[ActionSpec, ...] = (
    A("graph.off", GraphActions.off, "No &edges", tip="Draw no edges.", menu="G&raph", group="edges", checkable=True),
    A(
        "graph.near",
        GraphActions.near,
        "Edges &near",
        tip="Draw the edges around the selection and the inspected splat.",
        menu="G&raph",
        group="edges",
        checkable=True,
    ),
    A(
        "graph.all",
        GraphActions.all,
        "&All edges",
        tip="Draw every edge.",
        menu="G&raph",
        group="edges",
        checkable=True,
    ),
    A(
        "graph.cycle",
        GraphActions.cycle,
        "Next edge &view",
        ("J",),
        tip="None, near, all.",
        needs=has_surface,
        menu="G&raph",
    ),
    A(
        "graph.preset_paper",
        GraphActions.take_preset,
        "As in the &paper",
        tip="Graph, Laplacian, solver and splat shapes as published, to compare with; undo takes it back.",
        needs=has_scene,
        menu="G&raph",
        breaks=True,
    ),
    A(
        "graph.cut_edge",
        GraphActions.cut_edge,
        "&Cut edge",
        tip="Cut the inspected edge; X does so with the Inspect tool.",
        needs=has_edge,
        menu="G&raph",
        breaks=True,
    ),
    A(
        "graph.join_fragments",
        GraphActions.join_fragments,
        "Join f&ragments",
        tip="Tie every small piece that looks like the surface near it.",
        needs=has_fragments,
        menu="G&raph",
        breaks=True,
    ),
    A(
        "graph.clear_mends",
        GraphActions.clear_mends,
        "Clear &mends",
        tip="Take every cut and every added edge back.",
        needs=has_mends,
        menu="G&raph",
    ),
)
