"""What a process says when it crashes, kept for the next start."""

import contextlib
import faulthandler
import os
import platform
import secrets
from datetime import datetime
from pathlib import Path

import splap_editor
from splap_editor.io.file_lock import FileLock
from splap_editor.session.recovery import state_folder

_RUNNING = ".running"
MOST_REPORTS = 10


def crash_folder() -> Path:
    """Where crash reports are kept."""
    return state_folder() / "crashes"


class CrashReport:
    """The report of this process: written to only if it crashes, gone when it ends otherwise.

    Segmentation faults, aborts and the like, which leave no traceback, write
    the Python stack of every thread into it.

    Parameters
    ----------
    folder : Path, optional
        `crash_folder` by default. One that cannot be written to means that there is no report.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._file = self._lock = None
        folder = folder or crash_folder()
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / f"{os.getpid()}-{secrets.token_hex(4)}{_RUNNING}"
            self._lock = FileLock(path)
            self._file = open(path, "wb", buffering=0)  # noqa: SIM115 - open until the process ends
            self._file.write(_heading())
            faulthandler.enable(self._file)

    def close(self) -> None:
        """End cleanly."""
        if self._file is not None:
            faulthandler.disable()
            self._file.close()
        if self._lock is not None:
            with contextlib.suppress(OSError):
                self._lock.remove()
        self._file = self._lock = None


def new_crash_reports(folder: Path | None = None) -> list[Path]:
    """Find the reports of processes that crashed since the last call, the newest first; older ones go in time.

    Processes that were killed leave no report.
    """
    folder = folder or crash_folder()
    found = []
    for path in folder.glob(f"*{_RUNNING}"):
        with contextlib.suppress(OSError):
            lock = FileLock(path)
            held = path.read_bytes()
            if b"Fatal Python error" not in held and b"Windows fatal exception" not in held:
                lock.remove()
                continue
            when = datetime.fromtimestamp(path.stat().st_mtime)
            report = path.with_name(f"crash-{when:%Y-%m-%d-%H%M%S}-{path.stem}.txt")
            path.rename(report)
            lock.release()
            found.append(report)
    for old in sorted(folder.glob("crash-*.txt"))[:-MOST_REPORTS]:
        with contextlib.suppress(OSError):
            old.unlink()
    return sorted(found, reverse=True)


def _heading() -> bytes:
    words = f"SpLap Editor {splap_editor.__version__}, Python {platform.python_version()}, {platform.platform()}"
    return f"{words}, {datetime.now():%Y-%m-%d %H:%M}\n\n".encode()
