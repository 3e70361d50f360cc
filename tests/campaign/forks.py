"""What may crash, in a process of its own that starts at once: a fork of this one, which has loaded the library."""

import os
import pickle
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from splap_editor.io.formats import usd, usd_arrays
from splap_editor.io.formats.source import Source
from splap_editor.io.formats.table import SplatFormat

Result = TypeVar("Result")


def is_forked(row: SplatFormat) -> bool:
    """Whether a format's library runs in processes of its own only."""
    return row.reads.startswith("usd:")


def forked(made: Callable[[], Result]) -> Result:
    """What a function gives in a fork of this process."""
    with tempfile.TemporaryDirectory() as folder:
        held = Path(folder, "result")

        def kept() -> int:
            held.write_bytes(pickle.dumps(made()))
            return 0

        code = _code(kept)
        assert code == 0, f"a fork ended with {code}"
        return pickle.loads(held.read_bytes())


def read_stages_in_forks() -> None:
    """Have stages opened by forks, a hundred times faster than by new interpreters and just as far from this one."""
    import pxr.Usd
    import pxr.UsdGeom
    import pxr.UsdVol  # noqa: F401

    usd.unpacked = _unpacked


def _unpacked(source: Source, held: Path, progress: object) -> tuple[str, str] | None:
    told = held.with_suffix(".told")
    code = _code(lambda: usd_arrays.main(str(source.path.resolve()), str(held)), told)
    what, mark, advice = told.read_text(errors="replace").strip().partition("|")
    return (what, advice) if mark and code == 2 else None


def _code(made: Callable[[], int], told: Path | None = None) -> int:
    """What a fork ends with, its standard output in a file; negative for a signal."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            for stream in (1, 2):
                name = os.devnull if told is None or stream == 2 else told
                os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT, 0o600), stream)
            code = made()
            sys.stdout.flush()
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
