"""The speed table of the README: each figure beside its peer, in one run, as JSON lines.

::

    python tests/benchmark/speed.py --splats 100000
    python tests/benchmark/speed.py --splats 25000 100000 400000 --only stages
    python tests/benchmark/speed.py --method bbw
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.benchmark.peers import machine, note, report, timed

REPOSITORY = Path(__file__).resolve().parents[2]


def bench_stages(n_splats: int) -> None:
    """Occupancy → Laplacian against robust_laplacian's point-cloud Laplacian, in a process of its own."""
    options = ["--splats", str(n_splats), "--repeats", "3" if n_splats <= 200_000 else "1"]
    if n_splats > 500_000:
        options.append("--no-peer")
    subprocess.run([sys.executable, "-m", "tests.benchmark.graph_stages", *options], cwd=REPOSITORY, check=True)


def bench_arap(n_splats: int) -> None:
    """One iteration against libigl's, and the way to the minimiser against plain local/global's."""
    subprocess.run(
        [sys.executable, "-m", "tests.benchmark.arap", "--splats", str(n_splats)], cwd=REPOSITORY, check=True
    )


def bench_adaptation(n_splats: int) -> None:
    """Kernel adaptation and the rotation of degree-3 colour."""
    subprocess.run(
        [sys.executable, "-m", "tests.benchmark.adaptation", "--splats", str(n_splats)], cwd=REPOSITORY, check=True
    )


def bench_read(n_splats: int = 1_000_000) -> None:
    """Read an SH3 file of 62 columns, and one in gsply's own order, against gsply."""
    import gsply
    import numpy as np

    from splap_editor.io.ply import read_ply

    plain = [*"xyz", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(45)), "opacity"]
    plain += [*(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
    orders = {"62 columns with normals": [*plain[:3], "nx", "ny", "nz", *plain[3:]], "59 columns": plain}
    for name, columns in orders.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "million.ply"
            header = "\n".join(
                ["ply", "format binary_little_endian 1.0", f"element vertex {n_splats}"]
                + [f"property float {column}" for column in columns]
                + ["end_header", ""]
            )
            values = np.random.default_rng(0).standard_normal((n_splats, len(columns)), np.float32)
            with open(path, "wb") as file:
                file.write(header.encode())
                values.tofile(file)
            del values
            seconds, _ = timed(lambda path=path: read_ply(path))
            peer, _ = timed(lambda path=path: gsply.plyread(path))
        report(benchmark="read", columns=name, n_splats=n_splats, seconds=seconds, gsply=peer, ratio=seconds / peer)


def bench_start() -> None:
    """Start of the command line without a window."""
    sample = REPOSITORY / "resources" / "samples" / "bench_2dgs.ply"
    for arguments in (["--help"], ["info", str(sample)]):
        command = [sys.executable, "-m", "splap_editor", *arguments]
        seconds, _ = timed(
            lambda command=command: subprocess.run(command, cwd=REPOSITORY, capture_output=True, check=True)
        )
        report(benchmark="start", command=" ".join(Path(part).name for part in arguments), seconds=seconds)


def main() -> None:
    """Measure what is asked for, everything by default."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--splats", type=int, nargs="+", default=[100_000])
    parser.add_argument("--method", choices=("arap", "bbw"), default="arap")
    parser.add_argument("--only", choices=("stages", "arap", "adaptation", "read", "start"), nargs="+")
    options = parser.parse_args()
    report(**machine())
    if options.method == "bbw":
        from tests.benchmark.bbw import bench_bbw

        bench_bbw()
        return
    wanted = options.only or ("stages", "arap", "adaptation", "read", "start")
    for n_splats in options.splats:
        for name, bench in (("stages", bench_stages), ("arap", bench_arap), ("adaptation", bench_adaptation)):
            if name in wanted:
                note(f"{name}: {n_splats} splats")
                bench(n_splats)
    if "read" in wanted:
        bench_read()
    if "start" in wanted:
        bench_start()


if __name__ == "__main__":
    main()
