"""The deformers that there are: a row here makes one known to recipes, their schema, forms and the command line."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.options import ARAP_SOLVERS, ArapOptions
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.options import OptionSet, loaded
from splap_editor.core.reach_options import ReachOptions


@dataclass(frozen=True)
class DeformerRow:
    """One deformer, and what must be known of it before it is imported.

    Parameters
    ----------
    method : str
        As a recipe spells it.
    title : str
        As a form spells it.
    options : type
        Its option group.
    bind : str
        ``"module:name"`` of ``bind(surface, handles, options, binding)``, which gives a `Deformer`.
    key : str
        Key of a recipe under which the options stand; empty where they stand among the recipe's own.
    kind : str
        Value of the option ``kind`` that chooses among rows of one method; empty where there is one row.
    has_free_radius : bool
        What lies farther from every handle than the free radius stays put.
    has_weights : bool
        It has a weight for each handle, which its cage bounds: it is a `core/bbw/bbw.py:WeightedDeformer`.
    named : tuple of str
        Modules that the one that binds imports by names out of a table: source of what it makes.
    ready : str
        ``"module:name"`` of ``ready(surface, keep)``, which makes what the first drag waits for; empty for nothing.
    tip : str
        What an artist would call it.
    """

    method: str
    title: str
    options: type
    bind: str
    key: str = ""
    kind: str = ""
    has_free_radius: bool = False
    has_weights: bool = False
    named: tuple[str, ...] = ()
    ready: str = ""
    tip: str = ""

    @property
    def bound_by(self) -> tuple[type, ...]:
        """Option groups after whose change it must be bound again."""
        return (self.options, ReachOptions) if self.has_free_radius else (self.options,)

    @property
    def posed_by(self) -> tuple[type, ...]:
        """Option groups after whose change what is bound must be posed again."""
        return (AdaptationOptions,)

    @property
    def modules(self) -> tuple[str, ...]:
        """Modules that make it, with all that they import."""
        return (self.bind.partition(":")[0], *self.named)

    def load(self) -> Callable[..., Any]:
        """Import the function that binds."""
        return loaded(self.bind)


DEFORMERS = [
    *(
        DeformerRow(
            "arap",
            "As-rigid-as-possible",
            ArapOptions,
            "splap_editor.core.arap.binding:bind_arap",
            key="solver",
            kind=kind,
            has_free_radius=True,
            named=(solver.module,),
            ready="splap_editor.core.arap.binding:ready_arap",
            tip="A soft move that keeps shape: what lies near a handle follows it and turns rather than stretches.",
        )
        for kind, solver in ARAP_SOLVERS.items()
    ),
    DeformerRow(
        "bbw",
        "Bounded biharmonic weights",
        BbwOptions,
        "splap_editor.core.bbw.binding:bind_bbw",
        has_weights=True,
        tip="Smooth skinning: each handle pulls what lies in its cage, as bones do, and joints bend between them.",
    ),
]
"""The first is the default."""


def method_titles() -> dict[str, str]:
    """Title of each method."""
    return {row.method: row.title for row in DEFORMERS}


def method_tips() -> dict[str, str]:
    """Tip of each method."""
    return {row.method: row.tip for row in DEFORMERS}


def deformer_row(method: str, options: OptionSet) -> DeformerRow:
    """Row of the deformer that a method and its options name.

    Raises
    ------
    ValueError
        There is no such method.
    """
    for row in DEFORMERS:
        if row.method == method and (not row.kind or options[row.options].kind == row.kind):
            return row
    raise ValueError(f"method must be one of {', '.join(method_titles())}, got {method!r}")
