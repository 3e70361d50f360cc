"""What each part of the suite needs: nothing, OpenGL off screen, or a window on a display.

Run as a program, before anything is installed, it prints the neediest kind that some arguments of pytest ask for.
"""

import sys
from itertools import pairwise
from pathlib import Path

TESTS = Path(__file__).resolve().parent

KINDS = {
    "pure": "needs neither OpenGL nor Qt",
    "offscreen": "draws with OpenGL, off screen and without Qt",
    "window": "opens windows on a display",
}
"""Kinds of test with what they need, from the least to the most."""

# Of a folder, except for files in it that have a row of their own.
_KIND_OF = {
    "core": "pure",
    "io": "pure",
    "engine": "pure",
    "session": "pure",
    "installation": "pure",
    "installation/test_readiness.py": "window",
    "installation/test_system_packages.py": "window",
    "campaign": "pure",
    "test_campaign.py": "pure",
    "test_paper_benchmark.py": "pure",
    "test_cleaning_cli.py": "pure",
    "test_cli.py": "pure",
    "test_frames_cli.py": "offscreen",
    "test_contributing.py": "pure",
    "test_house.py": "pure",
    "test_kinds.py": "pure",
    "test_readme.py": "pure",
    "test_warm_up.py": "offscreen",
    "test_packaging.py": "pure",
    "test_resources.py": "pure",
    "tools": "offscreen",
    "viewport": "offscreen",
    "ui": "window",
}

FIXTURES = {"qtbot": "window", "qapp": "window", "qtmodeltester": "window", "no_leaked_vtk": "offscreen"}
"""Fixtures with the kind of test that may ask for them."""

LIBRARIES = {
    "PySide6": "window",
    "pytestqt": "window",
    "splap_editor.ui": "window",
    "splap_editor.app": "window",
    "vtkmodules": "offscreen",
    "pyvista": "offscreen",
    "splap_editor.viewport": "offscreen",
    "splap_editor.tools": "offscreen",
}
"""Packages with the kind of test that may import them."""


def kind_of(path: Path) -> str | None:
    """Kind of a test file or of a folder of them; None of the folder of all, and of what is no part of the suite."""
    try:
        parts = path.resolve().relative_to(TESTS).parts
    except ValueError:
        return None
    rows = ("/".join(parts[:n]) for n in range(len(parts), 0, -1))
    return next((_KIND_OF[row] for row in rows if row in _KIND_OF), None)


def rank(kind: str) -> int:
    """How much a kind needs, in comparison."""
    return list(KINDS).index(kind)


def needed_kind(arguments: list[str]) -> str:
    """Return the neediest kind of test that pytest would run with these arguments."""
    for option, value in pairwise(arguments):
        if option == "-m" and value in KINDS:
            return value
    most = list(KINDS)[-1]
    paths = [Path(argument.partition("::")[0]) for argument in arguments if not argument.startswith("-")]
    kinds = [kind_of(path) or most for path in paths if path.exists()]
    kinds += [kind_of(file) or most for path in paths if path.is_dir() for file in path.rglob("test_*.py")]
    return max(kinds, key=rank, default=most)


if __name__ == "__main__":
    print(needed_kind(sys.argv[1:]))
