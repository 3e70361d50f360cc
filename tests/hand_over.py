"""Files handed to another program and taken from it: ``python -m tests.hand_over``; needs node and npm.

SuperSplat's ``splat-transform`` reads every file that we write of our samples, and we read every file that it writes:
the same number of splats, and numbers no farther apart than the formats' steps. So do gsply and plyfile. Prints a line
a hand-over, and ends with 1 if one failed; without node it says so and ends with 0.
"""

import argparse
import csv
import dataclasses
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gsply
import numpy as np
import plyfile
from scipy.spatial import cKDTree

from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import alphas_of, bare_splats
from splap_editor.io.formats.table import FORMATS
from splap_editor.io.splat_files import read_splats, write_splats
from splap_editor.resources import resource
from tests.reference.ply import ply_bytes

PACKAGE = "@playcanvas/splat-transform@2.7.1"
SAMPLES = ("tube", "coil", "bench_2dgs", "windmill_2dgs")
PARTS = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
LARGEST = {"ply": 1e-6, "compressed-ply": 3e-3, "spz": 2e-4, "sog": 2e-3, "gltf": 1e-5, "csv": 1e-5}
"""Of positions, in sizes of the scene."""


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.hand_over", description=__doc__)
    parser.add_argument("--program", help="splat-transform, if it is installed; else npm fetches it")
    options = parser.parse_args()
    if shutil.which("node") is None or (options.program is None and shutil.which("npm") is None):
        print("skipped: node and npm are not installed")
        return 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = options.program or _installed(folder)
        failures = 0
        for sample in SAMPLES:
            failures += _tried(sample, program, folder)
        failures += _misread(program, folder)
    print(f"{failures} hand-overs failed")
    return bool(failures)


def _installed(folder: Path) -> str:
    subprocess.run(["npm", "install", "--silent", "--prefix", str(folder), PACKAGE], check=True)
    return str(folder / "node_modules" / ".bin" / "splat-transform")


def _misread(program: str, folder: Path) -> int:
    """Hand over layouts that only 3DGS programs would misread, made plain for them; gives the number of failures."""
    thick, flat = folder / "thick.ply", read_splats(resource("samples", "tube.ply"))
    write_splats(thick, flat, flat.splats, as_3dgs=True)
    file = read_splats(thick)
    splats, failures = file.splats, 0
    opacities = {"opacity": alphas_of(splats.logit_opacities).astype("f4")}
    changes = {"spikinggs": opacities, "gof": {"filter_3D": np.full(splats.n_splats, 0.004, "f4")}}
    for layout, columns in changes.items():
        held = {name: np.asarray(values) for name, values in file.table.columns.items()} | columns
        path, ours = folder / f"{layout}.ply", folder / f"{layout}_ours.ply"
        path.write_bytes(ply_bytes(held))
        own = read_splats(path, layout=layout)
        write_splats(ours, own, own.splats, as_3dgs=True)
        bare, _ = bare_splats(own.splats)
        failures += _told(f"{ours.name} → splat-transform", "ply", bare, partial(_through, program, ours, folder))
    return failures


