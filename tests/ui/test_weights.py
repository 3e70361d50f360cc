"""Bounded biharmonic weights in the window: options, progress, bands, cage, read-outs."""

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from scipy.spatial import cKDTree

from splap_editor.cli import main as command_line
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.reach_options import CageOptions
from splap_editor.engine.edit import Pose
from splap_editor.engine.quantities import splat_weights
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.edit_file import write_edit
from splap_editor.session.placement import disc_rows, rows_region
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import ScrubLabel
from splap_editor.viewport.weight_colors import BAND_COLORS, REST_COLOR, weight_tints

TUBE = resource("samples", "tube.ply")


def regions(scene, shares):
    """Regions about the axis of the tube at shares of its length."""
    means = np.asarray(scene.splats.means, np.float64)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    length = np.ptp(means[:, axis])
    heights = means[:, axis].min() + np.asarray(shares) * length
    return [rows_region(scene, np.flatnonzero(np.abs(means[:, axis] - at) < 0.04 * length)) for at in heights]


def placed(driver, shares=(0.1, 0.9), method=1):
    """Choose weights in the panel and place handles along the tube."""
    driver.window.deformer_panel.method.setCurrentIndex(method)
    handles = [driver.session.steps.add_handle(region) for region in regions(driver.scene, shares)]
    driver.wait_idle()
    return handles


def laid(driver):
    """Colours over the splats in the picture."""
    return driver.window.view.viewport.splats.deformed.tints


def is_weights(driver):
    return bool((laid(driver)[:, :3] == REST_COLOR).all(axis=1).any())


def test_bands_step_at_tenths_and_rest_is_grey():
    found = weight_tints(np.array([0.0, np.nan, 0.05, 0.15, 0.95, 1.0]))
    np.testing.assert_array_equal(found[:2, :3], [REST_COLOR] * 2)
    np.testing.assert_array_equal(found[2:, :3], BAND_COLORS[[0, 1, 9, 9]])


def test_weights_of_the_chosen_handle_are_shown_and_follow_the_choice(driver):
    first, second = placed(driver)
    painted = []
    driver.window.view.weights.changed.connect(lambda: painted.append(driver.window.weight_legend.title))
    driver.key(Qt.Key.Key_W, Qt.KeyboardModifier.ShiftModifier)
    weights = splat_weights(driver.scene.surface, driver.session.bound.weights, 1)
    np.testing.assert_array_equal(laid(driver), weight_tints(weights))
    assert driver.window.weight_legend.isVisible()
    driver.scene.set_active_handles((first.handle_id,))
    weights = splat_weights(driver.scene.surface, driver.session.bound.weights, 0)
    np.testing.assert_array_equal(laid(driver), weight_tints(weights))
    driver.key(Qt.Key.Key_W, Qt.KeyboardModifier.ShiftModifier)
    assert not is_weights(driver)
    assert not driver.window.weight_legend.isVisible()
    assert painted == [f"Weight of {second.name}", f"Weight of {first.name}", ""]


def test_weights_go_away_with_the_method_and_come_back_with_it(driver):
    placed(driver)
    button = driver.window.deformer_panel.weights.button
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert is_weights(driver) and button.isChecked()
    driver.window.deformer_panel.method.setCurrentIndex(0)
    driver.wait_idle()
    assert not is_weights(driver)
    assert driver.window.deformer_panel.weights.isHidden()
    driver.session.history.undo()
    driver.wait_idle()
    assert is_weights(driver)


