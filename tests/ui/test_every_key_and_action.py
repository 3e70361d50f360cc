"""Every shortcut is pressed and every action clicked in a real, focused window, and each has an effect."""

from dataclasses import replace
from time import sleep

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.core.camera_path import CameraPose
from splap_editor.core.handle_nodes import Region
from splap_editor.core.place import Place
from splap_editor.core.pose import Pose
from splap_editor.engine.keyframes import edit_at_frame, keyed_edit
from splap_editor.session.pivot import Pivot
from splap_editor.tools.brush_tool import BrushOptions
from splap_editor.tools.floaters_tool import FloaterOptions
from splap_editor.tools.handle_tool import HandleOptions
from splap_editor.tools.pin_tool import PinOptions
from splap_editor.tools.tool import PointerEvent
from splap_editor.tools.tool_table import TOOLS
from splap_editor.tools.transform_tool import TransformTool
from splap_editor.ui.actions.action_table import ACTIONS

WAIT_MS = 20_000

ELSEWHERE = {
    "file.quit": "test_jobs_and_leaving",
    "file.open_sample": "test_documents",
    "view.full_screen": "below",
    "edit.stop": "test_jobs_and_leaving",
    "edit.resume": "test_jobs_and_leaving",
    "display.weights": "test_weights",
    "graph.cut_edge": "test_inspect",
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
        (scene.active_handles, scene.active_pins, scene.pivot),
        (scene.selection.tobytes(), scene.hidden.tobytes(), tuple(scene.selection_sets)),
        (window.display.options, window.inspection.graph_view.options),
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
    driver.session.steps.add_pin(Region(centers[np.argmin(centers[:, 0])], 0.1))
    driver.session.steps.add_handle(Region(centers[np.argmax(centers[:, 0])], 0.1), pose=Pose((0.05, 0.0, 0.1)))
    edit = keyed_edit(driver.scene.edit)
    edit = keyed_edit(replace(edit, timeline=replace(edit.timeline, frame=9)))
    stand = CameraPose((0.0, -6.0, 1.0), (0.0, 0.0, 0.0))
    edit = replace(edit, timeline=edit.timeline.with_camera_key(1, stand))
    driver.session.steps.change_edit(edit_at_frame(edit, 5), "Set keys")
    return driver.scene.edit


def prepared(driver, spec, edit):
    """Bring the window to where the action changes something."""
    window, scene, camera = driver.window, driver.scene, driver.window.view.viewport.camera
    n = scene.splats.n_splats
    if driver.session.history.can_redo:
        driver.session.history.redo()
    window.timeline_actions.play(False)
    # A flight that the key before began would go on, and pass for an effect of this one.
    driver.qtbot.waitUntil(lambda: not window.view.viewport.is_moving, timeout=WAIT_MS)
    frame = 1 if spec.action_id in ("timeline.delete_key", "timeline.delete_camera_key") else 5
    shown = edit_at_frame(edit, frame)
    if spec.action_id.startswith("remove.restore"):
        rows = np.arange(n)
        shown = replace(shown, removal=shown.removal.with_rows((rows > 1000) & (rows < 1100)))
    if spec.action_id == "place.reset":
        shown = replace(shown, place=Place(translate=(0.1, 0.0, 0.0)))
    scene.set_edit(shown)
    scene.set_active_handles((edit.handles[0].handle_id,))
    scene.set_pivot(Pivot.ACTIVE if spec.action_id == "handle.pivot_median" else Pivot.MEDIAN)
    scene.set_hidden(np.arange(n) < 20)
    scene.set_selection((np.arange(n) > 900) & (np.arange(n) < 1200))
    window.display.set(mode="points" if spec.action_id == "display.splats" else "splats")
    window.display.set(shown="both" if spec.action_id == "display.deformed" else "deformed")
    window.inspection.graph_view.set(shown="near" if spec.action_id == "graph.off" else "off")
    window.tools.choose(TOOLS[1 if spec.action_id == f"tool.{TOOLS[0].name}" else 0].name)
    camera.view = replace(camera.home, position=camera.home.position * 1.3 + 0.1)
    if spec.group == "up":
        scene.set_up((1.0, 0.0, 0.0))
    if spec.action_id == "edit.redo":
        driver.session.history.undo()
    window.toast.say("")
    window.actions_.refresh()
    QCoreApplication.processEvents()


class SlowFrames:
    """Take as long for a frame, while ``on``, as a large scene does without a graphics card."""

    def __init__(self, driver, seconds):
        self.on, self.seconds, self._viewport = False, seconds, driver.window.viewport
        self._viewport.frame_drawn.connect(self._drawn)

    def begin(self):
        """Be slow from the frame on that is drawn next, which is soon."""
        self.on = True
        self._viewport.update()

    def _drawn(self, _):
        if self.on:
            sleep(self.seconds)


def close_what_opened(driver):
    for widget in QApplication.topLevelWidgets():
        if widget.isVisible() and widget is not driver.window:
            widget.close()
    QCoreApplication.processEvents()
    driver.window.activateWindow()
    driver.qtbot.waitUntil(driver.window.isActiveWindow)
    driver.window.viewport.setFocus()


@pytest.mark.parametrize("how", ["key", "click", "key while frames are slow"])
def test_every_action_has_an_effect(driver, how):
    window, edit = driver.window, base_edit(driver)
    slow = SlowFrames(driver, 0.3 if "slow" in how else 0.0)
    how = how.split()[0]
    driver.wait_idle()
    dead = []
    ways = [(spec, keys) for spec in ACTIONS for keys in (spec.shortcuts if how == "key" else ("",))]
    for spec, keys in ways:
        if spec.action_id in ELSEWHERE:
            continue
        slow.on = False
        close_what_opened(driver)
        prepared(driver, spec, edit)
        action = window.actions_[spec.action_id]
        before = seen(driver)
        if not action.isEnabled():
            dead.append(f"{spec.action_id} is off")
            continue
        slow.begin()
        if how == "key":
            pressed = QKeySequence(keys)[0]
            QTest.keyClick(window.viewport, pressed.key(), pressed.keyboardModifiers())
        else:
            action.trigger()
        try:
            driver.qtbot.waitUntil(lambda before=before: seen(driver) != before, timeout=WAIT_MS)
        except driver.qtbot.TimeoutError:
            dead.append(f"{spec.action_id} {keys}")
    slow.on = False
    close_what_opened(driver)
    driver.session.halt()
    assert dead == []


def test_full_screen_and_back(driver):
    for is_full in (True, False):
        driver.key(Qt.Key.Key_F11)
        driver.qtbot.waitUntil(lambda is_full=is_full: driver.window.isFullScreen() == is_full)


GESTURES = ("lick", "rag", "heel", "inch", "ingers", "ress", "elease", "ove")


def tool_keys():
    """Every key that the tables of the tools tell of, with the tool it is told for."""
    standing = [("handle", row) for row in (*TransformTool.bindings, *TransformTool.active_bindings)]
    rows = [*standing, *((entry.name, row) for entry in TOOLS for row in entry.kind.bindings)]
    for name, row in rows:
        for text in row.chords if row.sentence else ():
            if not text.endswith(GESTURES):
                yield name, row, text


def tool_state(driver):
    """What a key of a tool may change."""
    gizmo, context = driver.window.view.viewport.gizmo, driver.window.tools.context
    return (
        gizmo.dragged,
        (driver.scene.shown_edit, driver.scene.preview is None),
        (context.hud.text, context.held(HandleOptions).value, context.held(PinOptions).value),
        (context.held(BrushOptions).value, context.inspected.edge, driver.scene.picked),
        (window_tool(driver, "separate").parts, window_tool(driver, "separate").wider),
        (window_tool(driver, "join").parts, window_tool(driver, "join").steps),
        (driver.scene.selection.tobytes(), tuple(window_tool(driver, "polygon").corners)),
        (window_tool(driver, "crop").shape, driver.window.view.viewport.is_moving),
    )


def window_tool(driver, name):
    return driver.window.tools.tools[name]


def ready_for(driver, name, row, text):
    """Bring a tool to where its key changes something."""
    context = driver.window.tools.context
    if row in TransformTool.active_bindings:
        # Of three transforms by key each can be changed for another.
        driver.key(Qt.Key.Key_R if text == "G" else Qt.Key.Key_G)
        driver.key(Qt.Key.Key_1)
    elif name == "inspect":
        graph, rows = driver.scene.surface.graph, driver.scene.ellipses.rows
        pair = int(rows[0]), int(rows[graph.indices[0]])
        context.inspected.pick(pair[0])
        context.inspected.pick_edge(pair)
    elif name == "polygon":
        size, ratio = driver.window.viewport.size(), driver.window.viewport.devicePixelRatioF()
        width, height = size.width() * ratio, size.height() * ratio
        # Round half of the picture: there is something to add, to take away and to keep.
        window_tool(driver, name).corners = [(0.0, 0.0), (0.5 * width, 0.0), (0.5 * width, height), (0.0, height)]
        driver.scene.set_selection(np.full(driver.scene.splats.n_splats, "Ctrl" in text))
    elif name == "crop":
        crop = window_tool(driver, name)
        crop.begin()
        crop.show(crop.shape.sized(crop.shape.center, crop.shape.halves))
    elif name == "level":
        # The tools before have flown to a few splats.
        driver.window.view.viewport.reset_camera()
        at, ratio = driver.surface_pixel(), driver.window.viewport.devicePixelRatioF()
        window_tool(driver, name).fit(PointerEvent("press", (at.x() * ratio, at.y() * ratio)))
        driver.qtbot.waitUntil(lambda: driver.scene.preview is not None, timeout=60_000)
    elif name == "measure":
        measure = window_tool(driver, name)
        for row in driver.scene.ellipses.rows[[0, -1]]:
            measure.put(len(measure.rows), int(row))
        if text in ("Return", "Enter", "Backspace"):
            driver.key(Qt.Key.Key_5)
    elif name == "floaters":
        finder = window_tool(driver, name)
        context.held(FloaterOptions).set(FloaterOptions(0.99))
        finder.begin()
        driver.qtbot.waitUntil(lambda: finder.found is not None and finder.found.strength == 0.99, timeout=60_000)
        assert finder.found.n_groups
        driver.qtbot.waitUntil(lambda: not driver.window.view.viewport.is_moving, timeout=WAIT_MS)
    elif name in ("separate", "join") and text in ("Return", "Enter"):
        # With nothing pointed at, it is about the selection and the rest.
        driver.scene.set_selection(driver.scene.splats.means[:, 0] > 0.0)
    elif name in ("separate", "join"):
        at, ratio = driver.surface_pixel(), driver.window.viewport.devicePixelRatioF()
        for _ in range(2):
            window_tool(driver, name).take_part([(at.x() * ratio, at.y() * ratio)])


@pytest.mark.parametrize("frame_s", [0.0, 0.3])
def test_every_key_of_a_tool_has_an_effect(driver, frame_s):
    edit, window, dead, seen_keys = base_edit(driver), driver.window, [], 0
    driver.wait_idle()
    slow = SlowFrames(driver, frame_s)
    for name, row, text in tool_keys():
        slow.on = False
        window.tools.cancel()
        driver.scene.set_edit(edit)
        driver.scene.set_active_handles((edit.handles[0].handle_id,))
        window.tools.choose(name)
        driver.wait_idle()
        ready_for(driver, name, row, text)
        before = tool_state(driver)
        slow.begin()
        pressed = QKeySequence(text.removeprefix("Any+").replace("Number", "7"))[0]
        driver.key(pressed.key(), pressed.keyboardModifiers())
        seen_keys += 1
        if tool_state(driver) == before:
            dead.append(f"{name}: {text}")
    slow.on = False
    window.tools.cancel()
    driver.session.halt()
    assert seen_keys > 20 and dead == []
