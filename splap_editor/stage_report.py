"""Progress lines of the command line: one per stage, with its share and seconds."""

import sys
from time import perf_counter
from types import TracebackType

from splap_editor.core.progress import Progress


def printable(text: str) -> str:
    """Text for a terminal: what it would obey rather than show stands by its number, as the escape in a file's name."""
    return "".join(sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text)


class StageReport:
    """Prints ``stage  42 %`` on a terminal while a stage runs, and ``stage  1.3 s`` when it ends.

    Lines go to standard error, so that standard output stays clean. Off a terminal only the ends are printed.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self.timings_s: dict[str, float] = {}
        self._quiet = quiet
        self._live = not quiet and sys.stderr.isatty()
        self._stage: str | None = None
        self._start = self._drawn = 0.0

    def __call__(self, stage: str) -> "StageReport":
        """Begin a stage that ends with the ``with`` block."""
        self.stage(stage)
        return self

    def __enter__(self) -> "StageReport":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.end_stage()
        elif self._live:
            print(file=sys.stderr)

    def stage(self, stage: str) -> Progress:
        """Begin a stage, ending the one before; gives its progress callback."""
        if stage != self._stage:
            self.end_stage()
            self._stage = stage
            self._start = perf_counter()
        return self.progress

    def progress(self, share: float) -> None:
        """Draw the share of the running stage, ten times a second at most."""
        now = perf_counter()
        if self._live and now - self._drawn > 0.1:
            self._drawn = now
            seconds = now - self._start
            print(f"\r{self._stage:<12} {share:4.0%} {seconds:7.1f} s", end="", file=sys.stderr, flush=True)

    def end_stage(self) -> None:
        """Print the seconds of the running stage, if there is one."""
        if self._stage is None:
            return
        seconds = perf_counter() - self._start
        self.timings_s[self._stage] = self.timings_s.get(self._stage, 0.0) + seconds
        if not self._quiet:
            print(f"{chr(13) if self._live else ''}{self._stage:<12} 100% {seconds:7.1f} s", file=sys.stderr)
        self._stage = None

    def say(self, text: str) -> None:
        """Print a line unless quiet."""
        if not self._quiet:
            print(printable(text), file=sys.stderr)


class ShareLine:
    """One line for work that goes on beside something else: its share on a terminal, elsewhere only that it goes on."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._is_live = sys.stderr.isatty()
        self._said: int | None = None

    def __call__(self, share: float) -> None:
        """Say how far the work is; the line ends with it."""
        percent = int(100.0 * share)
        if percent == self._said or (self._said is not None and not self._is_live):
            return
        self._said = percent
        if self._is_live:
            print(f"\r{self._text} {percent:3d} %", end="\n" if share >= 1.0 else "", file=sys.stderr, flush=True)
        else:
            print(self._text, file=sys.stderr, flush=True)
