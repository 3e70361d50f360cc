"""How soon a job that is cancelled ends, whatever it reads or writes and whenever it is told, as JSON lines.

::

    python -m tests.benchmark.cancel
    python -m tests.benchmark.cancel --kinds spz session --splats 200000 --moments 8 --gaps 5

Each file is opened as the window opens it, on a thread of its own; those of ``save_…`` are written as it exports them,
every splat moved, and the time runs until nothing of the file is left. ``worst_gap_s`` is the longest that the thread
ran without asking whether it shall stop: no moment of cancelling is worse. ``cancelled_s`` are latencies that were
seen, at moments drawn at random. Both are of the thread's own processor time, which other programs on the machine do
not lengthen; what waits for another process is judged by ``wall_s``.
"""

import argparse
import gc
import json
import struct
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from splap_editor.core.place import Place
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.edit import Edit
from splap_editor.io.formats.splat32 import RECORD
from splap_editor.io.ply import SplatFile, read_ply
from splap_editor.io.sample_maker import write_sample
from splap_editor.io.session_file import read_session_file
from splap_editor.resources import resource
from splap_editor.session.bound_edit import snapshot_of
from splap_editor.session.depictor import Unseen
from splap_editor.session.edit_file import read_edit
from splap_editor.session.jobs import Job, Starter
from splap_editor.session.scene import Scene
from splap_editor.session.work import (
    ExportOrder,
    ExportRequest,
    OpenRequest,
    exported_file,
    opened_scene,
    told_finder,
)
from tests.benchmark.peers import machine, note, report
from tests.campaign.seeds import ksplat_bytes, splat_records
from tests.reference.ply import ply_bytes, splat_columns

Work = Callable[[Job], Any]

TEXT_BYTES = 60 << 20
"""Of recipes and sessions: near the most that is read."""


def splats_of(n: int, degree: int, rng: np.random.Generator) -> Splats:
    """Splats all over a cube, as large as they are apart."""
    size = float(np.log(0.5 / np.cbrt(n)))
    return Splats(
        means=rng.random((n, 3), np.float32),
        log_scales=(size + rng.standard_normal((n, 3), np.float32) / 2),
        quats=rng.standard_normal((n, 4), np.float32),
        logit_opacities=rng.standard_normal(n, np.float32) + 2,
        sh0=rng.standard_normal((n, 3), np.float32),
        shN=rng.standard_normal((n, (degree + 1) ** 2 - 1, 3), np.float32) / 8,
    )


def opened(path: Path) -> Work:
    """Open a splat file."""
    return lambda job: opened_scene(job, OpenRequest(path, None, None, Unseen()))


