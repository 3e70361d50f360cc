"""A process that tries one input after another, each made from its number:
``python -m tests.campaign.worker SEED FOLDER``.
"""

import contextlib
import faulthandler
import os
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

from tests.campaign.checks import carry_out
from tests.campaign.forks import read_stages_in_forks
from tests.campaign.kinds import KINDS, written_input

MEMORY_BYTES = 4 << 30
CRASH_NAME = "crash.txt"
"""The file in a worker's folder that says where it crashed."""

MOST_MORE_BYTES = 320 << 20
"""Of memory that the highest mark rises by at an input, all of which are small."""


def tried(folder: Path, seed: int, kind: str, number: int, left_out: tuple[int, ...] = ()) -> str:
    """``"accepted"``, ``"refused"``, or a traceback."""
    path = written_input(folder, seed, kind, number, left_out)
    before = _most_memory()
    try:
        with warnings.catch_warnings():
            # A warning would stand on standard error.
            warnings.filterwarnings("error", module="splap_editor")
            found = "accepted" if KINDS[kind].is_accepted(path, number) else "refused"
    except Exception:
        return traceback.format_exc()
    more = _most_memory() - before
    return found if more <= MOST_MORE_BYTES else f"took {more >> 20} MiB for {path.stat().st_size:,} bytes"


def _most_memory() -> int:
    try:
        import resource
    except ImportError:
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def answer_lines(try_one: Callable[..., str], folder: Path, seed: int) -> None:
    """Answer each line ``kind,number,left out…`` with a line, under the memory limit."""
    with contextlib.suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    os.environ.setdefault("SPLAP_CACHE_DIR", tempfile.gettempdir())
    faulthandler.enable((folder / CRASH_NAME).open("w"))
    print("ready", flush=True)
    for line in sys.stdin:
        kind, number, *left_out = line.strip().split(",")
        print(repr(try_one(folder, seed, kind, int(number), tuple(map(int, left_out)))), flush=True)


def warm_up(folder: Path) -> None:
    """Load what is compiled: later a wait is the input's own."""
    for number in range(6):
        recipe = folder / "warm.json"
        recipe.write_bytes(KINDS["recipe"].made(number))
        carry_out(recipe, number)


def main() -> None:
    """Try inputs."""
    read_stages_in_forks()
    folder = Path(sys.argv[2])
    warm_up(folder)
    answer_lines(tried, folder, int(sys.argv[1]))


if __name__ == "__main__":
    main()
