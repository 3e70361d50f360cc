"""What the README shows to scripts runs as it stands."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import splap_editor as splap
from splap_editor.resources import resource
from tests.recipe_table import END, START, with_recipe_table

README = Path(__file__).resolve().parent.parent / "README.md"


def test_the_example_runs_and_its_one_call_twin_writes_the_same_file(tmp_path, monkeypatch):
    (example,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len([line for line in example.splitlines() if line.strip()]) <= 10
    shutil.copy(resource("samples", "windmill_2dgs.ply"), tmp_path / "windmill.ply")
    monkeypatch.chdir(tmp_path)
    held = {}
    exec(compile(example, str(README), "exec"), held)
    before, after = (splap.read_ply(name).splats.means for name in ("windmill.ply", "bent.ply"))
    assert np.linalg.norm(np.asarray(after) - before, axis=1).max() > 0.3
    report = splap.deform("windmill.ply", held["edit"], "twin.ply")
    assert report.n_changed > 100
    assert (tmp_path / "twin.ply").read_bytes() == (tmp_path / "bent.ply").read_bytes()


def test_the_recipe_table_says_the_options_there_are():
    text = README.read_text(encoding="utf-8")
    assert text.count(START) == text.count(END) == 1
    assert text == with_recipe_table(text), "run python -m tests.recipe_table"


def test_an_edit_of_a_script_comes_back_from_its_recipe(tmp_path):
    edit = splap.Edit(
        handles=[splap.Handle(center=(0.0, 0.0, 1.0), radius=0.1, scale=2.0)],
        pins=[splap.Pin(rows=(3, 4))],
        method="bbw",
        options=[splap.options.BbwOptions(blending="linear"), splap.options.GraphOptions(laplacian="robust")],
    )
    splap.write_recipe(tmp_path / "edit.json", edit)
    assert splap.read_recipe(tmp_path / "edit.json") == splap.Edit(
        [splap.Handle("", (0.0, 0.0, 1.0), 0.1, scale=2.0)], edit.pins, "bbw", edit.options
    )
    assert repr(edit).startswith("Edit(handles=(Handle(name='', center=(0.0, 0.0, 1.0)")
    assert repr(edit.pins).startswith("(Pin(center=None, radius=None, rows=(3, 4)")


def test_the_options_of_every_part_of_an_edit_go_by_their_names():
    for name, group in splap.options.GROUPS.items():
        assert getattr(splap.options, name) is group and group.__name__ == name
    assert set(splap.options.__all__) >= set(splap.options.GROUPS)


def test_a_set_of_handles_is_bound_once_and_posed_anew_at_will():
    file = splap.read_ply(resource("samples", "tube.ply"))
    means = np.asarray(file.splats.means, np.float64)
    ends = [tuple(means[row].tolist()) for row in (means[:, 2].argmin(), means[:, 2].argmax())]
    handle = splap.Handle(center=ends[1], radius=0.1)
    bound = splap.bind(splap.prepare(file), splap.Edit([handle], [splap.Pin(center=ends[0], radius=0.1)]))
    lifted = bound.pose([splap.Pose(translate=(0.0, 0.3, 0.0))]).splats
    assert np.linalg.norm(np.asarray(lifted.means) - means, axis=1).max() > 0.2
    with pytest.raises(ValueError, match="one Pose for each of the 1 enabled handles"):
        bound.pose([splap.Pose(), splap.Pose()])
    with pytest.raises(ValueError, match="one Pose for each of the 1 enabled handles"):
        bound.pose([(0.0, 0.3, 0.0)])
