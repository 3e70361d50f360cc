"""What every benchmark does the same way: one JSON object a line, medians of several runs, peak memory."""

import json
import os
import platform
import resource
import sys
import time
from collections.abc import Callable
from statistics import median
from typing import TypeVar

import numpy as np

Result = TypeVar("Result")


def report(**fields: object) -> None:
    """Print one JSON line; numpy scalars become numbers, floats keep four significant digits."""
    print(json.dumps({name: _plain(value) for name, value in fields.items()}), flush=True)


def note(text: str) -> None:
    """Say on standard error how far a run has come, clear of the JSON lines."""
    print(text, file=sys.stderr, flush=True)


def machine() -> dict[str, object]:
    """Return what a reader needs to compare figures across machines."""
    return {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "cpu": platform.processor() or platform.machine(),
        "n_cpus": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }


def timed(work: Callable[[], Result], *, repeats: int = 5, warm_up: int = 1) -> tuple[float, Result]:
    """Median wall-clock seconds of ``work`` over ``repeats`` runs after ``warm_up`` unmeasured ones, and its result."""
    for _ in range(warm_up):
        result = work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - start)
    return median(seconds), result


def peak_gib() -> float:
    """Largest resident memory this process has had so far, in GiB."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**30


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {str(name): _plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(part) for part in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(f"{value:.4g}")
    return value