def _tried(sample: str, program: str, folder: Path) -> int:
    """Hand a sample over in every format, both ways; gives the number of failures."""
    file = read_splats(resource("samples", f"{sample}.ply"))
    bare, _ = bare_splats(file.splats)
    failures = 0
    for row in FORMATS.values():
        # splat-transform knows no USD; `tests/io/formats/test_usd.py` reads ours with OpenUSD's own library.
        if not row.can_be_written or row.name in ("usd", "usdz"):
            continue
        ours = folder / f"{sample}_ours{row.suffixes[0]}"
        write_splats(ours, file, file.splats, as_3dgs=file.splats.n_scales == 2)
        theirs = folder / f"{sample}_theirs{row.suffixes[0]}"
        if row.name != "gltf":
            failures += _told(
                f"{ours.name} → splat-transform", row.name, bare, partial(_through, program, ours, folder)
            )
        _transformed(program, folder / f"{sample}_ours.ply", theirs)
        failures += _told(f"{theirs.name} → SpLap Editor", row.name, bare, partial(_read, theirs))
        if row.name in ("ply", "compressed-ply"):
            failures += _told(f"{ours.name} → gsply", row.name, bare, partial(_of_gsply, ours))
        if row.name == "ply":
            failures += _told(f"{ours.name} → plyfile", row.name, bare, partial(_of_plyfile, ours, bare))
    unbundled = folder / f"{sample}_theirs" / "meta.json"
    unbundled.parent.mkdir()
    _transformed(program, folder / f"{sample}_ours.ply", unbundled)
    failures += _told(f"{sample}_theirs/meta.json → SpLap Editor", "sog", bare, partial(_read, unbundled))
    _transformed(program, folder / f"{sample}_ours.ply", folder / "theirs.csv")
    failures += _told(f"{sample}.csv", "csv", bare, partial(_of_csv, folder / "theirs.csv", bare))
    return failures


def _transformed(program: str, source: Path, target: Path) -> None:
    subprocess.run(
        [program, "-q", "-w", "-g", "cpu", str(source), str(target)], check=True, capture_output=True, timeout=600
    )


def _through(program: str, path: Path, folder: Path) -> Splats:
    _transformed(program, path, folder / "back.ply")
    return read_splats(folder / "back.ply").splats


def _read(path: Path) -> Splats:
    return read_splats(path).splats


def _of_gsply(path: Path) -> Splats:
    held = gsply.plyread(path)
    shN = np.zeros((len(held.means), 0, 3)) if held.shN is None else held.shN
    return Splats(held.means, held.scales, held.quats, held.opacities, held.sh0, shN)


def _of_plyfile(path: Path, bare: Splats) -> Splats:
    columns = plyfile.PlyData.read(path)["vertex"]
    means, scales = (np.column_stack([columns[n] for n in names]) for names in (("x", "y", "z"), _SCALES))
    return dataclasses.replace(bare, means=means, log_scales=scales)


def _of_csv(path: Path, bare: Splats) -> Splats:
    with path.open() as lines:
        rows = list(csv.DictReader(lines))
    means, scales = (np.array([[float(r[n]) for n in names] for r in rows]) for names in (("x", "y", "z"), _SCALES))
    return dataclasses.replace(bare, means=means, log_scales=scales)


_SCALES = ("scale_0", "scale_1", "scale_2")


def _told(what: str, name: str, bare: Splats, read: Callable[[], Splats]) -> int:
    """Compare, print a line, and give 1 for a failure."""
    try:
        found = read()
        worst = _farthest(bare, found, name)
        good, text = (
            worst[0] <= LARGEST[name],
            "positions {:.1e} s, scales (median) {:.1%}, opacities {:.4f}".format(*worst),
        )
    except (ValueError, OSError, AssertionError, subprocess.CalledProcessError) as error:
        good, text = False, str(getattr(error, "stderr", b"") or error)[-200:]
    print(f"{'ok  ' if good else 'FAIL'} {what}: {text}", flush=True)
    return not good


def _farthest(bare: Splats, found: Splats, name: str) -> tuple[float, float, float]:
    assert found.n_splats == bare.n_splats, f"{found.n_splats} splats of {bare.n_splats}"
    size = float(np.linalg.norm(np.ptp(bare.means, axis=0)))
    if FORMATS.get(name, FORMATS["ply"]).reorders:
        rows = cKDTree(found.means).query(bare.means)[1]
        found = dataclasses.replace(found, **{part: getattr(found, part)[rows] for part in PARTS})
    means = float(np.abs(found.means - bare.means).max()) / size
    scales = float(np.median(np.abs(np.expm1(found.log_scales[:, :2] - bare.log_scales[:, :2]))))
    opacities = float(np.percentile(np.abs(alphas_of(found.logit_opacities) - alphas_of(bare.logit_opacities)), 99))
    return means, scales, opacities


if __name__ == "__main__":
    sys.exit(main())
