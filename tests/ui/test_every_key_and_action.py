"""Every shortcut is pressed and every action clicked in a real, focused window, and each has an effect."""

from dataclasses import replace
from time import sleep

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.engine.keyframes import edit_at_frame, keyed_edit
from splap_editor.tools.tool_table import TOOLS
from splap_editor.ui.actions.action_table import ACTIONS

WAIT_MS = 20_000

ELSEWHERE = {
    "file.quit": "ends the window",
    "file.open_sample": "test_documents",
    "view.full_screen": "a matter of the window manager",
    "edit.stop": "test_jobs_and_leaving",
    "edit.resume": "test_jobs_and_leaving",
    "display.weights": "test_weights",
    "graph.cut_edge": "test_inspect",
    "graph.cut_between": "test_graph",
    "graph.join": "test_graph",
    "graph.join_fragments": "test_graph",
    "graph.clear_mends": "test_graph",
}
"""Actions that need more than one scene gives at a time, and where they are tried."""


def seen(driver):
    """What a person can see of the state: anything that an action may change."""
    window, scene, camera = driver.window, driver.scene, driver.window.view.viewport.camera
    view = camera.view
    return (
        id(scene),
        scene.shown_edit,
        scene.active_handles,
        (scene.selection.tobytes(), scene.hidden.tobytes(), tuple(scene.selection_sets)),
        (window.display.options, window.inspection.graph_view.options, id(window.inspection.graph_actions.kept)),
        (window.tools.chosen.name, window.toast.text, window.view.viewport.gizmo.is_local),
        tuple(np.round([*view.position, *view.focal_point, *view.view_up], 9)),
        (view.is_parallel, camera.is_turntable, tuple(camera.world_up)),
        (window.dock.isVisible(), window.timeline_actions.player.is_playing),
        [type(each).__name__ for each in QApplication.topLevelWidgets() if each.isVisible()],
        [window.actions_[spec.action_id].isChecked() for spec in ACTIONS],
    )


def base_edit(driver):
    """Handles with poses, a pin, keys at two frames."""
    centers = driver.scene.ellipses.centers
    driver.session.add_pin(Region(centers[np.argmin(centers[:, 0])], 0.1))
    driver.session.add_handle(Region(centers[np.argmax(centers[:, 0])], 0.1), pose=Pose((0.05, 0.0, 0.1)))
    edit = keyed_edit(driver.scene.edit)
    edit = keyed_edit(replace(edit, timeline=replace(edit.timeline, frame=9)))
    driver.session.change_edit(edit_at_frame(edit, 5), "Set keys")
    return driver.scene.edit


def prepared(driver, spec, edit):
    """Bring the window to where the action changes something."""
    window, scene, camera = driver.window, driver.scene, driver.window.view.viewport.camera
    n = scene.splats.n_splats
    if driver.session.history.can_redo:
        driver.session.history.redo()
    window.timeline_actions.play(False)
    frame = 1 if spec.action_id == "timeline.delete_key" else 5
    scene.set_edit(edit_at_frame(edit, frame))
    scene.set_active_handles((edit.handles[0].handle_id,))
    scene.set_hidden(np.arange(n) < 20)
    scene.set_selection((np.arange(n) > 900) & (np.arange(n) < 1200))
    window.display.set(mode="points" if spec.action_id == "display.splats" else "splats")
    window.display.set(shown="both" if spec.action_id == "display.deformed" else "deformed")
    window.inspection.graph_view.set(shown="near" if spec.action_id == "graph.off" else "off")
    window.tools.choose(TOOLS[1 if spec.action_id == f"tool.{TOOLS[0].name}" else 0].name)
    camera.view = replace(camera.home, position=camera.home.position * 1.3 + 0.1)
    if spec.group == "up":
        camera.world_up = np.array((1.0, 0.0, 0.0))
    if spec.action_id == "edit.redo":
        driver.session.history.undo()
    window.toast.say("")
    window.actions_.refresh()
    QCoreApplication.processEvents()


def slow_frame(*_):
    """Take as long for a frame as a large scene does without a graphics card."""
    sleep(0.3)


def close_what_opened(driver):
    for widget in QApplication.topLevelWidgets():
        if widget.isVisible() and widget is not driver.window:
            widget.close()
    QCoreApplication.processEvents()
    driver.window.activateWindow()
    driver.qtbot.waitUntil(driver.window.isActiveWindow)
    driver.window.viewport.setFocus()


@pytest.mark.parametrize("how", ["key", "click", "key while frames are slow"])
def test_every_action_has_an_effect(driver, quiet, how):
    window, edit = driver.window, base_edit(driver)
    if "slow" in how:
        window.viewport.frame_drawn.connect(slow_frame)
    how = how.split()[0]
    driver.wait_idle()
    dead = []
    for spec in ACTIONS:
        if spec.action_id in ELSEWHERE or (how == "key" and not spec.shortcuts):
            continue
        close_what_opened(driver)
        prepared(driver, spec, edit)
        action = window.actions_[spec.action_id]
        before = seen(driver)
        if not action.isEnabled():
            dead.append(f"{spec.action_id} is off")
        elif how == "key":
            pressed = QKeySequence(spec.shortcuts[0])[0]
            QTest.keyClick(window.viewport, pressed.key(), pressed.keyboardModifiers())
        else:
            action.trigger()
        try:
            driver.qtbot.waitUntil(lambda before=before: seen(driver) != before, timeout=WAIT_MS)
        except driver.qtbot.TimeoutError:
            dead.append(spec.action_id)
    close_what_opened(driver)
    driver.session.halt()
    assert dead == []
