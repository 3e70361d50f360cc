"""The dialogs of exports tell the formats apart, and what each loses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QWidget
from shiboken6 import isValid

from splap_editor.app import Mailbox
from splap_editor.core.place import Place
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.timeline import Timeline
from splap_editor.io.splat_files import losses_of_saving, read_splats, write_splats
from splap_editor.resources import resource
from splap_editor.session.jobs import Job, Worker
from splap_editor.session.scene import Scene
from splap_editor.ui.dialogs.export_dialog import ExportDialog
from splap_editor.ui.dialogs.frames_dialog import FramesDialog
from splap_editor.ui.widgets.format_choice import FormatChoice

from .conftest import WAIT_MS


@pytest.fixture(scope="module")
def flat_file():
    return read_splats(resource("samples", "windmill_2dgs.ply"))


@pytest.fixture
def worker(qapp):
    mailbox = Mailbox()
    worker = Worker(mailbox.post)
    yield worker
    worker.close()


@pytest.fixture
def dialog(qtbot, tmp_path, flat_file, worker):
    scene = Scene(flat_file, occupancy_ellipses(flat_file.splats))
    made = ExportDialog(None, tmp_path / "out.ply", scene, {}, worker)
    made.show()
    yield made
    if isValid(made):
        made.reject()


@pytest.fixture
def ordered():
    return []


@pytest.fixture
def frames_dialog(qtbot, flat_file, worker, ordered):
    host = QWidget()
    qtbot.addWidget(host)
    made = FramesDialog(host, flat_file, Timeline(), (80, 60), ordered.append, worker)
    made.show()
    yield made
    if isValid(made):
        made.reject()


def choose(choice: FormatChoice, name: str) -> None:
    """As a person does: the list is opened, and gone through by its keys."""
    field = choice.field
    steps = field.findData(name) - field.currentIndex()
    for _ in range(abs(steps)):
        QTest.keyClick(field, Qt.Key.Key_Down if steps > 0 else Qt.Key.Key_Up)


def wait_told(qtbot, choice: FormatChoice) -> None:
    qtbot.waitUntil(lambda: choice.is_told, timeout=WAIT_MS)


def held_up(worker: Worker):
    """Something that the worker does until it is let go."""
    held = []

    def wait(job: Job) -> None:
        while not held:
            job.report(0.0)

    worker.submit(Job("wait", "", wait))
    return lambda: held.append(True)


def test_a_file_of_two_scales_says_who_reads_it_until_it_gets_a_third(dialog):
    choice = dialog.choice
    assert "SuperSplat" in choice.losses.text() and choice.plain.isVisible()
    QTest.mouseClick(choice.plain, Qt.MouseButton.LeftButton, pos=choice.plain.rect().center() / 4)
    assert not choice.losses.isVisible() and dialog.as_3dgs


def test_a_layout_that_others_misread_is_offered_as_a_plain_one_and_its_losses_are_said(
    qtbot, tmp_path, flat_file, worker
):
    filtered = np.full(flat_file.splats.n_splats, 0.01)
    scales = np.column_stack([flat_file.splats.log_scales, np.full(flat_file.splats.n_splats, -5.0)])
    file = replace(flat_file, splats=replace(flat_file.splats, log_scales=scales, filter_radii=filtered))
    dialog = FramesDialog(None, file, Timeline(), (80, 60), lambda order: None, worker)
    dialog.show()
    dialog.kind.setCurrentIndex(dialog.kind.findData("splats"))
    choice = dialog.choice
    assert "3-D filter" in choice.losses.text() and choice.plain.isVisible()
    choice.plain.setChecked(True)
    wait_told(qtbot, choice)
    assert choice.as_3dgs and "Lost: The filter_3D column is worked into" in choice.losses.text()
    choose(choice, "spz")
    assert not choice.as_3dgs and not choice.plain.isVisible()
    dialog.reject()


@pytest.mark.parametrize(("name", "ending"), [("spz", ".spz"), ("sog", ".sog"), ("gltf", ".glb")])
def test_a_format_chosen_changes_the_ending_and_says_what_is_lost(dialog, qtbot, name, ending, tmp_path):
    choose(dialog.choice, name)
    assert dialog.path == tmp_path / f"out{ending}"
    wait_told(qtbot, dialog.choice)
    assert "Lost: Flat splats" in dialog.choice.losses.text()
    assert not dialog.choice.plain.isVisible() and not dialog.as_3dgs and dialog.column_names == ()
    choose(dialog.choice, "compressed-ply")
    assert dialog.path == tmp_path / "out.compressed.ply"
    choose(dialog.choice, "ply")
    assert dialog.path == tmp_path / "out.ply"


def test_an_ending_typed_chooses_its_format_and_one_only_read_is_refused(dialog, qtbot, tmp_path):
    dialog.path_field.setText(str(tmp_path / "out.sog"))
    assert dialog.choice.field.currentData() == "sog"
    qtbot.waitUntil(dialog.accept_button.isEnabled, timeout=WAIT_MS)
    dialog.path_field.setText(str(tmp_path / "out.splat"))
    assert not dialog.accept_button.isEnabled()
    assert "only read" in dialog.note.text()
    assert Path(dialog.path).suffix == ".splat"


def test_what_is_typed_first_replaces_the_suggestion(dialog, qtbot, tmp_path):
    qtbot.keyClicks(dialog.path_field, str(tmp_path / "typed.ply"))
    assert dialog.path == tmp_path / "typed.ply"


def test_a_format_chosen_without_a_name_goes_by_the_one_suggested(dialog, tmp_path):
    dialog.path_field.clear()
    choose(dialog.choice, "spz")
    assert dialog.path == tmp_path / "out.spz"


def test_nothing_is_saved_before_it_is_said_what_that_loses_and_only_the_format_chosen_last_is_worked_out(
    dialog, qtbot, worker, monkeypatch
):
    worked_out = []

    def noted(file, row, **more):
        worked_out.append(row.name)
        return losses_of_saving(file, row, **more)

    monkeypatch.setattr("splap_editor.ui.widgets.format_choice.losses_of_saving", noted)
    go_on = held_up(worker)
    choose(dialog.choice, "gltf")
    assert "Working out" in dialog.choice.losses.text() and not dialog.accept_button.isEnabled()
    # A PLY loses nothing, so that there is nothing to wait for.
    choose(dialog.choice, "ply")
    assert dialog.accept_button.isEnabled()
    choose(dialog.choice, "spz")
    go_on()
    qtbot.waitUntil(dialog.accept_button.isEnabled, timeout=WAIT_MS)
    assert "Numbers are rounded" in dialog.choice.losses.text()
    assert worked_out == ["spz"]


@pytest.mark.parametrize("is_edited", [False, True])
def test_an_edited_compressed_file_says_what_saving_it_compressed_loses(qtbot, tmp_path, flat_file, worker, is_edited):
    write_splats(tmp_path / "held.compressed.ply", flat_file, flat_file.splats)
    file = read_splats(tmp_path / "held.compressed.ply")
    scene = Scene(file, occupancy_ellipses(file.splats))
    if is_edited:
        scene.edit = replace(scene.edit, place=Place(translate=(1.0, 0.0, 0.0)))
    dialog = ExportDialog(None, tmp_path / "out.ply", scene, {}, worker)
    dialog.show()
    assert ("no longer compressed" in dialog.choice.facts.text()) == is_edited
    choose(dialog.choice, "compressed-ply")
    wait_told(qtbot, dialog.choice)
    assert dialog.choice.losses.text().startswith("Lost: Numbers are rounded once more" if is_edited else "")
    assert dialog.choice.losses.isVisible() == is_edited
    dialog.reject()


def test_a_name_too_long_for_a_file_is_said(dialog, tmp_path):
    dialog.path_field.setText(str(tmp_path / ("a" * 300 + ".spz")))
    assert "too long" in dialog.note.text() and not dialog.accept_button.isEnabled()


def test_losses_that_cannot_be_told_keep_nobody_from_saving(dialog, qtbot, monkeypatch):
    def fails(*arguments, **more):
        raise MemoryError("no room")

    monkeypatch.setattr("splap_editor.ui.widgets.format_choice.losses_of_saving", fails)
    choose(dialog.choice, "spz")
    qtbot.waitUntil(dialog.accept_button.isEnabled, timeout=WAIT_MS)
    assert "no room" in dialog.choice.losses.text()


def test_a_dialog_closed_meanwhile_hears_nothing_more(qtbot, flat_file, worker):
    go_on = held_up(worker)
    made = FramesDialog(None, flat_file, Timeline(), (80, 60), lambda order: None, worker)
    made.show()
    made.kind.setCurrentIndex(made.kind.findData("splats"))
    choose(made.choice, "sog")
    heard = []
    made.choice.told.connect(lambda: heard.append(True))
    made.reject()
    go_on()
    qtbot.waitUntil(lambda: not worker.is_busy(), timeout=WAIT_MS)
    assert heard == []


def test_frames_of_a_format_that_loses_something_say_so_before_a_name_is_asked_for(frames_dialog, qtbot):
    assert not frames_dialog.choice.isVisible()
    frames_dialog.kind.setCurrentIndex(frames_dialog.kind.findData("splats"))
    choose(frames_dialog.choice, "spz")
    wait_told(qtbot, frames_dialog.choice)
    assert "Lost: Flat splats" in frames_dialog.choice.losses.text() and frames_dialog.choice.losses.isVisible()


def test_the_name_asked_for_has_the_ending_of_the_format_chosen(frames_dialog, dialog, qtbot, tmp_path):
    frames_dialog.kind.setCurrentIndex(frames_dialog.kind.findData("splats"))
    for made, button in ((frames_dialog, frames_dialog.accept_button), (dialog, dialog.browse_button)):
        choose(made.choice, "spz")
        wait_told(qtbot, made.choice)
        button.click()
        asked = next(w for w in QApplication.topLevelWidgets() if isinstance(w, QFileDialog) and w.isVisible())
        assert asked.selectedFiles()[0].endswith(".spz")
        asked.reject()
        qtbot.waitUntil(lambda asked=asked: not isValid(asked) or not asked.isVisible(), timeout=WAIT_MS)


def test_a_name_of_another_format_shows_its_losses_and_is_taken_when_it_comes_again(
    frames_dialog, qtbot, ordered, tmp_path
):
    frames_dialog.kind.setCurrentIndex(frames_dialog.kind.findData("splats"))
    frames_dialog.export_to(tmp_path / "out.ksplat")
    assert ordered == [] and "only read" in frames_dialog.note.text()
    frames_dialog.export_to(tmp_path / "out.glb")
    assert ordered == [] and frames_dialog.choice.format.name == "gltf"
    wait_told(qtbot, frames_dialog.choice)
    assert frames_dialog.accept_button.isEnabled() and frames_dialog.accept_button.isDefault()
    assert "Lost: Flat splats" in frames_dialog.choice.losses.text()
    frames_dialog.export_to(tmp_path / "out.glb")
    assert [order.path.name for order in ordered] == ["out.glb"]


def test_one_file_of_all_frames_says_that_it_replaces_another(frames_dialog, ordered, tmp_path):
    held = tmp_path / "out.mp4"
    held.write_bytes(b"")
    frames_dialog.kind.setCurrentIndex(frames_dialog.kind.findData("turntable"))
    frames_dialog.export_to(held)
    assert ordered == [] and "exists" in frames_dialog.note.text()
    frames_dialog.export_to(held)
    assert [order.path for order in ordered] == [held]


def test_frames_of_flat_splats_can_have_a_third_scale(frames_dialog, ordered, tmp_path):
    frames_dialog.kind.setCurrentIndex(frames_dialog.kind.findData("splats"))
    frames_dialog.choice.plain.setChecked(True)
    frames_dialog.export_to(tmp_path / "out.ply")
    assert ordered[0].as_3dgs
