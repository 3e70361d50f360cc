"""How a long function tells how far it is, and how it is cancelled."""

from collections.abc import Callable

Progress = Callable[[float], None]
"""Called with the share done, 0 to 1, at most about ten times a second; raises `Cancelled` to stop the caller."""


class Cancelled(Exception):  # noqa: N818 - not an error: the user asked for it
    """Raised by a progress callback when the user has cancelled the work."""


def no_progress(share: float) -> None:
    """Ignore the report and never cancel."""


def part_of(progress: Progress, start: float, end: float) -> Progress:
    """Map a sub-step's own share 0..1 to the slice ``start``..``end`` of its caller's progress."""
    return lambda share: progress(start + (end - start) * share)
