"""Every format at a million splats: ``python -m tests.benchmark.formats [--splats N] [--formats NAME …]``.

A line for each reading and writing: seconds, the library's own beside them where one is installed, calls of progress,
the longest time between two of them (and the share told before it), and the largest memory of the process. Each is
done in a process of its own. ``cpu`` is processor time of the thread, which other programs do not change.
"""

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from splap_editor.core.progress import Progress
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.table import FORMATS, format_named
from splap_editor.io.sample_maker import write_sample
from splap_editor.io.splat_files import read_splats, write_splats
from tests.benchmark.peers import machine, peak_gib, report

REPOSITORY = Path(__file__).resolve().parents[2]
OF_GAUSSFORGE = {"ply": "ply", "compressed-ply": "compressed.ply", "spz": "spz", "sog": "sog"}
OF_GAUSSFORGE |= {"splat": "splat", "ksplat": "ksplat"}


class Clock:
    """Progress that keeps the longest time without a word."""

    def __init__(self) -> None:
        self.n_calls, self.share, self.gap, self.gap_cpu, self.after = 0, 0.0, 0.0, 0.0, 0.0
        self._last = time.perf_counter(), time.thread_time()

    def __call__(self, share: float) -> None:
        """Note a call."""
        now = time.perf_counter(), time.thread_time()
        gap, gap_cpu = (b - a for a, b in zip(self._last, now, strict=True))
        if gap_cpu > self.gap_cpu:
            self.gap_cpu, self.after = gap_cpu, self.share
        self.gap = max(self.gap, gap)
        self.n_calls += 1
        self.share, self._last = share, now


def scene(n_splats: int) -> Splats:
    """Splats of degree 3 about a bent sheet, their numbers as wide as those of captures."""
    rng = np.random.default_rng(7)
    u, v = rng.uniform(-3, 3, (2, n_splats))
    means = np.column_stack([u, v, np.sin(u) * np.cos(v)]) + rng.normal(0, 0.01, (n_splats, 3))
    quats = rng.normal(size=(n_splats, 4))
    return Splats(
        means=means.astype(np.float32),
        log_scales=rng.normal(-5, 0.8, (n_splats, 3)).astype(np.float32),
        quats=(quats / np.linalg.norm(quats, axis=1)[:, None]).astype(np.float32),
        logit_opacities=rng.normal(1, 2, n_splats).astype(np.float32),
        sh0=rng.normal(0, 0.8, (n_splats, 3)).astype(np.float32),
        shN=rng.normal(0, 0.1, (n_splats, 15, 3)).astype(np.float32),
    )


def bench(name: str, scene_path: Path, folder: Path, n_repeats: int, peers: list[str]) -> None:
    """Write and read one format, in processes of their own."""
    row = FORMATS[name]
    held = folder / f"held{row.suffixes[0]}"
    if row.can_be_written:
        _report(name, "write", [str(scene_path), str(held)], n_repeats, peers)
    elif name == "sog-folder":
        held = _unpacked(folder / f"held{FORMATS['sog'].suffixes[0]}", folder / "folder")
    elif not _made_by_gaussforge(name, scene_path, held):
        report(benchmark="formats", format=name, does="read", skipped="gaussforge, which makes the file, is missing")
        return
    _report(name, "read", [str(held)], n_repeats, peers)


