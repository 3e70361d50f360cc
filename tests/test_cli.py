"""The command line, as a person and a script use it."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import plyfile
import pytest

from splap_editor.cli import main
from splap_editor.io.ply import read_ply
from splap_editor.io.splat_files import read_splats
from splap_editor.resources import resource
from splap_editor.stage_report import ShareLine

TUBE = resource("samples", "tube.ply")


@pytest.fixture
def recipe(tmp_path) -> Path:
    """Bend the tube: one end pinned, the other lifted and turned."""
    means = np.asarray(read_ply(TUBE).splats.means, np.float64)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    low, high = means[means[:, axis].argmin()], means[means[:, axis].argmax()]
    reach = 0.1 * float(np.ptp(means[:, axis]))
    lift = [0.0, 0.0, 0.0]
    lift[(axis + 1) % 3] = 0.3 * float(np.ptp(means[:, axis]))
    path = tmp_path / "edit.json"
    path.write_text(
        json.dumps(
            {
                "version": 1,
                "method": "arap",
                "free_radius": None,
                "handles": [{"name": "end", "center": high.tolist(), "radius": reach, "translate": lift}],
                "pins": [{"center": low.tolist(), "radius": reach}],
            }
        )
    )
    return path


def test_deform_bends_the_sample(tmp_path, recipe, capsys):
    out = tmp_path / "out.ply"
    assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    before, after = read_ply(TUBE).splats, read_ply(out).splats
    moved = np.linalg.norm(np.asarray(after.means, float) - before.means, axis=1)
    assert summary["n_splats"] == before.n_splats == after.n_splats
    assert summary["n_changed"] == np.count_nonzero((np.asarray(after.means) != before.means).any(axis=1))
    assert summary["largest_displacement"] == pytest.approx(moved.max(), rel=1e-5)
    assert {"bind", "solve", "adapt", "write"} <= summary["timings_s"].keys()
    spec = json.loads(recipe.read_text())
    center, reach = np.array(spec["handles"][0]["center"]), spec["handles"][0]["radius"]
    held = np.linalg.norm(before.means - center, axis=1) < 0.5 * reach
    lift = np.linalg.norm(spec["handles"][0]["translate"])
    # Kernel adaptation moves a centre with its triangle's corners, so a held splat follows to a share of its own size.
    assert abs(np.median(moved[held]) - lift) < 0.02 * lift
    assert plyfile.PlyData.read(out)["vertex"].data.dtype == plyfile.PlyData.read(TUBE)["vertex"].data.dtype


def test_the_report_says_in_words_and_in_json_that_a_bent_tube_is_whole(tmp_path, recipe, capsys):
    order = ["deform", str(TUBE), "--recipe", str(recipe), "-o", str(tmp_path / "out.ply"), "--report"]
    assert main(order) == 0
    assert "check: nothing torn or drawn out" in capsys.readouterr().err
    assert main([*order, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["check"] == {"tears": 0, "webs": 0, "spikes": 0, "places": []}


def test_a_recipe_without_handles_copies_the_file(tmp_path):
    recipe, out = tmp_path / "edit.json", tmp_path / "out.ply"
    recipe.write_text('{"version": 1, "method": "arap", "handles": []}')
    assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(out), "--quiet"]) == 0
    assert out.read_bytes() == TUBE.read_bytes()


def test_the_same_recipe_twice_gives_the_same_bytes(tmp_path, recipe):
    first, second = tmp_path / "a.ply", tmp_path / "b.ply"
    for out in (first, second):
        assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(out), "--quiet"]) == 0
    assert first.read_bytes() == second.read_bytes()


def test_info_has_the_promised_keys(capsys):
    assert main(["info", str(TUBE), "--graph", "--json"]) == 0
    info = json.loads(capsys.readouterr().out)
    assert {
        "n_splats",
        "layout",
        "sh_degree",
        "n_scales",
        "n_inert",
        "scene_scale",
        "flatness",
        "warnings",
    } <= info.keys()
    assert info["flatness"].keys() == {"p5", "p50", "p95"}
    assert info["graph"].keys() == {"n_edges", "mean_degree", "n_components", "largest_component"}
    assert {"read", "occupancy", "graph", "geodesics", "laplacian"} <= info["timings_s"].keys()


def test_info_reads_well_without_json(capsys):
    assert main(["info", str(TUBE), "--quiet"]) == 0
    assert "n splats:" in capsys.readouterr().out


def test_graph_writes_vertices_and_edges(tmp_path, capsys):
    out = tmp_path / "edges.ply"
    assert main(["graph", str(TUBE), "-o", str(out), "--json"]) == 0
    counted = json.loads(capsys.readouterr().out)["n_edges"]
    data = plyfile.PlyData.read(out)
    edges = data["edge"].data
    assert len(data["vertex"].data) == read_ply(TUBE).splats.n_splats
    assert len(edges) == counted > 0
    means = np.asarray(read_ply(TUBE).splats.means, float)
    lengths = np.linalg.norm(means[edges["vertex1"]] - means[edges["vertex2"]], axis=1)
    np.testing.assert_allclose(edges["length"], lengths, rtol=1e-5)
    assert (edges["offset"] >= 0).all()


def test_progress_lines_go_to_standard_error_and_quiet_stops_them(tmp_path, recipe, capsys):
    main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(tmp_path / "a.ply")])
    captured = capsys.readouterr()
    assert captured.out == "" and all(stage in captured.err for stage in ("read", "graph", "solve", "write"))
    main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(tmp_path / "b.ply"), "--quiet"])
    captured = capsys.readouterr()
    assert captured.out == captured.err == ""


def bad_files(folder: Path) -> dict[str, tuple[Path, str]]:
    """Files that must be refused, and a word that the sentence must hold."""
    good = TUBE.read_bytes()
    head, _, body = good.partition(b"end_header\n")
    made = {
        "not_a_ply": (b"GIF89a nothing here", "PLY"),
        "empty": (b"", "PLY"),
        "truncated": (good[: len(good) - 100], "truncated"),
        "mesh": (
            b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
            "mesh",
        ),
        "no_splats": (head.replace(b"element vertex", b"element vertex 0\ncomment was", 1) + b"end_header\n", "splat"),
        "not_finite": (head + b"end_header\n" + np.float32(np.nan).tobytes() + body[4:], "finite"),
    }
    files = {}
    for name, (data, word) in made.items():
        files[name] = (folder / f"{name}.ply", word)
        files[name][0].write_bytes(data)
    files["missing"] = (folder / "missing.ply", "missing.ply")
    files["folder"] = (folder, folder.name)
    return files


@pytest.mark.parametrize(
    "name", ["not_a_ply", "empty", "truncated", "mesh", "no_splats", "not_finite", "missing", "folder"]
)
def test_a_bad_file_is_refused_in_one_sentence(name, tmp_path, recipe, capsys):
    path, word = bad_files(tmp_path)[name]
    out = tmp_path / "out.ply"
    out.write_bytes(b"what was there")
    assert main(["deform", str(path), "--recipe", str(recipe), "-o", str(out), "--quiet"]) == 2
    message = capsys.readouterr().err
    assert message.startswith("splap-editor: ") and message.count("\n") == 1
    assert word.lower() in message.lower()
    assert out.read_bytes() == b"what was there"


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"version": 2}, "version"),
        ({"metod": "arap"}, "metod"),
        ({"handles": [{"center": [0, 0], "radius": 1}]}, "center"),
        ({"handles": [{"center": [0, 0, 0], "radius": -1}]}, "radius"),
        ({"handles": [{"center": [0, 0, 0], "radius": 1, "rotate": [0, 0, 0, 0]}]}, "rotate"),
        ({"method": "magic"}, "method"),
        ({"solver": {"kind": "newton"}}, "kind"),
        ({"pins": [{"rows": [10**9]}]}, "row"),
    ],
)
def test_a_bad_recipe_is_refused_with_the_place(change, word, tmp_path, recipe, capsys):
    recipe.write_text(json.dumps({**json.loads(recipe.read_text()), **change}))
    assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(tmp_path / "out.ply"), "--quiet"]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1 and word in message
    assert not (tmp_path / "out.ply").exists()


def test_a_recipe_that_is_no_json_is_refused(tmp_path, capsys):
    recipe = tmp_path / "edit.json"
    recipe.write_text("{not json")
    assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(tmp_path / "out.ply")]) == 2
    assert "edit.json" in capsys.readouterr().err


def test_the_input_may_be_the_output(tmp_path, recipe):
    copy, other = tmp_path / "copy.ply", tmp_path / "other.ply"
    shutil.copy(TUBE, copy)
    main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(other), "--quiet"])
    assert main(["deform", str(copy), "--recipe", str(recipe), "-o", str(copy), "--quiet"]) == 0
    assert copy.read_bytes() == other.read_bytes()


@pytest.mark.parametrize("arguments", [["--help"], ["info", str(TUBE)]])
def test_help_and_info_pay_for_no_window_and_no_compiler(arguments):
    # The size of a scene is found from neighbours in space, which help has no need of.
    script = (
        "import sys\nfrom splap_editor.cli import main\n"
        "try:\n    main(sys.argv[1:])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "heavy = {'numba', 'vtkmodules', 'vtk', 'pyvista', 'PySide6', 'igl'} & set(sys.modules)\n"
        "heavy |= {'numpy', 'scipy'} & set(sys.modules) if '--help' in sys.argv else set()\n"
        "print('loaded:', *sorted(heavy))\n"
    )
    command = [sys.executable, "-c", script, *arguments]
    said = subprocess.run(command, check=True, capture_output=True, timeout=60, text=True).stdout
    assert said.splitlines()[-1] == "loaded:"


def test_quantities_are_written_as_columns_on_request(tmp_path, recipe, capsys):
    out = tmp_path / "out.ply"
    arguments = ["deform", str(TUBE), "--recipe", str(recipe), "-o", str(out), "--quiet"]
    assert main([*arguments, "--columns", "displacement, stretch,degree"]) == 0
    vertex = plyfile.PlyData.read(out)["vertex"].data
    assert vertex.dtype.names[-3:] == ("displacement", "stretch", "degree")
    moved = np.linalg.norm(np.asarray(read_ply(out).splats.means, float) - read_ply(TUBE).splats.means, axis=1)
    # Both the positions and the column are single precision.
    np.testing.assert_allclose(vertex["displacement"], moved, atol=1e-5)
    assert (vertex["degree"] >= 1).all() and (vertex["stretch"] > 0.5).all()
    assert main([*arguments, "--columns", "colour"]) == 2
    assert "there is no quantity 'colour'" in capsys.readouterr().err
    assert main([*arguments, "--columns", "geodesic"]) == 2


@pytest.mark.parametrize("kind", ["local-global", "libigl"])
def test_the_plain_solvers_run_and_own_up_to_an_unknown_residual(kind, tmp_path, recipe, capsys):
    recipe.write_text(json.dumps({**json.loads(recipe.read_text()), "solver": {"kind": kind, "iterations": 3}}))
    out = tmp_path / "out.ply"
    assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["residual"] is None and summary["n_iterations"] == 3
    assert summary["n_changed"] > 0


@pytest.mark.parametrize("ending", ["spz", "sog", "compressed.ply"])
def test_convert_says_what_is_lost_before_it_writes(ending, tmp_path, capsys):
    out, back = tmp_path / f"out.{ending}", tmp_path / "back.ply"
    assert main(["convert", str(TUBE), "-o", str(out)]) == 0
    told = capsys.readouterr()
    assert told.out == ""
    lines = told.err.splitlines()
    lost = [i for i, line in enumerate(lines) if line.startswith(f"lost in {out.name}: ")]
    assert lost and max(lost) < next(i for i, line in enumerate(lines) if line.startswith("write"))
    assert main(["convert", str(out), "-o", str(back), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["n_splats"] == read_ply(TUBE).splats.n_splats == read_ply(back).splats.n_splats
    assert summary["losses"] == []
    assert main(["info", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["n_splats"] == summary["n_splats"]


def test_deform_says_first_that_an_edited_compressed_file_is_rounded_again(tmp_path, recipe, capsys):
    packed, out = tmp_path / "packed.compressed.ply", tmp_path / "out.compressed.ply"
    assert main(["convert", str(TUBE), "-o", str(packed), "--quiet"]) == 0
    capsys.readouterr()
    assert main(["deform", str(packed), "--recipe", str(recipe), "-o", str(out)]) == 0
    said = capsys.readouterr().err
    assert said.index("lost in out.compressed.ply: Numbers are rounded once more") < said.index("write")
    recipe.write_text('{"version": 1}')
    assert main(["deform", str(packed), "--recipe", str(recipe), "-o", str(out)]) == 0
    assert "lost in" not in capsys.readouterr().err and out.read_bytes() == packed.read_bytes()


@pytest.mark.parametrize("ending", ["ply", "spz", "glb"])
def test_a_name_too_long_for_a_file_is_refused_in_a_sentence(ending, tmp_path, capsys):
    name = tmp_path / f"{'a' * 300}.{ending}"
    assert main(["info", str(name)]) == 2
    assert "could not be read: File name too long" in capsys.readouterr().err
    assert main(["convert", str(TUBE), "-o", str(name), "--quiet"]) == 2
    assert "cannot be written: File name too long. Choose a shorter name" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "words"), [("out.xyz", "ends in no known format"), ("out.splat", "only read")])
def test_convert_refuses_what_it_cannot_write(name, words, tmp_path, capsys):
    assert main(["convert", str(TUBE), "-o", str(tmp_path / name)]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / name).exists()


def test_deform_writes_what_the_ending_names(tmp_path, recipe, capsys):
    out = tmp_path / "out.spz"
    assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert any("rounded" in loss for loss in summary["losses"])
    assert read_splats(out).splats.n_splats == summary["n_splats"]


@pytest.mark.parametrize("is_live", [True, False])
def test_compiling_is_one_line_on_the_terminal(is_live, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_live, raising=False)
    tell = ShareLine("compiling for this computer, once")
    for share in (0.0, 0.004, 0.3, 0.3, 0.9, 1.0):
        tell(share)
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and told.endswith("\n") and told.startswith(("\rcompiling", "compiling"))
    assert ("100 %" in told) == is_live


@pytest.mark.skipif(sys.platform == "win32", reason="names there hold no control characters")
def test_a_terminal_obeys_nothing_that_a_file_says(tmp_path, capsys):
    sound = tmp_path / "good\x1b]0;mine\x07\n\u202e.ply"
    shutil.copy(TUBE, sound)
    assert main(["info", str(sound)]) == 0
    assert main(["convert", str(sound), "-o", str(sound.with_suffix(".splat"))]) == 2
    assert main(["convert", str(sound), "-o", str(sound.with_suffix(".spz"))]) == 0
    damaged = tmp_path / "bad\x1b[2J.ply"
    damaged.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement \x1b[31m 1\nelement vertex 0\nend_header\n")
    assert main(["info", str(damaged)]) == 2
    told = capsys.readouterr()
    shown = (told.out + told.err).replace("\n", "")
    assert shown.isprintable()
    assert r"good\x1b]0;mine\x07\n\u202e.spz" in shown and r"bad\x1b[2J.ply" in shown
    assert told.err.splitlines()[-1].startswith(r"splap-editor: bad\x1b[2J.ply"), "one line"
