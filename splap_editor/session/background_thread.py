"""Threads of the program, none of which may run on while Python takes itself down."""

import atexit
import os
import sys
import threading
from collections.abc import Callable, Iterable
from time import monotonic

LEAVE_SECONDS = 2.0
"""How long leaving waits for what does not hear of it, such as a file that blocks; it ends with the process."""

EXIT_SECONDS = 60.0
"""How long a program that cannot be ended at once waits, such as a script or a test's."""


class BackgroundThread(threading.Thread):
    """A thread that is asked to stop, and waited for, before the interpreter ends.

    It is a daemon, so that one that is blocked keeps no process alive. But a
    daemon that asks for Python's lock once the interpreter is being taken
    down is unwound through whatever C++ is on its stack, a signal of Qt's for
    one, and that aborts the process: `leave` and the end of any program wait.

    Parameters
    ----------
    work : callable
        What it does.
    name : str
    stop : callable
        Asks ``work`` to come to its end; called from any thread, perhaps more than once.
    """

    def __init__(self, work: Callable[[], None], *, name: str, stop: Callable[[], None]) -> None:
        super().__init__(target=work, name=name, daemon=True)
        self.stop = stop


def joined(threads: Iterable[threading.Thread], seconds: float) -> bool:
    """Wait for threads, so long for all of them together; whether they have ended."""
    end = monotonic() + seconds
    some = list(threads)
    for thread in some:
        thread.join(max(end - monotonic(), 0.0))
    return not any(thread.is_alive() for thread in some)


def stopped(seconds: float) -> bool:
    """Ask every background thread to stop and wait so long for all of them; whether they have ended."""
    running = [thread for thread in threading.enumerate() if isinstance(thread, BackgroundThread)]
    for thread in running:
        thread.stop()
    return joined(running, seconds)


def leave(code: int) -> int:
    """Give back the exit code once no background thread runs; where one does not end in time, the process ends here."""
    if not stopped(LEAVE_SECONDS):
        for stream in (sys.stdout, sys.stderr):
            # A program without a terminal has none.
            if stream is not None:
                stream.flush()
        os._exit(code)
    return code


# Whoever made the threads, and however the program comes to its end. One that is blocked for longer than this asks for
# no lock either.
atexit.register(stopped, EXIT_SECONDS)
