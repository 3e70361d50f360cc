"""Garbage is collected on the GUI thread only."""

import gc

from PySide6.QtCore import QObject, QTimer

INTERVAL_MS = 200


class MainThreadCollector(QObject):
    """Collects reference cycles from a timer instead of wherever Python happens to allocate.

    A cycle that holds a Qt or VTK object must not be freed on a worker
    thread: Qt stops timers and closes windows of the GUI thread only. What
    exists when the collector is made is exempt from then on, so that no
    collection has to walk through all of the imported modules.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        gc.collect()
        gc.freeze()
        gc.disable()
        self._timer = QTimer(self, interval=INTERVAL_MS)
        self._timer.timeout.connect(self._collect)
        self._timer.start()

    @staticmethod
    def _collect() -> None:
        """Collect the oldest generation whose count is over its threshold, as Python itself would."""
        for generation in (2, 1, 0):
            if gc.get_count()[generation] > gc.get_threshold()[generation]:
                gc.collect(generation)
                return
