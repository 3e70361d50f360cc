"""What a deformer is bound to, and with whose help."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.kept_arrays import Arrays
from splap_editor.core.progress import Progress, Runner, StageProgress, in_turn, no_progress

Made = TypeVar("Made")


class BindableSurface(Protocol):
    """What deformers are bound to: `splap_editor.engine.surface.Surface`, or anything with the same attributes."""

    rest: NDArray[np.float64]
    L: sp.csr_array
    M: NDArray[np.float64]
    graph: SplatGraph
    triangles: NDArray[np.integer]
    scene_scale: float

    def shared(self, make: Callable[["BindableSurface"], Made]) -> Made:
        """What all handle sets of the scene have in common, made by ``make(surface)`` when first asked for."""
        ...


class Keep(Protocol):
    """Keeps what took long, between runs of the program."""

    def __call__(
        self,
        name: object,
        make: Callable[[], Made],
        packed: Callable[[Made], Arrays],
        unpacked: Callable[[Arrays], Made],
    ) -> Made:
        """Give what ``make()`` made, now or for the same surface, handles and name before."""
        ...


def made_anew(
    name: object, make: Callable[[], Made], packed: Callable[[Made], Arrays], unpacked: Callable[[Arrays], Made]
) -> Made:
    """Keep nothing."""
    return make()


@dataclass(frozen=True)
class Binding:
    """How a deformer is bound: whom it tells, who runs its parts, who keeps what took long.

    Parameters
    ----------
    progress : Progress
    stages : callable, optional
        Told instead where there is more to say than a share, with words for it.
    run : Runner
        Runs independent parts.
    keep : Keep
    """

    progress: Progress = no_progress
    stages: StageProgress | None = None
    run: Runner = in_turn
    keep: Keep = made_anew
