"""What a session knows of the view that draws its scene: that there are things to prepare for it on the worker."""

from collections.abc import Callable
from typing import Protocol

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.splats.splats import Splats

HandOver = Callable[[], None]
"""Gives a view what was prepared for it; called on the main thread, just before the scene tells of the change."""


class Depictor(Protocol):
    """Prepares on the worker what a view draws, and hands it over on the main thread; it stays with the view."""

    def depict(self, splats: Splats) -> HandOver:
        """Prepare what drawing a scene at rest needs, such as shapes; on the worker."""
        ...

    def presenter(self) -> Callable[[AdaptedKernels], HandOver]:
        """Say, on the main thread, how to prepare on the worker what drawing a pose needs, such as an order."""
        ...


class Unseen:
    """No view: nothing is prepared."""

    def depict(self, splats: Splats) -> HandOver:
        """Prepare nothing."""
        return _nothing

    def presenter(self) -> Callable[[AdaptedKernels], HandOver]:
        """Prepare nothing."""
        return lambda kernels: _nothing


def _nothing() -> None:
    pass
