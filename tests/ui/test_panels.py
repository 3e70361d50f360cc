"""Panels show the edit, and change it by undoable steps."""

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.deformers import DEFORMERS
from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import options_of
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import ReachOptions
from splap_editor.ui.panels.pose_form import PoseForm, euler_degrees, quat_of_euler
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import NumberField, ScrubLabel
from splap_editor.ui.widgets.options_form import OptionsForm


@pytest.mark.parametrize(
    "angles", [(10.0, 20.0, 30.0), (-170.0, 80.0, 5.0), (0.0, 90.0, 0.0), (33.0, -90.0, 0.0), (5.0, 120.0, -40.0)]
)
def test_euler_angles_come_back_from_their_quaternion(angles):
    np.testing.assert_allclose(euler_degrees(quat_of_euler(angles)), angles, atol=1e-6)


def test_of_two_ways_to_tell_a_rotation_the_shorter_is_told():
    y, z = np.array(quat_of_euler((0.0, 120.0, 0.0))), np.array(quat_of_euler((0.0, 0.0, 40.0)))
    # First about Y, then about Z: the product of the quaternions z and y.
    w = np.array([z[0] * y[0] - z[1:] @ y[1:], *(z[0] * y[1:] + y[0] * z[1:] + np.cross(z[1:], y[1:]))])
    np.testing.assert_allclose(euler_degrees(w), (0.0, 120.0, 40.0), atol=1e-9)


def test_a_pose_shown_is_not_changed_by_showing_it(qtbot):
    form = PoseForm()
    qtbot.addWidget(form)
    told = []
    form.changed.connect(told.append)
    pose = Pose((0.123456789, 0.0, -3.0), quat_of_euler((12.3456, 0.0, 1.0)), 1.23456789)
    form.show_pose(pose, 1.0)
    form.scales[0].setValue(2.0)
    assert told[0].translate == pose.translate, "digits that are not shown are kept"
    assert told[0].rotate == pose.rotate
    assert told[0].scale == 2.0


def test_a_scale_along_the_axes_has_three_fields(qtbot):
    form = PoseForm()
    qtbot.addWidget(form)
    told = []
    form.changed.connect(told.append)
    form.show_pose(Pose(), 1.0)
    assert [field.isHidden() for field in form.scales] == [False, True, True]
    form.show_pose(Pose(scale=(1.0, 2.0, 3.0)), 1.0)
    assert not any(field.isHidden() for field in form.scales)
    form.scales[1].setValue(2.5)
    assert told[-1].scale == (1.0, 2.5, 3.0)


def test_a_label_dragged_sideways_changes_its_number(qtbot):
    field = NumberField(0.0, 10.0, step=0.5)
    label = ScrubLabel("Size", field)
    qtbot.addWidget(label)
    qtbot.addWidget(field)
    label.show()
    values = []
    label.moved.connect(values.append)
    QTest.mousePress(label, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(2, 5))
    QTest.mouseMove(label, QPoint(2 + 3 * ScrubLabel.PIXELS_PER_STEP, 5))
    qtbot.waitUntil(lambda: bool(values))
    QTest.mouseRelease(label, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(20, 5))
    assert values[-1] == pytest.approx(1.5)


def test_an_options_form_gives_a_changed_copy(qtbot):
    form = OptionsForm(ArapOptions())
    qtbot.addWidget(form)
    told = []
    form.changed.connect(told.append)
    form.findChild(NumberField, "tolerance").setValue(0.01)
    assert told == [replace(ArapOptions(), tolerance=0.01)]
    form.show_value(ArapOptions(kind="libigl"))
    assert form.findChild(NumberField, "tolerance").isHidden()
    assert not form.findChild(NumberField, "iterations").isHidden()
    assert len(told) == 1


def test_every_form_offers_just_what_its_options_may_be(driver):
    seen = set()
    for form in driver.window.findChildren(OptionsForm):
        for name, known in options_of(form.value).items():
            editor = form.findChild(QWidget, name)
            if isinstance(editor, Choice):
                assert [editor.itemData(index) for index in range(editor.count())] == list(known.choices)
            elif isinstance(editor, NumberField) and known.kind == "integer":
                # A field has ends even where the option has none.
                assert [editor.minimum(), editor.maximum()] == [known.least, min(known.most, 1e9)], name
            elif isinstance(editor, NumberField) and known.kind == "length":
                # Its least number stands for no bound.
                assert known.accepts(None) and known.accepts(editor.maximum()), name
            elif isinstance(editor, NumberField):
                factor = 100.0 if known.is_percent else 1.0
                assert known.accepts(editor.minimum() / factor) and known.accepts(editor.maximum() / factor)
            seen |= {(type(form.value), name)} if editor is not None else set()
    assert (AdaptationOptions, "hops") in seen and {group for group, _ in seen} >= {row.options for row in DEFORMERS}


