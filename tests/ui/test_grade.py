"""Grading in the real window: sliders, the picture that follows, undo, session and export."""

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from splap_editor.engine.grading import Grading
from splap_editor.engine.scripting import deform
from splap_editor.session.edit_file import read_edit, write_edit
from splap_editor.viewport.glyphs import base_colors
from tests.ui.conftest import WAIT_MS

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def shown_colors(driver):
    return driver.window.view.viewport.splats.deformed.base_colors


def wait_graded(driver):
    """Until the picture has the colours that the edit on screen says."""
    scene = driver.scene

    def is_graded():
        graded = scene.shown_edit.grading.graded_so_far(scene.splats, scene.surface)
        return scene.splats.shN.shape[1] or np.array_equal(shown_colors(driver), base_colors(graded))

    driver.qtbot.waitUntil(is_graded, timeout=WAIT_MS)


def select_half(driver):
    scene = driver.scene
    means = np.asarray(scene.splats.means)[:, 0]
    scene.set_selection(means > np.median(means))
    return scene.selection


def test_a_slider_that_is_dragged_is_followed_and_is_one_step_when_let_go(driver):
    panel, scene = driver.window.grade_panel, driver.scene
    before = shown_colors(driver).copy()
    assert panel.add_everything.isEnabled() and not panel.add_selection.isEnabled()
    QTest.mouseClick(panel.add_everything, LEFT)
    assert driver.session.history.undo_label == "Grade splats" and scene.edit.is_identity
    row = panel.rows["exposure"]
    assert not row.slider.isHidden() and panel.rows["falloff"].slider.isHidden()
    # As a hand that holds it does, wherever the form puts its handle.
    row.slider.setSliderDown(True)
    row.slider.setValue(row.slider.value() + 60)
    scene = driver.session.shown_scene
    assert scene.preview is not None and scene.edit.is_identity
    brighter = scene.preview.grading.steps[0].options.exposure
    assert brighter > 0.0 and row.field.value() == brighter
    wait_graded(driver)
    assert shown_colors(driver)[:, :3].mean() > before[:, :3].mean()
    row.slider.setSliderDown(False)
    scene = driver.session.shown_scene
    assert scene.preview is None and scene.edit.grading.steps[0].options.exposure == brighter
    assert driver.session.history.undo_label == "Change exposure"
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    wait_graded(driver)
    np.testing.assert_array_equal(shown_colors(driver), before)
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert scene.edit.grading.steps == () and panel.chosen.isHidden()


def test_a_graded_selection_fades_out_and_is_exported_as_it_is_shown(driver, tmp_path):
    panel, scene = driver.window.grade_panel, driver.scene
    mask = select_half(driver)
    QTest.mouseClick(panel.add_selection, LEFT)
    panel.rows["saturation"].field.setValue(20.0)
    panel.rows["opacity"].field.setValue(50.0)
    panel.rows["falloff"].field.setValue(0.3 * scene.ellipses.scene_scale)
    grading = scene.edit.grading
    (options,) = (step.options for step in grading.steps)
    assert (options.saturation, options.opacity) == (0.2, 0.5) and grading.needs_surface
    np.testing.assert_array_equal(grading.masks[0], mask)
    wait_graded(driver)
    write_edit(tmp_path / "edit.json", scene)
    again = read_edit(tmp_path / "edit.json", scene)
    assert again.grading.like(grading)
    written = []
    driver.session.exported.connect(written.append)
    driver.session.export(tmp_path / "out.ply")
    driver.qtbot.waitUntil(lambda: bool(written), timeout=WAIT_MS)
    deform(scene.file.path, again, tmp_path / "twin.ply")
    assert (tmp_path / "out.ply").read_bytes() == (tmp_path / "twin.ply").read_bytes()
    assert written[0].is_graded and not driver.session.has_unexported_edit


def test_grades_are_listed_chosen_and_deleted(driver):
    panel, scene = driver.window.grade_panel, driver.scene
    select_half(driver)
    QTest.mouseClick(panel.add_everything, LEFT)
    QTest.mouseClick(panel.add_selection, LEFT)
    n = int(scene.selection.sum())
    assert [panel.chosen.itemText(k) for k in range(2)] == ["1 · everything", f"2 · {n:,} splats"]
    assert panel.index == 1 and not panel.rows["falloff"].slider.isHidden()
    panel.chosen.setCurrentIndex(0)
    panel.rows["hue"].field.setValue(90.0)
    assert [step.options.hue for step in scene.edit.grading.steps] == [90.0, 0.0]
    QTest.mouseClick(panel.delete, LEFT)
    assert [step.options.hue for step in scene.edit.grading.steps] == [0.0]
    assert driver.session.history.undo_label == "Delete grade"
    wait_graded(driver)
    driver.session.history.undo()
    assert panel.rows["hue"].field.value() == 90.0
    wait_graded(driver)


def test_the_original_is_shown_in_the_colours_of_the_file(driver):
    splats, scene = driver.window.view.viewport.splats, driver.scene
    before = shown_colors(driver).copy()
    grading = Grading().with_grade()
    options = grading.steps[0].options
    driver.session.drag.preview_grading(grading.with_options(0, type(options)(exposure=2.0)))
    wait_graded(driver)
    driver.window.display.set(shown="both")
    assert splats.has_original
    np.testing.assert_array_equal(splats.original.base_colors, before)
    driver.session.drag.cancel()
    assert scene.preview is None
    wait_graded(driver)
    np.testing.assert_array_equal(shown_colors(driver), before)
