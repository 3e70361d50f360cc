"""A process that tries one input after another, each made from its number: ``python -m tests.campaign.worker SEED``."""

import contextlib
import os
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.campaign.checks import CHECKS, OTHER_FORMATS
from tests.campaign.mutations import mutated, mutations_of
from tests.campaign.seeds import KINDS

MEMORY_BYTES = 4 << 30
SUFFIXES = {"ply": "ply", "recipe": "json", "session": "splap", "npz": "npz", "cache": "npz"}
SUFFIXES |= {kind: kind for kind in OTHER_FORMATS}
# Splat files have most to go wrong.
SHARES = ("ply", "ply", "ply", "ply", "recipe", "session", "npz", "cache", *OTHER_FORMATS)


def kind_of(number: int) -> str:
    """What is tried under a number."""
    return SHARES[number % len(SHARES)]


def input_of(seed: int, number: int, left_out: tuple[int, ...] = ()) -> tuple[bytes, list[str]]:
    """The input of a number and the mutations that made it; some may be left out, to find those that matter."""
    rng = np.random.default_rng([seed, number])
    kind = kind_of(number)
    chosen = mutations_of(kind, rng)
    kept = [mutation for i, mutation in enumerate(chosen) if i not in left_out]
    data = KINDS[kind](int(rng.integers(2**31)))
    return mutated(data, kept), [mutation.__name__ for mutation, _ in kept]


def written_input(folder: Path, seed: int, number: int, left_out: tuple[int, ...] = ()) -> Path:
    """Write the input of a number to a file."""
    data, _ = input_of(seed, number, left_out)
    path = folder / f"scene.{SUFFIXES[kind_of(number)]}"
    path.write_bytes(data)
    return path


def tried(folder: Path, seed: int, number: int, left_out: tuple[int, ...] = ()) -> str:
    """``"accepted"``, ``"refused"``, or a traceback."""
    path = written_input(folder, seed, number, left_out)
    try:
        with warnings.catch_warnings():
            # A warning would stand on standard error.
            warnings.filterwarnings("error", module="splap_editor")
            return "accepted" if CHECKS[kind_of(number)](path, number) else "refused"
    except Exception:
        return traceback.format_exc()


def answer_lines(try_one: Callable[..., str], folder: Path, seed: int) -> None:
    """Answer each line ``number,left out…`` with a line, under the memory limit."""
    with contextlib.suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    os.environ.setdefault("SPLAP_CACHE_DIR", tempfile.gettempdir())
    print("ready", flush=True)
    for line in sys.stdin:
        number, *left_out = map(int, line.split(","))
        print(repr(try_one(folder, seed, number, tuple(left_out))), flush=True)


def main() -> None:
    """Try inputs."""
    with tempfile.TemporaryDirectory() as folder:
        answer_lines(tried, Path(folder), int(sys.argv[1]))


if __name__ == "__main__":
    main()
