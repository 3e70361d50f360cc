"""No thread of the program runs on while Python takes itself down."""

import subprocess
import sys

HEARS = """
import threading, sys
from splap_editor.session.background_thread import BackgroundThread
told = threading.Event()
def work():
    told.wait()
    print("heard of the end", flush=True)
BackgroundThread(work, name="any", stop=told.set).start()
sys.exit(3)
"""

HEARS_NOTHING = """
import threading
from splap_editor.session import background_thread
from splap_editor.session.background_thread import BackgroundThread, leave
background_thread.LEAVE_SECONDS = 0.05
blocked = threading.Lock()
blocked.acquire()
BackgroundThread(blocked.acquire, name="any", stop=lambda: None).start()
print("not flushed yet", end="")
leave(5)
print("never reached")
"""


def ended(program):
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)


def test_a_program_that_ends_asks_its_threads_to_stop_and_waits_for_them():
    done = ended(HEARS)
    assert (done.returncode, done.stdout, done.stderr) == (3, "heard of the end\n", "")


def test_leaving_does_not_wait_for_a_thread_that_is_blocked():
    done = ended(HEARS_NOTHING)
    assert (done.returncode, done.stdout, done.stderr) == (5, "not flushed yet", "")
