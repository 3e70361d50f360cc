"""An event loop without a window."""

import queue
import threading
import time


class MainThread:
    """Runs what workers post, on the thread that calls `run_until`."""

    def __init__(self):
        self.calls = queue.Queue()

    def post(self, call):
        self.calls.put(call)

    def run_until(self, condition, seconds=120.0):
        end = time.monotonic() + seconds
        while not condition():
            try:
                call = self.calls.get(timeout=max(end - time.monotonic(), 0.001))
            except queue.Empty:
                raise AssertionError("it did not happen in time") from None
            call()

    def run_to_the_end_of(self, name, seconds=120.0):
        """Wait for the threads of a name to end, and run all that was posted till then."""
        for thread in threading.enumerate():
            if thread.name == name:
                thread.join(seconds)
                assert not thread.is_alive()
        while not self.calls.empty():
            self.calls.get()()
