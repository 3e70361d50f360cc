"""Rows of the paper's comparison, kept one a line as they are made, so that a run goes on where it was interrupted."""

import json
import os
import subprocess
from functools import cache
from pathlib import Path

KEY = ("category", "seed", "regime", "spacings", "handles", "n_pulls", "candidate", "solver")
"""What names a row: the rest of it follows from these and from the commit."""


@cache
def commit() -> str:
    """Return the commit that is run, with a plus where engine or benchmark differ; empty outside a repository."""
    folder = Path(__file__).resolve().parents[2]

    def said(*words: str) -> str:
        done = subprocess.run(["git", "-C", str(folder), *words], capture_output=True, text=True, check=False)
        return done.stdout.strip()

    changed = said("status", "--porcelain", "--", "splap_editor", "tests/benchmark")
    return said("rev-parse", "--short=7", "HEAD") + ("+" if changed else "")


class RowFile:
    """Rows as JSON objects, one a line; several processes may add to one file.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @staticmethod
    def key(row: dict[str, object]) -> tuple[object, ...]:
        """What names a row."""
        return tuple(row[name] for name in KEY)

    def add(self, row: dict[str, object]) -> None:
        """Append a row, in one write."""
        handle = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            os.write(handle, (json.dumps(row) + "\n").encode())
        finally:
            os.close(handle)

    def rows(self) -> list[dict[str, object]]:
        """All rows, those of one name once: the last. A line that an interrupted write cut short is left out."""
        found: dict[tuple[object, ...], dict[str, object]] = {}
        if self.path.exists():
            for line in self.path.read_text(encoding="utf-8").splitlines():
                try:
                    row = json.loads(line)
                except json.JSONDecodeError:
                    continue
                found[self.key(row)] = row
        return list(found.values())

    def known(self) -> set[tuple[object, ...]]:
        """Names of the rows there are."""
        return {self.key(row) for row in self.rows()}
