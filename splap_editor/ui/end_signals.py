"""SIGINT and SIGTERM, which end the window as if the machine were shutting down."""

import signal
import socket
from collections.abc import Callable

from PySide6.QtCore import QObject, QSocketNotifier

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


class EndSignals(QObject):
    """Calls back on the main thread, from the event loop, when the process is told to end.

    Python runs its handlers between two of its own instructions, and an idle
    event loop has none: the number of the signal comes through a socket that
    wakes the loop.

    Parameters
    ----------
    end : callable
        ``end(number)`` is called once.
    parent : QObject
    """

    def __init__(self, end: Callable[[int], None], parent: QObject) -> None:
        super().__init__(parent)
        self._end: Callable[[int], None] | None = end
        self._reader, self._writer = socket.socketpair()
        for end_of_pair in (self._reader, self._writer):
            end_of_pair.setblocking(False)
        self._notifier = QSocketNotifier(self._reader.fileno(), QSocketNotifier.Type.Read, self)
        self._notifier.activated.connect(self._on_activated)
        self._wakeup = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
        # Without a handler of Python's, nothing is written to the socket.
        self._handlers = {number: signal.signal(number, lambda *_: None) for number in numbers}

    def close(self) -> None:
        """Give the signals back."""
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(self._wakeup)
        self._notifier.setEnabled(False)
        self._reader.close()
        self._writer.close()

    def _on_activated(self) -> None:
        numbers = [number for number in self._reader.recv(64) if number in self._handlers]
        if numbers and self._end is not None:
            end, self._end = self._end, None
            end(numbers[0])
