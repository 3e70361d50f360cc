"""Laws of merging: the rows of one file after those of the other, and each of them is as it was."""

import json
from itertools import pairwise

import numpy as np
import pytest

from splap_editor.cli import main
from splap_editor.core.progress import Cancelled
from splap_editor.io.merging import merged_files
from splap_editor.io.ply import PlyError, read_ply
from splap_editor.io.splat_files import read_splats, write_splats
from tests.io.test_layouts import FILES
from tests.reference.ply import compressed_bytes, ply_bytes, splat_columns

PARTS = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")


def columns(n, seed, **options):
    return splat_columns(n, np.random.default_rng(seed), **options)


def read(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    return read_splats(tmp_path / name)


def written(tmp_path, *files, **options):
    """The file that a merge becomes, read again, and the merge."""
    merged = merged_files(files, **options)
    write_splats(tmp_path / "merged.ply", merged.file, merged.file.splats)
    return read_ply(tmp_path / "merged.ply"), merged


def separated(merged, of):
    """Mask of the rows of one of the files."""
    ends = np.cumsum([0, *merged.counts])
    start, stop = list(pairwise(ends))[of]
    return (np.arange(ends[-1]) >= start) & (np.arange(ends[-1]) < stop)


@pytest.mark.parametrize("name", [name for name in FILES if name not in ("supersplat-compressed", "spikinggs")])
def test_a_file_merged_with_one_of_its_layout_and_separated_is_the_same_bytes(name, tmp_path):
    a, b = read(tmp_path, "a.ply", FILES[name]()), read(tmp_path, "b.ply", FILES[name]())
    again, merged = written(tmp_path, a, b)
    assert again.layout.name == name and merged.notes == [] and merged.counts == (20, 20)
    for of, file in enumerate((a, b)):
        mask = separated(merged, of)
        assert again.table.rows[mask].tobytes() == file.table.rows.tobytes()
        write_splats(tmp_path / "apart.ply", merged.file, merged.file.splats, removed=~mask)
        assert read_ply(tmp_path / "apart.ply").table.rows.tobytes() == file.table.rows.tobytes()


def test_columns_are_united_and_harmonics_filled_up(tmp_path):
    plain = columns(5, 1, normals=True, n_rest=9) | {"label": np.arange(5, dtype="u1")}
    rich = columns(7, 2, normals=True, n_rest=45) | {"x": np.linspace(0, 1, 7)}
    a, b = (read(tmp_path, f"{k}.ply", ply_bytes(held)) for k, held in enumerate((plain, rich)))
    assert a.layout.name == b.layout.name == "3dgs"
    again, merged = written(tmp_path, a, b)
    assert again.layout.name == "3dgs"
    first, last = separated(merged, 0), separated(merged, 1)
    for part in PARTS[:-1]:
        held = getattr(again.splats, part)
        np.testing.assert_array_equal(held[first], getattr(a.splats, part))
        np.testing.assert_array_equal(held[last], getattr(b.splats, part))
    np.testing.assert_array_equal(again.splats.shN[first][:, :3], a.splats.shN)
    assert not again.splats.shN[first][:, 3:].any()
    np.testing.assert_array_equal(again.splats.shN[last], b.splats.shN)
    assert again.table.columns["x"].dtype == np.float64, "the wider type holds both"
    assert again.table.columns["label"].dtype == np.uint8
    np.testing.assert_array_equal(again.table.columns["label"], [*range(5), *[0] * 7])
    assert merged.notes == [
        "0.ply has harmonics of degree 1: zeros up to degree 3.",
        "1.ply has no label: 0 in its rows.",
    ]


@pytest.mark.parametrize("name", [name for name in FILES if name != "gsplat"])
def test_layouts_that_differ_become_plain_and_keep_what_means_the_same(name, tmp_path):
    a, b = read(tmp_path, "a.ply", FILES[name]()), read(tmp_path, "b.ply", FILES["gsplat"]())
    again, merged = written(tmp_path, a, b)
    assert again.splats.n_scales == 3 and merged.file.layout.name == "3dgs"
    assert any(f"a.ply is {name}" in note and "all become 3dgs" in note for note in merged.notes)
    last = separated(merged, 1)
    for part in PARTS[:-1]:
        np.testing.assert_array_equal(getattr(again.splats, part)[last], getattr(b.splats, part))
    n = b.splats.shN.shape[1]
    np.testing.assert_array_equal(again.splats.shN[last][:, :n], b.splats.shN)
    first = ~last
    np.testing.assert_array_equal(again.splats.means[first], np.asarray(a.splats.means, np.float32))
    usable = a.splats.opacities > 0.0
    np.testing.assert_allclose(again.splats.opacities[first], a.splats.opacities, atol=2e-6)
    k = a.splats.n_scales
    np.testing.assert_allclose(again.splats.scales[first][usable, :k], a.splats.scales[usable], rtol=1e-5, atol=1e-6)
    thin = [note for note in merged.notes if "Flat splats" in note]
    assert bool(thin) == (k == 2)


def test_flat_splats_stay_flat_among_themselves_unless_another_layout_is_asked_for(tmp_path):
    a, b = (read(tmp_path, f"{k}.ply", ply_bytes(columns(6, k, normals=True, n_scales=2))) for k in (1, 2))
    assert written(tmp_path, a, b)[0].splats.n_scales == 2
    thick, merged = written(tmp_path, a, b, layout="3dgs")
    assert thick.splats.n_scales == 3
    np.testing.assert_array_equal(thick.splats.log_scales[separated(merged, 1), :2], b.splats.log_scales)


def test_flat_splats_with_a_filter_stay_flat_too(tmp_path):
    filtered = columns(6, 1, normals=True, n_scales=2) | {"filter_3D": np.full(6, 0.01, "f4")}
    a = read(tmp_path, "a.ply", ply_bytes(filtered))
    b = read(tmp_path, "b.ply", ply_bytes(columns(6, 2, n_scales=2, rgb=True)))
    assert a.splats.filter_radii is not None and a.splats.n_scales == b.splats.n_scales == 2
    again, merged = written(tmp_path, a, b)
    assert again.splats.n_scales == 2
    np.testing.assert_allclose(again.splats.scales[separated(merged, 0)], a.splats.scales, rtol=1e-5)


def test_three_files_of_text_bytes_and_packed_cells_go_together(tmp_path):
    held = columns(4, 5)
    text = read(tmp_path, "a.ply", ply_bytes(held, format_="ascii"))
    packed = read(tmp_path, "b.ply", compressed_bytes(columns(9, 6)))
    plain = read(tmp_path, "c.ply", ply_bytes(held))
    again, merged = written(tmp_path, text, packed, plain)
    assert merged.counts == (4, 9, 4) and again.splats.n_splats == 17
    np.testing.assert_array_equal(again.splats.means[13:], plain.splats.means)
    np.testing.assert_allclose(again.splats.means[:4], plain.splats.means, rtol=1e-6)


def test_what_cannot_be_is_refused(tmp_path):
    a, b = read(tmp_path, "a.ply", FILES["2dgs"]()), read(tmp_path, "b.ply", FILES["gof"]())
    with pytest.raises(PlyError, match="two files or more"):
        merged_files([a])
    with pytest.raises(PlyError, match=r"cannot become 2dgs, as a.ply is 2dgs, b.ply is gof: choose 3dgs"):
        merged_files([a, b], layout="2dgs")
    with pytest.raises(PlyError, match="cannot become brush"):
        merged_files([a, a], layout="brush")


def test_a_merge_asks_whether_to_go_on(tmp_path):
    a = read(tmp_path, "a.ply", FILES["3dgs"]())
    asked = []

    def stop(share):
        asked.append(share)
        if len(asked) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        merged_files([a, a], progress=stop)
    assert asked == sorted(asked) and asked[0] >= 0.0


@pytest.mark.parametrize("ending", ["ply", "spz", "glb"])
def test_the_terminal_merges_into_any_format_and_says_what_differs(ending, tmp_path, capsys):
    a, b, out = tmp_path / "a.ply", tmp_path / "b.ply", tmp_path / f"out.{ending}"
    a.write_bytes(FILES["2dgs"]())
    b.write_bytes(FILES["3dgs"]())
    assert main(["merge", str(a), str(b), "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["counts"] == [20, 20] and told["layout"] == "3dgs" and len(told["notes"]) == 3
    assert bool(told["losses"]) == (ending == "spz")
    assert read_splats(out).splats.n_splats == 40
    assert main(["merge", str(a), str(b), "-o", str(out), "--layout", "2dgs", "--quiet"]) == 2
    assert "choose 3dgs" in capsys.readouterr().err
    assert main(["merge", str(a), "-o", str(tmp_path / "one.ply"), "--quiet"]) == 2
    assert not (tmp_path / "one.ply").exists()
    capsys.readouterr()


def test_the_file_that_was_read_may_be_the_one_that_is_written(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(FILES["3dgs"]())
    before = read_ply(path).table.rows.tobytes()
    assert main(["merge", str(path), str(path), "-o", str(path), "--quiet"]) == 0
    assert read_ply(path).table.rows.tobytes() == 2 * before
