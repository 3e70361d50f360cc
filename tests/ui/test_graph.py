"""The splat graph in the real window: edges in view, preview of options, components, mends."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from scipy.spatial.transform import Rotation

from splap_editor.core.graph.splat_graph import GraphOptions, splat_graph
from splap_editor.core.surface.fragments import fragments
from splap_editor.io.recipe import read_recipe
from splap_editor.io.sample_maker import write_sample
from splap_editor.session.cards import has_edge
from splap_editor.session.edit_file import write_edit
from splap_editor.ui.widgets.number_field import NumberField
from tests.core.splat_scenes import joined, moved, sheet

WAIT_MS = 60_000


def lines(driver):
    return driver.window.view.viewport.splats.edges


def wait_remade(driver, surface) -> None:
    driver.qtbot.waitUntil(lambda: driver.scene.surface is not surface, timeout=WAIT_MS)
    driver.wait_idle()


def select(driver, rows) -> None:
    mask = np.zeros(driver.scene.splats.n_splats, bool)
    mask[rows] = True
    driver.session.steps.change_mask("selection", mask, "Select")


def halves(driver) -> tuple[np.ndarray, np.ndarray]:
    means = np.asarray(driver.scene.splats.means)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    low = means[:, axis] < np.median(means[:, axis])
    return np.flatnonzero(low), np.flatnonzero(~low)


@pytest.fixture
def inspected_edge(driver) -> None:
    """Inspect a splat and the edge to its nearest neighbour."""
    driver.key(Qt.Key.Key_I)
    driver.click(driver.surface_pixel())
    inspected = driver.window.inspection.inspected
    inspected.pick_edge(tuple(inspected.neighbor_edges()[0].tolist()))


def test_a_key_draws_no_edges_near_ones_and_all(driver):
    view, scene = driver.window.inspection.graph_view, driver.scene
    select(driver, [int(scene.ellipses.rows[500])])
    driver.key(Qt.Key.Key_J)
    driver.qtbot.waitUntil(lambda: lines(driver).n_edges > 0, timeout=WAIT_MS)
    n_near = lines(driver).n_edges
    assert n_near >= scene.surface.graph.degrees[500] and driver.window.actions_["graph.near"].isChecked()
    driver.key(Qt.Key.Key_J)
    assert lines(driver).n_edges == scene.surface.graph.n_edges == view.n_shown > n_near
    assert f"{view.n_shown:,} in view" in driver.window.inspection.graph_panel.counts.text()
    driver.key(Qt.Key.Key_J)
    assert lines(driver).n_edges == 0


def test_more_steps_draw_more_and_hidden_splats_have_no_edges(driver):
    inspection, scene = driver.window.inspection, driver.scene
    row = int(scene.ellipses.rows[500])
    select(driver, [row])
    inspection.graph_view.set(shown="near", hops=1)
    driver.qtbot.waitUntil(lambda: lines(driver).n_edges == scene.surface.graph.degrees[500], timeout=WAIT_MS)
    inspection.graph_view.set(hops=3)
    assert lines(driver).n_edges > scene.surface.graph.degrees[500]
    inspection.graph_view.set(shown="all")
    driver.window.actions_["select.hide"].trigger()
    assert lines(driver).n_edges == scene.surface.graph.n_edges - scene.surface.graph.degrees[500]


@pytest.mark.parametrize("color", ["offset", "component"])
def test_edges_change_their_colours(driver, color):
    view = driver.window.inspection.graph_view
    view.set(shown="all")
    driver.qtbot.waitUntil(lambda: view.colored is not None, timeout=WAIT_MS)
    before = view.colored.colors
    view.set(color=color)
    driver.qtbot.waitUntil(lambda: view.colored.color == color, timeout=WAIT_MS)
    assert not np.array_equal(view.colored.colors, before)
    np.testing.assert_array_equal(lines(driver).colors, view.colored.colors)


def test_x_cuts_the_inspected_edge_and_undo_puts_it_back(driver, inspected_edge):
    scene, surface = driver.scene, driver.scene.surface
    rows = driver.window.inspection.inspected.edge
    driver.key(Qt.Key.Key_X)
    assert scene.edit.graph.cut == (tuple(sorted(rows)),)
    wait_remade(driver, surface)
    assert not has_edge(scene.ellipses, scene.surface.graph, rows)
    assert "graph" not in scene.surface.timings_s, "no search for edges"
    assert driver.window.inspection.inspect_panel.toggle.text() == "Join the two"
    mended = scene.surface
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    wait_remade(driver, mended)
    assert has_edge(scene.ellipses, scene.surface.graph, rows)


def test_the_cards_button_joins_what_it_cut(driver, inspected_edge):
    scene, surface = driver.scene, driver.scene.surface
    panel = driver.window.inspection.inspect_panel
    QTest.mouseClick(panel.toggle, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(10, 10))
    wait_remade(driver, surface)
    assert scene.edit.graph.cut
    surface = scene.surface
    QTest.mouseClick(panel.toggle, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(10, 10))
    wait_remade(driver, surface)
    assert scene.edit.graph == GraphOptions()


def test_selections_are_separated_and_joined_again_by_the_tools_and_the_edit_keeps_it(driver, tmp_path):
    scene, surface, tools = driver.scene, driver.scene.surface, driver.window.tools
    low, _ = halves(driver)
    driver.window.actions_["tool.separate"].trigger()
    select(driver, low)
    driver.key(Qt.Key.Key_Return)
    wait_remade(driver, surface)
    assert scene.surface.graph.components.max() == 1
    assert not driver.window.inspection.graph_panel.components.isHidden()
    cut = scene.surface
    driver.window.actions_["tool.join"].trigger()
    driver.key(Qt.Key.Key_Return)
    driver.qtbot.waitUntil(lambda: tools.chosen.found is not None, timeout=WAIT_MS)
    assert "Return joins" in tools.context.hud.text
    driver.key(Qt.Key.Key_BracketRight)
    driver.qtbot.waitUntil(lambda: tools.chosen.found is not None, timeout=WAIT_MS)
    driver.key(Qt.Key.Key_Return)
    wait_remade(driver, cut)
    assert scene.surface.graph.components.max() == 0
    path = tmp_path / "edit.json"
    write_edit(path, driver.scene)
    kept = read_recipe(path).options[GraphOptions]
    assert (kept.cut, kept.join) == (scene.edit.graph.cut, scene.edit.graph.join) and len(kept.join) == 1
    driver.window.actions_["graph.clear_mends"].trigger()
    driver.qtbot.waitUntil(lambda: scene.surface.options == GraphOptions(), timeout=WAIT_MS)
    assert scene.surface.graph.n_edges == surface.graph.n_edges
    driver.wait_idle()


def test_fragments_are_listed_looked_at_and_joined_in_one_step(driver, tmp_path):
    piece = moved(sheet(16, size=0.13, seed=2), Rotation.identity(), 1.0, np.array([1.16, 0.4, 0.0]))
    floating = moved(sheet(9, size=0.1, seed=3), Rotation.identity(), 1.0, np.array([0.5, 0.5, 0.6]))
    write_sample(tmp_path / "pieces.ply", joined(sheet(900, seed=1), piece, floating))
    driver.open(tmp_path / "pieces.ply")
    driver.wait_idle()
    scene, inspection = driver.scene, driver.window.inspection
    n = len(fragments(scene.surface.graph))
    assert n == 2
    view = driver.window.view.viewport.camera.view
    listed = inspection.graph_panel.components
    listed.itemClicked.emit(listed.item(1))
    driver.qtbot.waitUntil(lambda: driver.window.view.viewport.camera.view != view, timeout=WAIT_MS)
    assert scene.surface.graph.components[scene.ellipses.node_of_row[scene.picked]] == 1
    surface = scene.surface
    driver.window.actions_["graph.join_fragments"].trigger()
    said = driver.window.toast.text
    assert said.startswith("Joined 1 fragment by") and "Left on purpose: 1 too far from everything" in said
    assert "2 pieces are left" in said
    wait_remade(driver, surface)
    assert len(fragments(scene.surface.graph)) == 1 and driver.session.history.undo_label == "Join fragments"


def test_another_gap_is_previewed_and_changes_nothing_before_apply(driver):
    panel, scene, surface = driver.window.inspection.graph_panel, driver.scene, driver.scene.surface
    panel.rule.findChild(NumberField, "epsilon").setValue(0.05)
    preview = driver.window.inspection.preview
    driver.qtbot.waitUntil(lambda: preview.graph is not None, timeout=WAIT_MS)
    expected = splat_graph(scene.ellipses, GraphOptions(epsilon=0.0005)).n_edges
    assert f"{expected:,} edges" in panel.estimate.text()
    assert scene.edit.graph == GraphOptions() and scene.surface is surface
    panel.apply.click()
    wait_remade(driver, surface)
    assert scene.edit.graph.epsilon == 0.0005 and scene.surface.graph.n_edges == expected
    assert driver.session.history.undo_label == "Change graph"
    assert panel.estimate.isHidden()


def test_the_newest_preview_wins(driver):
    panel, preview = driver.window.inspection.graph_panel, driver.window.inspection.preview
    for percent in (0.3, 0.2, 0.1):
        panel.rule.findChild(NumberField, "epsilon").setValue(percent)
    driver.qtbot.waitUntil(lambda: preview.graph is not None, timeout=WAIT_MS)
    assert preview.wanted.epsilon == pytest.approx(0.001)
    panel.revert.click()
    assert panel.rule.findChild(NumberField, "epsilon").value() == 0.5 and preview.wanted is None
