"""Every format converted into every other by the terminal: ``python -m tests.all_pairs [--splats N]``.

Prints a line a pair: what was said to be lost, or what went wrong. ``info --json`` and ``convert --json`` must print
one JSON object and nothing else, what libraries write below Python included; what is written must hold as many splats.
Ends with 1 if a pair failed.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import gaussforge

from splap_editor.io.formats.table import FORMATS, SplatFormat
from splap_editor.io.sample_maker import shape_sample, write_sample
from splap_editor.io.splat_files import read_splats, write_splats


def sources(folder: Path, n_splats: int) -> dict[str, Path]:
    """A file of each format that is read."""
    plain = folder / "scene.ply"
    write_sample(plain, shape_sample("coil", n_splats).splats)
    file = read_splats(plain)
    thick = folder / "thick.ply"
    write_splats(thick, file, file.splats, as_3dgs=True)
    found = {"ply": thick, "ply of two scales": plain}
    for row in FORMATS.values():
        path = folder / f"held{row.suffixes[0]}"
        if row.name == "sog-folder":
            with zipfile.ZipFile(found["sog"]) as held:
                held.extractall(folder / "held")
            path = folder / "held"
        elif row.can_be_written and not row.is_lossless:
            write_splats(path, file, file.splats)
        elif not row.is_lossless:
            path.write_bytes(gaussforge.GaussForge().convert(thick.read_bytes(), "ply", row.name)["data"])
        else:
            continue
        found[row.name] = path
    return found


def told(*words: str) -> dict:
    """What a command prints, as one JSON object.

    Raises
    ------
    ValueError
        If it failed, or printed something else.
    """
    command = [sys.executable, "-m", "splap_editor", *words, "--json"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(f"ended with {done.returncode}: {done.stderr.strip()[-200:]}")
    found = json.loads(done.stdout)
    if not isinstance(found, dict):
        raise ValueError(f"printed {done.stdout[:80]!r}")
    return found


def tried(name: str, source: Path, row: SplatFormat, folder: Path, n_splats: int) -> str:
    """Convert one pair; what is to be said of it.

    Raises
    ------
    ValueError
        If it failed.
    """
    out = folder / f"out{row.suffixes[0]}"
    out.unlink(missing_ok=True)
    losses = told("convert", str(source), "-o", str(out))["losses"]
    n_found = read_splats(out).splats.n_splats
    if n_found != n_splats:
        raise ValueError(f"{n_found} splats of {n_splats}")
    is_kept = name == row.name == "compressed-ply"
    if losses if row.is_lossless else row.rounds and not losses and not is_kept:
        raise ValueError(f"said to lose {losses}")
    return " ".join(losses)


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.all_pairs", description=__doc__)
    parser.add_argument("--splats", type=int, default=400)
    options = parser.parse_args()
    failures = 0
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        held = sources(folder, options.splats)
        n_splats = read_splats(held["ply"]).splats.n_splats
        for name, source in held.items():
            targets = [None, *(row for row in FORMATS.values() if row.can_be_written)]
            for row in targets:
                what = f"info {name}" if row is None else f"{name} → {row.name}"
                try:
                    said = "" if row else f"{len(told('info', str(source))['saving_loses'])} formats told"
                    said = tried(name, source, row, folder, n_splats) if row else said
                except (ValueError, KeyError) as error:
                    failures, said = failures + 1, f"FAIL {error}"
                print(f"{what}: {said or 'nothing lost'}", flush=True)
    print(f"{failures} failed")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
