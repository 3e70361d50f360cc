"""Compiled loops with a plain twin, which stands in on the very first start while they are being compiled."""

from collections.abc import Callable
from typing import Any


class TwofoldLoop:
    """A loop that is called compiled, or, until `use_compiled`, as array operations that need no compiler.

    Both give the same result; the twin takes some ten times as long and more
    memory. A loop that is compiled nowhere but in the process that calls it
    would hold up that process for seconds.

    Parameters
    ----------
    compiled : callable
        A numba dispatcher.
    plain : callable
        The same arguments, the same result.
    """

    uses_compiled = True

    def __init__(self, compiled: Callable[..., Any], plain: Callable[..., Any]) -> None:
        self.compiled = compiled
        self.plain = plain

    def __call__(self, *arguments: Any) -> Any:
        """Run the loop."""
        return self.compiled(*arguments) if TwofoldLoop.uses_compiled else self.plain(*arguments)

    @staticmethod
    def use_compiled(on: bool) -> None:
        """Say whether the loops of this process are compiled; they are unless somebody says otherwise."""
        TwofoldLoop.uses_compiled = on
