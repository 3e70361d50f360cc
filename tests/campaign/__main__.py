"""Search as long as there is time, and say what was tried and what broke."""

import argparse
import os
import sys
import threading
from collections import Counter
from time import monotonic

from tests.campaign.display import display
from tests.campaign.inputs import Found, try_inputs
from tests.campaign.kinds import KINDS
from tests.campaign.writes import try_writes

FAR = 1 << 40


def campaign(
    minutes: float, seed: int, n_workers: int, n_writes: int, shown_share: int, kinds: list[str]
) -> tuple[Counter, list[str]]:
    """Cut off writes, then try inputs on some processes side by side."""
    until = monotonic() + 60.0 * minutes
    counts: Counter = Counter()
    failures: list[str] = []
    if hasattr(os, "fork"):
        try_writes(seed, n_writes, counts, failures)
    found = [Found() for _ in range(n_workers)]
    numbers = [range(which, FAR, n_workers) for which in range(n_workers)]
    # Each thread waits for a process of its own.
    with display() as where:
        if where is None:
            print("no window is opened: Xvfb, which gives it a display, is not installed")
        options = {"kinds": kinds, "display": where, "shown_share": shown_share}
        threads = [
            threading.Thread(target=try_inputs, args=(seed, those, until, held), kwargs=options)
            for those, held in zip(numbers, found, strict=True)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    for held in found:
        counts += held.counts
        failures += held.failures
    return counts, failures


def main() -> int:
    """Run from the command line; 1 if anything broke."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaign", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--writes", type=int, default=900, help="writes to cut off, a third of them by each way")
    parser.add_argument("--shown", type=int, default=100, help="one in so many accepted splat files gets a window")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND", help=", ".join(KINDS))
    options = parser.parse_args()
    counts, failures = campaign(
        options.minutes, options.seed, options.workers, options.writes, options.shown, options.kinds
    )
    if failures:
        print(f"{len(failures)} failures:", *failures, sep="\n\n", end="\n\n")
    for name in (
        "inputs",
        "windows",
        "crashes",
        "tracebacks",
        "hangs",
        "kills",
        "failed writes",
        "power losses",
        "files broken",
    ):
        print(f"{counts.pop(name, 0):>9,} {name}")
    for name, count in sorted(counts.items()):
        print(f"{count:>9,} {name}")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