class Inputs:
    """Large files, made when they are asked for.

    Parameters
    ----------
    folder : Path
    n_splats : int
    """

    def __init__(self, folder: Path, n_splats: int) -> None:
        self.folder, self.n_splats = folder, n_splats
        self.rng = np.random.default_rng(0)

    def _file(self, n: int, degree: int) -> SplatFile:
        """Splats in memory, as if read from a PLY."""
        splats = splats_of(n, degree, self.rng)
        held = read_ply(resource("samples", "tube.ply"))
        return replace(held, splats=splats, format_name="made")

    def _written(self, name: str, degree: int = 3, share: float = 1.0) -> Work:
        path = self.folder / name
        file = self._file(int(self.n_splats * share), degree)
        from splap_editor.io.formats.table import format_named

        row = format_named(path)
        assert row is not None
        with path.open("wb") as out:
            row.write(out, file.splats, lambda share: None)
        return opened(path)

    def _columns(self, name: str, form: str, *, share: float, **more: Any) -> Work:
        n = int(self.n_splats * share)
        columns = splat_columns(n, self.rng, n_rest=more.pop("n_rest", 0))
        columns.update(more)
        path = self.folder / name
        path.write_bytes(ply_bytes(columns, form))
        return opened(path)

    def ply(self) -> Work:
        """A binary PLY of 62 columns."""
        return self._columns("binary.ply", "binary_little_endian", share=1.0, n_rest=45)

    def big_endian_ply(self) -> Work:
        """The same in the other byte order."""
        return self._columns("big.ply", "binary_big_endian", share=1.0, n_rest=45)

    def ascii_ply(self) -> Work:
        """A PLY of text, a quarter of the splats."""
        n = self.n_splats // 4
        table = self.rng.standard_normal((n, 14)).astype(np.float32)
        names = ["x", "y", "z", *(f"f_dc_{i}" for i in range(3)), "opacity", *(f"scale_{i}" for i in range(3))]
        names += [f"rot_{i}" for i in range(4)]
        table[:, 7:10] -= 5
        head = ["ply", "format ascii 1.0", f"element vertex {n}", *(f"property float {name}" for name in names)]
        path = self.folder / "text.ply"
        with path.open("w") as out:
            out.write("\n".join([*head, "end_header", ""]))
            np.savetxt(out, table, "%.6g")
        return opened(path)

    def list_ply(self) -> Work:
        """Rows with a list each."""
        n = self.n_splats // 4
        bones = [np.arange(k % 4, dtype="i2") for k in range(n)]
        return self._columns("lists.ply", "binary_little_endian", share=0.25, bones=bones)

    def npz(self) -> Work:
        """Thresholds of SpikingGS beside a PLY."""
        work = self._columns("spiking.ply", "binary_little_endian", share=1.0)
        cutoffs = self.rng.random(self.n_splats).astype("f4") / 5 + 0.01
        np.savez_compressed(self.folder / "spiking.npz", Vth_pdf=cutoffs, Vth_opa=np.array([0.01], "f4"))
        return work

    def compressed_ply(self) -> Work:
        """SuperSplat's."""
        return self._written("packed.compressed.ply")

    def spz(self) -> Work:
        """Niantic's."""
        return self._written("packed.spz")

    def sog(self) -> Work:
        """PlayCanvas'."""
        return self._written("packed.sog", degree=0)

    def glb(self) -> Work:
        """Binary glTF."""
        return self._written("held.glb")

    def gltf(self) -> Work:
        """Text glTF with its numbers beside it."""
        self._written("held.glb", degree=1)
        data = (self.folder / "held.glb").read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        document = json.loads(data[20 : 20 + length])
        (self.folder / "held.bin").write_bytes(data[28 + length :])
        document["buffers"][0]["uri"] = "held.bin"
        path = self.folder / "held.gltf"
        path.write_text(json.dumps(document))
        return opened(path)

    def usd(self) -> Work:
        """OpenUSD, read by a process of its own."""
        return self._written("held.usdc")

    def splat(self) -> Work:
        """antimatter15's."""
        path = self.folder / "held.splat"
        records = splat_records(self.n_splats, self.rng)
        assert records.dtype == RECORD
        records["scale"] *= 0.01
        path.write_bytes(records.tobytes())
        return opened(path)

    def ksplat(self) -> Work:
        """mkkellogg's."""
        path = self.folder / "held.ksplat"
        path.write_bytes(ksplat_bytes(self.n_splats, self.rng))
        return opened(path)

    def _saved(self, name: str) -> Work:
        """Export splats of degree 3, all of them moved."""
        path = self.folder / "scene.ply"
        write_sample(path, splats_of(self.n_splats, 3, self.rng))
        scene = Scene(*_seen(path))
        edit = Edit(place=Place(translate=(1.0, 0.0, 0.0)))
        request = ExportRequest(
            ExportOrder(self.folder / name), scene, edit, scene.file, None, snapshot_of(scene, None)
        )
        return lambda job: exported_file(job, request)

    def save_ply(self) -> Work:
        """To a PLY."""
        return self._saved("out.ply")

    def save_compressed_ply(self) -> Work:
        """To SuperSplat's."""
        return self._saved("out.compressed.ply")

    def save_spz(self) -> Work:
        """To Niantic's."""
        return self._saved("out.spz")

    def save_sog(self) -> Work:
        """To PlayCanvas'."""
        return self._saved("out.sog")

    def save_glb(self) -> Work:
        """To binary glTF."""
        return self._saved("out.glb")

    def save_usdc(self) -> Work:
        """To an OpenUSD layer."""
        return self._saved("out.usdc")

    def save_usdz(self) -> Work:
        """To an OpenUSD package."""
        return self._saved("out.usdz")

    def recipe(self) -> Work:
        """A recipe of row numbers, near the largest that is read."""
        scene = self._scene()
        rows = ",".join(map(str, range(len(scene.splats.means))))
        handle = f'{{"rows": [{rows}]}}'
        n = TEXT_BYTES // len(handle)
        path = self.folder / "long.json"
        path.write_text(f'{{"version": 1, "handles": [{", ".join([handle] * n)}]}}')
        return lambda job: read_edit(path, scene, told_finder(job, scene.splats), job.progress("reading the edit"))

    def strokes(self) -> Work:
        """A recipe of points."""
        scene = self._scene()
        point = "[0.1234, 0.2345, 0.3456]"
        n = TEXT_BYTES // (len(point) + 1)
        stroke = f'{{"a": [{",".join([point] * n)}], "b": [{point}]}}'
        path = self.folder / "strokes.json"
        path.write_text(f'{{"version": 1, "graph": {{"separate": [{stroke}]}}, "handles": []}}')
        return lambda job: read_edit(path, scene, told_finder(job, scene.splats), job.progress("reading the edit"))

    def session(self) -> Work:
        """A session whose timeline has very many keys."""
        pose = '{"id": 1, "translate": [0.1, 0.2, 0.3], "rotate": [1.0, 0.0, 0.0, 0.0], "scale": 1.5}'
        keys = [f'{{"frame": {k + 1}, "poses": [{pose}]}}' for k in range(150_000)]
        path = self.folder / "long.splap"
        path.write_text(
            '{"format": "splap-session", "version": 1, "ply": {"path": "a.ply", "hash": "", "n_splats": 9}, '
            '"recipe": {"version": 1, "handles": [{"center": [0, 0, 0], "radius": 1}]}, "handles": [{"id": 1, '
            '"color": "#f2a93b", "enabled": true}], "timeline": {"frame": 1, "n_frames": 9, "fps": 24.0, "keys": ['
            + ",".join(keys)
            + "]}}"
        )
        return lambda job: read_session_file(path, job.progress("reading the session"))

    def flat(self) -> Work:
        """A document of numbers that mean nothing."""
        path = self.folder / "flat.splap"
        path.write_text('{"format": "splap-session", "x": [' + ",".join(["0.1"] * (TEXT_BYTES // 4)) + "]}")
        return lambda job: read_session_file(path, job.progress("reading the session"))

    def nulls(self) -> Work:
        """A document of values that no hook is called for."""
        path = self.folder / "nulls.splap"
        path.write_text('{"format": "splap-session", "x": [' + ",".join(["null"] * (TEXT_BYTES // 5)) + "]}")
        return lambda job: read_session_file(path, job.progress("reading the session"))

    def texts(self) -> Work:
        """A document of very many short texts."""
        path = self.folder / "texts.splap"
        texts = ",".join(f'"{k:07d}"' for k in range(3_900_000))
        path.write_text('{"format": "splap-session", "x": [' + texts + "]}")
        return lambda job: read_session_file(path, job.progress("reading the session"))

    def _scene(self) -> Scene:
        return Scene(*_seen(resource("samples", "bench_2dgs.ply")))


def _seen(path: Path) -> tuple[SplatFile, Ellipses]:
    file = read_ply(path)
    return file, occupancy_ellipses(file.splats)


KINDS = [name for name in vars(Inputs) if not name.startswith("_")]


class WatchedJob(Job):
    """A job that notes how long its thread runs between one look at whether it shall stop and the next."""

    gaps: list[tuple[float, str, float]]
    _last: float | None = None

    def report(self, share: float, stage: str | None = None) -> None:
        """As of `Job`."""
        self.note(f"{stage or self.stage} {share:.3f}")
        super().report(share, stage)

    def note(self, where: str) -> None:
        """Note the time since the last note."""
        # Called on the job's thread only.
        now = time.thread_time()
        if self._last is not None:
            self.gaps.append((now - self._last, where, time.perf_counter()))
        self._last = now


def watched(work: Work) -> WatchedJob:
    """Make a job of some work."""

    def function(job: Job) -> None:
        assert isinstance(job, WatchedJob)
        job.gaps = []
        job.note("start")
        try:
            work(job)
        except (ValueError, MemoryError) as error:
            note(f"refused: {str(error)[:150]}")
        finally:
            job.note("end")

    return WatchedJob("open", "", function)


def run_to_the_end(starter: Starter, work: Work) -> tuple[float, WatchedJob]:
    """Seconds that it takes, and the job."""
    job = starter.submit(watched(work))
    assert isinstance(job, WatchedJob)
    start = time.perf_counter()
    for thread in starter.threads():
        thread.join()
    return time.perf_counter() - start, job


def cancelled_at(starter: Starter, work: Work, seconds: float) -> tuple[float, float]:
    """Processor time and time by the wall until a job has ended that is cancelled so long after its start."""
    job = starter.submit(watched(work))
    (thread,) = starter.threads()
    thread.join(seconds)
    job.cancel()
    cpu, wall = time.process_time(), time.perf_counter()
    thread.join()
    return time.process_time() - cpu, time.perf_counter() - wall


def bench(kind: str, inputs: Inputs, n_moments: int, n_gaps: int) -> None:
    """One kind of input."""
    work: Work = getattr(inputs, kind)()
    starter = Starter(lambda call: None, name="splap-cancel")
    # The first run compiles.
    run_to_the_end(starter, work)
    seconds, job = run_to_the_end(starter, work)
    worst = sorted(job.gaps, reverse=True)
    rng = np.random.default_rng(1)
    seen = [cancelled_at(starter, work, moment) for moment in rng.uniform(0, seconds, n_moments)]
    cpu, wall = (sorted(some) for some in zip(*seen, strict=True)) if seen else ([0.0], [0.0])
    report(
        benchmark="cancel",
        kind=kind,
        seconds=round(seconds, 2),
        worst_gap_s=round(worst[0][0], 3),
        cancelled_s={"median": round(cpu[len(cpu) // 2], 3), "worst": round(cpu[-1], 3)},
        wall_s={"median": round(wall[len(wall) // 2], 3), "worst": round(wall[-1], 3)},
    )
    for gap, where, _ in worst[:n_gaps]:
        note(f"  {gap:.3f} s until {where}")


def main() -> None:
    """Run the kinds that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--splats", type=int, default=1_000_000)
    parser.add_argument("--moments", type=int, default=5)
    parser.add_argument("--gaps", type=int, default=0, help="also tell so many of the longest gaps")
    options = parser.parse_args()
    # As in the window, where only the main thread collects garbage.
    gc.disable()
    report(**machine())
    for kind in options.kinds:
        with tempfile.TemporaryDirectory() as folder:
            bench(kind, Inputs(Path(folder), options.splats), options.moments, options.gaps)


if __name__ == "__main__":
    main()
