"""Signals without Qt: a model tells whoever listens, and knows none of them."""

from collections.abc import Callable
from typing import Any


class Signal:
    """A list of callables called in the order they connected.

    Emitting runs them on the calling thread. A listener may disconnect itself or others while it is called.
    """

    def __init__(self) -> None:
        self._listeners: list[Callable[..., Any]] = []

    @property
    def listeners(self) -> tuple[Callable[..., Any], ...]:
        """Who is called, in this order."""
        return tuple(self._listeners)

    def connect(self, listener: Callable[..., Any]) -> Callable[..., Any]:
        """Add a listener and return it."""
        self._listeners.append(listener)
        return listener

    def disconnect(self, listener: Callable[..., Any]) -> None:
        """Remove a listener; one that is not connected is ignored."""
        if listener in self._listeners:
            self._listeners.remove(listener)

    def emit(self, *values: Any) -> None:
        """Call every listener with ``values``."""
        for listener in self.listeners:
            listener(*values)
