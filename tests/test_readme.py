"""What the README shows to scripts runs as it stands."""

import re
import shutil
from pathlib import Path

import numpy as np

import splap_editor as splap
from splap_editor.resources import resource

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


def test_an_edit_of_a_script_comes_back_from_its_recipe(tmp_path):
    edit = splap.Edit(
        handles=[splap.Handle(center=(0.0, 0.0, 1.0), radius=0.1, scale=2.0)],
        pins=[splap.Pin(rows=(3, 4))],
        method="bbw",
        options=[splap.BbwOptions(blending="linear"), splap.GraphOptions(laplacian="robust")],
    )
    splap.write_edit(tmp_path / "edit.json", edit)
    assert splap.read_edit(tmp_path / "edit.json") == splap.Edit(
        [splap.Handle("", (0.0, 0.0, 1.0), 0.1, scale=2.0)], edit.pins, "bbw", edit.options
    )
