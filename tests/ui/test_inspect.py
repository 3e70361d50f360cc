"""The Inspect tool in the real window."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt

from splap_editor.session.neighbor_sets import neighbor_set
from splap_editor.viewport.inspect_view import FIRST_COLOR, SECOND_COLOR

WAIT_MS = 60_000


@pytest.fixture
def picked(driver) -> None:
    """The splat in the middle of the tube, clicked with the Inspect tool."""
    driver.key(Qt.Key.Key_I)
    driver.click(driver.surface_pixel())
    assert driver.scene.picked is not None


def middle_of_longest_line(driver) -> tuple[tuple[int, int], QPoint]:
    edges = driver.window.inspection.inspected.neighbor_edges()
    ends = np.asarray(driver.scene.positions, np.float64)[edges]
    pixels = driver.window.view.viewport.projection.pixels(ends.reshape(-1, 3)).reshape(-1, 2, 2)
    longest = int(np.argmax(np.linalg.norm(pixels[:, 0] - pixels[:, 1], axis=1)))
    x, y = pixels[longest].mean(axis=0) / driver.window.viewport.devicePixelRatioF()
    return tuple(edges[longest].tolist()), QPoint(round(x), round(y))


def test_a_click_shows_the_card_and_marks_the_neighbours(driver, picked):
    inspection, scene = driver.window.inspection, driver.scene
    node = int(scene.ellipses.node_of_row[scene.picked])
    text = inspection.inspect_panel.splat.text()
    assert f"Row {scene.picked:,}" in text and f"{scene.surface.graph.degrees[node]} graph neighbour" in text
    near = scene.ellipses.rows[inspection.inspected.comparison.first]
    tints = driver.window.view.viewport.splats.deformed.tints
    assert (tints[near, :3] == FIRST_COLOR).all()
    assert np.count_nonzero(tints[:, 3]) == len(near) + 1


def test_two_answers_beside_each_other_are_counted(driver, picked):
    inspection, scene = driver.window.inspection, driver.scene
    panel = inspection.inspect_panel
    panel.other.setCurrentIndex(panel.other.findData("euclidean"))
    panel.k.setValue(25)
    both = inspection.inspected.comparison
    node, surface = int(scene.ellipses.node_of_row[scene.picked]), scene.surface
    expected = neighbor_set("euclidean", node, scene.ellipses, surface.graph, surface.neighborhoods, k=25)
    np.testing.assert_array_equal(both.second, expected)
    assert f"25 by space, {len(both.only_second)} by it alone" in panel.counts.text()
    tints = driver.window.view.viewport.splats.deformed.tints
    assert (tints[scene.ellipses.rows[both.only_second], :3] == SECOND_COLOR).all()


def test_a_click_on_a_line_shows_the_edge_with_both_offsets(driver, picked):
    inspection = driver.window.inspection
    _, pixel = middle_of_longest_line(driver)
    driver.click(pixel)
    assert inspection.inspected.edge is not None
    text = inspection.inspect_panel.edge.text()
    assert "Edge" in text and "δ" in text and "Touch scale" in text
    assert driver.scene.picked in inspection.inspected.edge


def test_at_another_gap_the_graph_made_with_it_decides(driver, picked, qtbot):
    inspection = driver.window.inspection
    rows, _ = middle_of_longest_line(driver)
    inspection.inspected.pick_edge(rows)
    inspection.inspect_panel.epsilon.setValue(2.0)
    qtbot.waitUntil(lambda: inspection.edge_preview.graph is not None, timeout=WAIT_MS)
    assert "in the graph" in inspection.inspect_panel.verdict.text()


def test_escape_lets_go_of_the_edge_and_then_of_the_splat(driver, picked):
    inspected = driver.window.inspection.inspected
    inspected.pick_edge(middle_of_longest_line(driver)[0])
    driver.key(Qt.Key.Key_Escape)
    assert inspected.edge is None and driver.scene.picked is not None
    driver.key(Qt.Key.Key_Escape)
    assert driver.scene.picked is None
    assert driver.window.view.viewport.splats.deformed.tints is None


def test_another_tool_takes_the_marks_away_and_a_drag_orbits(driver, picked):
    view = driver.window.view.viewport.camera.view
    start = driver.surface_pixel()
    driver.drag(start, start + QPoint(40, 10), start + QPoint(80, 20))
    assert not np.allclose(driver.window.view.viewport.camera.view.position, view.position)
    assert driver.scene.picked is not None
    driver.key(Qt.Key.Key_Q)
    assert driver.window.view.viewport.splats.deformed.tints is None


def test_distance_along_the_surface_counts_from_the_picked_splat(driver, picked, qtbot):
    quantities = driver.window.inspection.quantities
    quantities.set(name="geodesic")
    qtbot.waitUntil(lambda: quantities.shown is not None, timeout=WAIT_MS)
    assert quantities.shown.values[driver.scene.picked] == 0.0


def test_the_card_opens_where_it_can_be_seen(driver):
    panel, scroll = driver.window.inspection.inspect_panel, driver.window.dock.widget()
    driver.key(Qt.Key.Key_I)
    scroll.verticalScrollBar().setValue(0)
    driver.click(driver.surface_pixel())

    def is_seen():
        top = panel.splat.mapTo(scroll.viewport(), QPoint(0, 0)).y()
        return panel.splat.text() and top >= 0 and top + panel.splat.height() <= scroll.viewport().height()

    driver.qtbot.waitUntil(is_seen, timeout=WAIT_MS)