def test_handle_list_renames_switches_resets_and_deletes(driver):
    session, panel = driver.session, driver.window.handles_panel
    session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1), pose=Pose((0.0, 0.0, 0.1)))
    row = panel.handle_rows[1]
    row.name.setText("Left end")
    row.name.editingFinished.emit()
    assert driver.scene.edit.handles[0].name == "Left end"
    row.is_enabled.click()
    assert not driver.scene.edit.handles[0].enabled
    row.reset.click()
    assert driver.scene.edit.handles[0].pose == Pose()
    row.delete.click()
    assert driver.scene.edit.handles == ()
    for _ in range(4):
        session.history.undo()
    assert driver.scene.edit.handles[0].name == "Handle 1"
    assert driver.scene.edit.handles[0].pose == Pose((0.0, 0.0, 0.1))
    driver.wait_idle()


def test_numbers_of_the_pose_move_the_handle(driver):
    driver.session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1))
    form = driver.window.handles_panel.pose_form
    form.translate[2].setValue(0.25)
    assert driver.scene.edit.handles[0].pose.translate == (0.0, 0.0, 0.25)
    form.rotate[0].setValue(90.0)
    np.testing.assert_allclose(driver.scene.edit.handles[0].pose.rotate, quat_of_euler((90.0, 0.0, 0.0)), atol=1e-12)
    driver.wait_idle()


def test_method_and_options_are_undoable_steps(driver):
    panel, session = driver.window.deformer_panel, driver.session
    panel.method.setCurrentIndex(1)
    assert driver.scene.edit.method == "bbw"
    assert panel.forms[ArapOptions].isHidden()
    session.history.undo()
    assert driver.scene.edit.method == "arap"
    panel.free_radius.setValue(0.5)
    assert driver.scene.edit.options[ReachOptions].free_radius == 0.5
    panel.whole.click()
    assert driver.scene.edit.options[ReachOptions].free_radius is None


def test_the_scene_panel_says_what_is_open(driver):
    facts = driver.window.scene_panel.facts
    assert facts["file"].text() == "tube.ply"
    assert facts["splats"].text().startswith("2,500")
    assert "in one piece" in facts["surface"].text()


def test_display_options_reach_the_picture_and_each_mode_keeps_its_size(driver):
    display, splats = driver.window.display, driver.window.view.viewport.splats
    driver.key(Qt.Key.Key_1)
    assert splats.mode.value == "ellipse"
    display.set(size_factor=0.3)
    driver.key(Qt.Key.Key_2)
    assert splats.mode.value == "splat"
    assert splats.look.size_factor == 1.0
    driver.key(Qt.Key.Key_1)
    assert splats.look.size_factor == 0.3


def test_holding_the_key_shows_the_original(driver):
    splats = driver.window.view.viewport.splats
    QTest.keyPress(driver.window.viewport, Qt.Key.Key_O)
    assert splats.compare.value == "original"
    QTest.keyRelease(driver.window.viewport, Qt.Key.Key_O)
    assert splats.compare.value == "deformed"


def test_the_choice_of_a_method_says_what_an_artist_calls_it(driver):
    method = driver.window.deformer_panel.method
    tips = [method.itemData(index, Qt.ItemDataRole.ToolTipRole) for index in range(method.count())]
    assert all(tips) and "keeps shape" in tips[method.findData("arap")]
    assert method.toolTip() == tips[method.currentIndex()]


def cut_labels(window):
    """Texts of which a line is not seen."""
    labels = [label for label in window.dock.findChildren(QLabel) if label.isVisible() and label.wordWrap()]
    return [label.text() for label in labels if label.height() < label.heightForWidth(label.width())]


def test_no_line_of_the_panels_is_cut_while_the_surface_is_prepared_again(driver):
    centers = driver.scene.ellipses.centers
    driver.session.steps.change_edit(replace(driver.scene.edit, method="bbw"), "Change method")
    for tip in (centers[:, 2].argmin(), centers[:, 2].argmax()):
        driver.session.steps.add_handle(Region(centers[tip], 0.1))
    driver.wait_idle()
    driver.window.deformer_panel.details.header.click()
    assert len(driver.window.deformer_panel.figures.text().splitlines()) == 4
    epsilon = replace(driver.scene.edit.graph, epsilon=0.01)
    driver.session.steps.change_edit(driver.scene.edit.with_options(epsilon), "Change gap")
    # A text, the room it needs and where that is found come in turn.
    for _ in range(5):
        QApplication.processEvents()
    assert driver.session.state == "preparing"
    assert cut_labels(driver.window) == []
    driver.wait_idle()