def test_the_cage_follows_the_number_before_the_weights_do(driver):
    handle = placed(driver, shares=(0.5,))[0]
    cage, form = driver.window.view.viewport.cage, driver.window.handles_panel.cage_form
    size = driver.scene.ellipses.scene_scale
    assert np.isclose(cage.radius, 0.3 * size)
    bound = driver.session.bound
    grip, at = form.grip, QPoint(4, form.grip.height() // 2)
    QTest.mousePress(grip, Qt.MouseButton.LeftButton, pos=at)
    QTest.mouseMove(grip, at + QPoint(5 * ScrubLabel.PIXELS_PER_STEP, 0))
    driver.qtbot.waitUntil(lambda: np.isclose(cage.radius, 0.4 * size))
    assert driver.session.bound is bound and driver.session.state == "settled", "a drag of the label computes nothing"
    QTest.mouseRelease(grip, Qt.MouseButton.LeftButton, pos=at + QPoint(5 * ScrubLabel.PIXELS_PER_STEP, 0))
    # The field holds four digits after the point.
    assert np.isclose(driver.scene.edit.handle(handle.handle_id).cage_radius, 0.4 * size, rtol=1e-3)
    driver.wait_idle()
    assert driver.session.bound is not bound
    driver.wait_frame()
    nodes = driver.session.bound.handles.indices
    points = driver.scene.ellipses.centers[nodes]
    line = np.vstack(cage.loops)
    assert cKDTree(points).query(line)[0].min() > 0.3 * size, "the outline keeps its distance"
    form.whole.click()
    assert driver.scene.edit.handle(handle.handle_id).cage_radius is None
    assert not cage.is_shown
    driver.session.history.undo()
    assert np.isclose(cage.radius, 0.4 * size, rtol=1e-3)
    driver.wait_idle()


def test_a_typed_radius_is_outlined_while_it_is_typed(driver):
    placed(driver, shares=(0.5,))
    form = driver.window.handles_panel.cage_form
    form.radius.setFocus()
    form.radius.selectAll()
    QTest.keyClicks(form.radius.lineEdit(), "0.2")
    assert np.isclose(driver.window.view.viewport.cage.radius, 0.2)
    assert driver.scene.edit.handles[0].cage_radius == CageOptions.cage_radius
    QTest.keyClick(form.radius, Qt.Key.Key_Return)
    assert driver.scene.edit.handles[0].cage_radius == 0.2
    driver.wait_idle()


def test_blending_is_an_undoable_option_of_the_weights(driver):
    placed(driver)
    form = driver.window.deformer_panel.forms[BbwOptions]
    box = form.findChild(Choice, "blending")
    assert not box.isHidden()
    box.setCurrentIndex(box.findData("linear"))
    assert driver.scene.edit.options[BbwOptions].blending == "linear"
    driver.session.history.undo()
    assert driver.scene.edit.options[BbwOptions].blending == "dual-quaternion"
    driver.wait_idle()


def test_the_panel_says_how_good_the_weights_are_and_what_they_do_not_reach(driver):
    placed(driver)
    panel = driver.window.deformer_panel
    assert panel.weights.lines == [], "nothing is wrong"
    told = panel.figures.text().splitlines()
    words, figures = told[:2], told[2:]
    assert len(figures) == 2 and all(" pulls " in line and "KKT" not in line for line in words)
    assert all("factorisation" in line and "KKT residual" in line and "bounds met" in line for line in figures)
    assert panel.details.body.isHidden(), "told to those who ask"
    panel.details.header.click()
    assert panel.figures.isVisible() and panel.timing.text().startswith("Drawing: ")
    row = int(driver.scene.ellipses.rows[0])
    driver.session.steps.add_handle(rows_region(driver.scene, disc_rows(driver.scene, row, 0.0)))
    driver.window.handles_panel.cage_form.radius.setValue(1e-6)
    driver.wait_idle()
    (line,) = panel.weights.lines
    assert "moves only its own splats" in line


def test_the_same_recipe_gives_the_same_splats_from_window_and_command_line(driver, tmp_path):
    handles = placed(driver)
    driver.session.drag.preview({handles[1].handle_id: Pose((0.0, 0.3, 0.1), (0.9, 0.1, 0.3, 0.3), 1.2)})
    driver.session.drag.commit("Move handle")
    driver.wait_idle()
    write_edit(tmp_path / "edit.json", driver.scene)
    with driver.qtbot.waitCallback() as written:
        driver.session.exported.connect(written)
        driver.session.export(tmp_path / "window.ply")
    code = command_line(
        ["deform", str(TUBE), "--quiet", "--recipe", str(tmp_path / "edit.json"), "-o", str(tmp_path / "line.ply")]
    )
    assert code == 0
    assert (tmp_path / "window.ply").read_bytes() == (tmp_path / "line.ply").read_bytes()
    moved = np.asarray(read_ply(tmp_path / "line.ply").splats.means) - np.asarray(driver.scene.splats.means)
    assert np.abs(moved).max() > 0.1
