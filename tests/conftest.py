"""What every test stands on: fixed seeds, a cache of its own, and nothing left running behind."""

import gc
import os
import random
import sys
import threading
import weakref
from collections.abc import Iterator
from pathlib import Path
from time import monotonic, sleep

# Small dense work is several times slower with BLAS threads; set before numpy is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_API", "pyside6")

import numpy as np
import pytest

from tests.kinds import KINDS, kind_of, rank

_THREAD_GRACE_S = 60.0
"""A loop that is compiled hears of nothing until that is done."""


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marks of the kinds of test."""
    for kind, need in KINDS.items():
        config.addinivalue_line("markers", f"{kind}: {need}")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave files alone that need more than the kind asked for: importing them may fail where that is missing."""
    kind, wanted = kind_of(collection_path), config.option.markexpr
    return True if wanted in KINDS and kind is not None and rank(kind) > rank(wanted) else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test by its kind, before ``-m`` chooses among them."""
    for item in items:
        kind = kind_of(item.path)
        if kind is None:
            raise pytest.UsageError(f"{item.path} has no kind: give it, or its folder, one in tests/kinds.py")
        item.add_marker(kind)


def pytest_collection_finish() -> None:
    """Take what modules hold out of every later collection of garbage."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def fixed_seeds() -> None:
    """Give code that draws from the global generators the same numbers in every run."""
    random.seed(0)
    np.random.seed(0)  # noqa: NPY002 - the legacy generator is what a library would use


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Point stage cache and recovery files at an empty folder, so that no test sees another's or the user's."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("SPLAP_CACHE_DIR", str(folder))
    monkeypatch.setenv("SPLAP_STATE_DIR", str(folder / "state"))
    return folder


@pytest.fixture(autouse=True)
def unchanged_numpy_errors() -> Iterator[None]:
    """Fail a test that leaves numpy's error handling changed."""
    before = np.geterr()
    yield
    after = np.geterr()
    np.seterr(**before)
    assert after == before, "the test, or what it called, left numpy's error state changed"


@pytest.fixture(autouse=True)
def no_leaked_threads(request: pytest.FixtureRequest) -> Iterator[None]:
    """Fail a test that leaves a Python thread running, or one that opens windows a thread of Qt."""
    before = set(threading.enumerate())
    yield
    leaked = [thread for thread in threading.enumerate() if thread not in before and not _ended(thread)]
    names = [f"{thread.name} ({type(thread).__name__})" for thread in leaked]
    # Looking through all objects takes long where hundreds of thousands are left of earlier tests.
    if request.node.get_closest_marker("window") is not None:
        names += [f"{thread!r} (QThread)" for thread in _running_qthreads()]
    assert not names, f"threads left running: {', '.join(names)}"


def _ended(thread: threading.Thread) -> bool:
    """Whether a thread ends within the grace that one already told to stop needs."""
    # A thread Python did not start stands in as a dummy for as long as the process lives.
    if type(thread).__name__ == "_DummyThread":
        return True
    thread.join(_THREAD_GRACE_S)
    return not thread.is_alive()


def _running_qthreads() -> list[object]:
    qt = sys.modules.get("PySide6.QtCore")
    if qt is None:
        return []
    main = qt.QThread.currentThread()
    threads = [thing for thing in gc.get_objects() if isinstance(thing, qt.QThread) and thing is not main]
    return [thread for thread in threads if thread.isRunning() and not thread.wait(int(1000 * _THREAD_GRACE_S))]


@pytest.fixture
def no_leaked_vtk() -> Iterator[None]:
    """Fail a test that keeps a VTK render window alive: for the tests that draw.

    As in the program, no worker collects garbage: what belongs to Qt must be freed on its own thread.
    """
    before = _render_windows()
    gc.disable()
    yield
    gc.enable()
    # A thread that was told to stop holds what it works on until it has ended.
    until = monotonic() + _THREAD_GRACE_S
    while leaked := _left_alive(before):
        assert monotonic() < until, f"VTK render windows left alive: {', '.join(leaked)}"
        sleep(0.05)
    # What outlives a test belongs to modules. Hundreds of thousands of those objects, gone through at every collection
    # and every search for what was left, would take a second of each test.
    gc.freeze()


def _left_alive(before: set[weakref.ref]) -> list[str]:
    """Collect garbage, and name the VTK render windows that are there and were not before."""
    gc.collect()
    return [type(window()).__name__ for window in _render_windows() if window not in before]


def _render_windows() -> set[weakref.ref]:
    rendering = sys.modules.get("vtkmodules.vtkRenderingCore")
    if rendering is None:
        return set()
    return {weakref.ref(thing) for thing in gc.get_objects() if isinstance(thing, rendering.vtkRenderWindow)}
