"""The Check panel: what a pose spoils is listed, tinted, brought into view by a click and cured by another."""

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from splap_editor.engine.deformation_check import DeformationCheck, FlawPlace
from splap_editor.ui.panels.check_panel import TINTS


@pytest.fixture
def found(driver):
    """A tear, a web and a spike, told of the tube on screen."""
    driver.wait_idle()
    scene = driver.scene
    means = np.asarray(scene.splats.means, np.float64)
    active = scene.ellipses.rows[np.argsort(means[scene.ellipses.rows, np.argmax(np.ptp(means, axis=0))])]

    def place(kind, rows, severity):
        a, b = (rows[:2], rows[-2:]) if kind != "spike" else (rows, rows[:0])
        points = [tuple(tuple(map(float, means[row])) for row in side) for side in (a, b)]
        return FlawPlace(kind, np.sort(rows), *points, a, b, means[rows].mean(axis=0), 0.1, 0.05, severity)

    groups = active[:6], active[len(active) // 2 :][:6], active[-1:]
    kinds = ("web", "tear", "spike")
    places = tuple(place(kind, rows, 3.0 - k) for k, (kind, rows) in enumerate(zip(kinds, groups, strict=True)))
    scene.set_check(DeformationCheck(places))
    return places


def click(button):
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)


def test_places_are_listed_worst_first_and_tinted_until_the_pose_changes(driver, found):
    panel = driver.window.inspection.check_panel
    assert panel.status.text() == "1 tear, 1 web, 1 spike"
    assert [button.text().partition(":")[0] for button in panel.places] == ["Web", "Tear", "Spike"]
    assert [cure and cure.text() for cure in panel.cures] == ["Separate…", "Join…", None]
    marks = driver.window.view.marks("check")
    assert [(set(rows.tolist()), color) for rows, color in reversed(marks)] == [
        (set(place.rows.tolist()), TINTS[place.kind]) for place in found
    ]
    panel.tinted.click()
    assert not driver.window.view.marks("check")
    panel.tinted.click()
    driver.scene.set_pose(None)
    assert not panel.places and "settled" in panel.status.text() and not driver.window.view.marks("check")


def test_a_click_brings_a_place_into_view(driver, found):
    camera = driver.window.view.viewport.camera
    panel = driver.window.inspection.check_panel
    for button, place in zip(panel.places[:2], found, strict=False):
        click(button)
        wanted = driver.window.view.viewport.frame(place.rows)
        driver.qtbot.waitUntil(lambda wanted=wanted: np.allclose(camera.view.focal_point, wanted.focal_point))


@pytest.mark.parametrize(("place", "tool"), [(0, "separate"), (1, "join")])
def test_the_cure_points_its_tool_at_both_sides(driver, found, place, tool):
    panel = driver.window.inspection.check_panel
    click(panel.cures[place])
    chosen = driver.window.tools.chosen
    assert chosen.name == tool
    assert [set(rows) for rows in chosen.rows] == [set(found[place].a_rows), set(found[place].b_rows)]
    driver.qtbot.waitUntil(lambda: chosen.found is not None, timeout=60_000)