def _report(name: str, does: str, paths: list[str], n_repeats: int, of_peers: list[str]) -> None:
    found = [_alone(does, *paths) for _ in range(n_repeats)]
    found.sort(key=lambda each: each["cpu"])
    chosen = found[len(found) // 2]
    peers = {}
    for peer in of_peers:
        held = [_alone(does, *paths, "--peer", peer, "--format", name) for _ in range(n_repeats)]
        held = sorted((each for each in held if each), key=lambda each: each["cpu"])
        if held:
            peers[peer], peers[f"{peer}_cpu"] = held[len(held) // 2]["seconds"], held[len(held) // 2]["cpu"]
    report(benchmark="formats", format=name, does=does, **chosen, **peers)


def _alone(*words: str) -> dict:
    """What a process of its own measures."""
    command = [sys.executable, "-m", "tests.benchmark.formats", "--one", *words]
    done = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True)
    # Libraries write lines of their own before it.
    return json.loads(done.stdout.strip().splitlines()[-1])


def _unpacked(archive: Path, folder: Path) -> Path:
    with zipfile.ZipFile(archive) as held:
        held.extractall(folder)
    return folder / "meta.json"


def _made_by_gaussforge(name: str, source: Path, target: Path) -> bool:
    try:
        import gaussforge
    except ImportError:
        return False
    made = gaussforge.GaussForge().convert(source.read_bytes(), "ply", OF_GAUSSFORGE[name])
    target.write_bytes(made["data"])
    return True


def one(does: str, paths: list[Path], peer: str, name: str) -> dict:
    """Measure here: seconds, processor seconds, and what progress told."""
    work: Callable[[Progress], object] | None
    if peer:
        # Loops that a library compiles at its first call are not its own either.
        small = (
            [_small(paths[0])] if does == "read" else [_small_scene(paths[0].parent), paths[1].with_name("peer.tmp")]
        )
        warm = _peer(does, small, peer, name) if peer == "gsply" else None
        if warm is not None:
            warm(Clock())
        work = _peer(does, paths, peer, name)
    elif does == "read":
        read_splats(_small(paths[0]))  # imports and compiled loops are not its own
        work = lambda progress: read_splats(paths[0], progress=progress)  # noqa: E731
    else:
        file = read_splats(paths[0])
        moved = Splats(**{**vars_of(file.splats), "means": file.splats.means + np.float32(0.5)})
        work = lambda progress: write_splats(paths[1], file, moved, progress=progress)  # noqa: E731
    if work is None:
        return {}
    before, clock = _peak_gib_from_here(), Clock()
    start, start_cpu = time.perf_counter(), time.thread_time()
    work(clock)
    seconds, cpu = time.perf_counter() - start, time.thread_time() - start_cpu
    clock(1.0)
    told = {} if peer else {"n_calls": clock.n_calls - 1, "gap": clock.gap, "gap_cpu": clock.gap_cpu}
    told |= {} if peer else {"after": round(clock.after, 3), "peak_gib": _peak_gib(), "before_gib": before}
    return {"seconds": seconds, "cpu": cpu, **told}


def _peak_gib() -> float:
    """Largest resident memory of this process since `_peak_gib_from_here`."""
    status = Path("/proc/self/status")
    if not status.exists():
        return peak_gib()
    line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 2**20


def _peak_gib_from_here() -> float:
    """Begin to measure; what is held already. Where that cannot be, the largest so far counts too."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return _peak_gib()


def vars_of(splats: Splats) -> dict:
    """The fields of splats by name."""
    return {name: getattr(splats, name) for name in Splats.__dataclass_fields__}


def _small(path: Path) -> Path:
    """A file of the same format with few splats, or the file itself where it cannot be written."""
    row = format_named(path)
    if row is None or not row.can_be_written:
        return path
    small = path.with_name(f"small{row.suffixes[0]}")
    if not small.exists():
        file = read_splats(_small_scene(path.parent))
        write_splats(small, file, file.splats)
    return small


def _small_scene(folder: Path) -> Path:
    plain = folder / "small_scene.ply"
    if not plain.exists():
        write_sample(plain, scene(1000))
    return plain


def _peer(does: str, paths: list[Path], peer: str, name: str) -> Callable[[Progress], object] | None:
    """The same by a library, bytes in memory for those that take no file; None where it cannot."""
    if peer == "gaussforge" and name in OF_GAUSSFORGE:
        import gaussforge

        forge, kind = gaussforge.GaussForge(), OF_GAUSSFORGE[name]
        if does == "read":
            return lambda progress: forge.read(paths[0].read_bytes(), kind)
        held = forge.read(paths[0].read_bytes(), "ply")
        return lambda progress: forge.write(held["data"], kind)
    if peer == "gsply" and name in ("ply", "compressed-ply", "spz"):
        import gsply

        read = gsply.read_spz if name == "spz" else gsply.plyread
        if does == "read":
            return lambda progress: read(paths[0])
        data = gsply.plyread(paths[0])
        out = paths[1].with_name(f"peer{paths[1].suffix}")
        if name == "spz":
            return lambda progress: gsply.write_spz(out, data)
        return lambda progress: gsply.plywrite(out, data, compressed=name == "compressed-ply")
    return None


def bench_dialog(path: Path) -> None:
    """How long the export dialog keeps the GUI's thread while each format is chosen; needs a display."""
    from PySide6.QtWidgets import QApplication

    from splap_editor.app import Mailbox
    from splap_editor.core.splats.occupancy import occupancy_ellipses
    from splap_editor.session.jobs import Worker
    from splap_editor.session.scene import Scene
    from splap_editor.ui.dialogs.export_dialog import ExportDialog

    app = QApplication(sys.argv[:1])
    mailbox = Mailbox()
    worker = Worker(mailbox.post)
    file = read_splats(path)
    dialog = ExportDialog(None, path.with_name("out.ply"), Scene(file, occupancy_ellipses(file.splats)), {}, worker)
    dialog.show()
    sys.setswitchinterval(0.0005)  # as the program does
    for name, row in FORMATS.items():
        if not row.can_be_written or row.is_lossless:
            continue
        clock, start = Clock(), time.perf_counter()
        dialog.choice.chosen.emit(name)
        clock(0.0)
        while not dialog.choice.is_told:
            app.processEvents()
            clock(0.5)
        seconds = time.perf_counter() - start
        report(benchmark="export dialog", format=name, told_after=seconds, block=clock.gap, block_cpu=clock.gap_cpu)
    worker.close()


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--splats", type=int, default=1_000_000)
    parser.add_argument("--formats", nargs="+", choices=FORMATS, default=list(FORMATS))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--keep", type=Path, help="folder for the files, made if it is missing and left there")
    parser.add_argument("--peers", nargs="*", default=["gaussforge", "gsply"], help="libraries to time beside")
    parser.add_argument("--dialog", action="store_true", help="time the export dialog instead, on a display")
    parser.add_argument("--one", nargs="+", help=argparse.SUPPRESS)
    parser.add_argument("--peer", default="", help=argparse.SUPPRESS)
    parser.add_argument("--format", default="", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        does, *paths = options.one
        print(json.dumps(one(does, [Path(path) for path in paths], options.peer, options.format)))
        return
    report(**machine())
    with tempfile.TemporaryDirectory() as name:
        folder = options.keep or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"scene_{options.splats}.ply"
        if not path.exists():
            write_sample(path, scene(options.splats))
        if options.dialog:
            bench_dialog(path)
            return
        for each in options.formats:
            bench(each, path, folder, options.repeats, options.peers)


if __name__ == "__main__":
    main()
