"""The export dialog tells the formats apart, and what each loses."""

from pathlib import Path

import pytest

from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.io.splat_files import read_splats
from splap_editor.resources import resource
from splap_editor.session.scene import Scene
from splap_editor.ui.dialogs.export_dialog import ExportDialog


@pytest.fixture
def dialog(qtbot, tmp_path):
    file = read_splats(resource("samples", "windmill_2dgs.ply"))
    made = ExportDialog(None, tmp_path / "out.ply", Scene(file, occupancy_ellipses(file.splats)), {})
    made.show()
    return made


def choose(dialog: ExportDialog, name: str) -> None:
    index = dialog.format_field.findData(name)
    dialog.format_field.setCurrentIndex(index)
    dialog.format_field.activated.emit(index)


def test_a_file_of_two_scales_says_who_reads_it_until_it_gets_a_third(dialog):
    assert "SuperSplat" in dialog.losses.text() and dialog.third_scale.isVisible()
    dialog.third_scale.setChecked(True)
    assert not dialog.losses.isVisible() and dialog.as_3dgs


@pytest.mark.parametrize(("name", "ending"), [("spz", ".spz"), ("sog", ".sog"), ("gltf", ".glb")])
def test_a_format_chosen_changes_the_ending_and_says_what_is_lost(dialog, name, ending, tmp_path):
    choose(dialog, name)
    assert dialog.path == tmp_path / f"out{ending}"
    assert "Lost: Flat splats" in dialog.losses.text()
    assert not dialog.third_scale.isVisible() and not dialog.as_3dgs and dialog.column_names == ()
    choose(dialog, "compressed-ply")
    assert dialog.path == tmp_path / "out.compressed.ply"
    choose(dialog, "ply")
    assert dialog.path == tmp_path / "out.ply"


def test_an_ending_typed_chooses_its_format_and_one_only_read_is_refused(dialog, tmp_path):
    dialog.path_field.setText(str(tmp_path / "out.sog"))
    assert dialog.format_field.currentData() == "sog" and dialog.accept_button.isEnabled()
    dialog.path_field.setText(str(tmp_path / "out.splat"))
    assert not dialog.accept_button.isEnabled()
    assert "only read" in dialog.note.text()
    assert Path(dialog.path).suffix == ".splat"
