"""The Scene panel as a detective: what is odd can be selected, what was guessed can be overridden."""

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox, QPushButton

from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose
from splap_editor.io.ply import read_ply, write_ply
from splap_editor.resources import resource


def choose(box, data):
    """Pick an entry as a person does, with the keyboard."""
    box.setFocus()
    step = Qt.Key.Key_Down if box.findData(data) > box.currentIndex() else Qt.Key.Key_Up
    box.showPopup()
    for _ in range(abs(box.findData(data) - box.currentIndex())):
        QTest.keyClick(box.view(), step)
    QTest.keyClick(box.view(), Qt.Key.Key_Return)


def looked_through(driver):
    found = driver.window.scene_panel.oddities
    driver.qtbot.waitUntil(lambda: found.found is not None, timeout=60_000)
    return found


@pytest.fixture
def thick_file(tmp_path):
    """The tube with a third scale: which axis is the normal is a guess then."""
    flat = read_ply(resource("samples", "tube.ply"))
    write_ply(tmp_path / "thick.ply", flat, flat.splats, as_3dgs=True)
    return tmp_path / "thick.ply"


def opened(driver, path):
    driver.open(path)
    driver.wait_idle()


@pytest.fixture
def odd_file(tmp_path, thick_file):
    file = read_ply(thick_file)

    quats = np.array(file.splats.quats)
    quats[[5, 6]] = 0.0
    write_ply(tmp_path / "odd.ply", file, replace(file.splats, quats=quats))
    return tmp_path / "odd.ply"


def test_odd_splats_are_selected_by_a_button_and_that_can_be_undone(driver, odd_file):
    opened(driver, odd_file)
    found = looked_through(driver)
    place = next(k for k, oddity in enumerate(found.found) if "zero rotation" in oddity.sentence)
    QTest.mouseClick(found.buttons[place], Qt.MouseButton.LeftButton)
    np.testing.assert_array_equal(np.flatnonzero(driver.scene.selection), [5, 6])
    driver.session.history.undo()
    assert not driver.scene.selection.any()


def test_the_panel_says_how_the_file_was_read(driver, thick_file):
    opened(driver, thick_file)
    facts = driver.window.scene_panel.facts
    assert driver.scene.file.layout.reason in facts["layout"].text()
    assert "opacities through a sigmoid" in facts["reading"].text()
    assert facts["trust"].text()
    form = driver.window.scene_panel.layout_form
    assert form.layouts.currentData() == driver.scene.file.layout.name
    assert form.axes.currentText() == "Thinnest axis"
    assert form.layouts.findData("supersplat-compressed") < 0, "only what suits the columns"


def test_every_guess_can_be_overridden_and_recognised_again(driver, thick_file):
    opened(driver, thick_file)
    form = driver.window.scene_panel.layout_form
    recognised, before = driver.scene.file.layout.name, driver.scene
    choose(form.axes, 1)
    driver.qtbot.waitUntil(lambda: driver.scene is not before, timeout=60_000)
    driver.wait_idle()
    assert driver.scene.splats.normal_axis == 1
    assert form.axes.currentText() == "Axis 1"
    assert driver.window.scene_panel.facts["layout"].text() == f"{recognised}: chosen by hand"
    before = driver.scene
    choose(form.layouts, "sugar")
    driver.qtbot.waitUntil(lambda: driver.scene is not before, timeout=60_000)
    driver.wait_idle()
    assert driver.scene.file.layout.name == "sugar" and driver.scene.splats.normal_axis == 0
    before = driver.scene
    choose(form.layouts, None)
    driver.qtbot.waitUntil(lambda: driver.scene is not before, timeout=60_000)
    driver.wait_idle()
    assert driver.scene.file.layout.name == recognised and not driver.scene.file.layout.is_chosen


def test_an_edit_is_not_lost_by_reading_anew(driver, thick_file):
    opened(driver, thick_file)
    driver.session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1), pose=Pose((0.0, 0.0, 0.2)))
    driver.wait_idle()
    scene, form = driver.scene, driver.window.scene_panel.layout_form
    choose(form.axes, 0)
    box = driver.window.findChild(QMessageBox)
    assert box is not None and box.isVisible()
    assert form.axes.currentText() == "Thinnest axis", "what the file is read as until it is read anew"
    cancel = next(button for button in box.findChildren(QPushButton) if button.text() == "Cancel")
    QTest.mouseClick(cancel, Qt.MouseButton.LeftButton)
    assert driver.scene is scene and driver.scene.edit.handles
