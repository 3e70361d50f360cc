"""Front layer, rim and kept selections in the window's Select menu."""

import numpy as np


def test_the_front_layer_hides_the_back_and_narrows_a_selection(driver):
    actions, scene = driver.window.actions_, driver.scene
    actions["select.front"].trigger()
    front = scene.selection.copy()
    assert 0 < front.sum() < len(front)
    viewport = driver.window.view.viewport
    screen = viewport.screen_points()
    np.testing.assert_array_equal(front, viewport.visible_only(screen, np.isfinite(screen[:, 0])))
    half = np.arange(len(front)) % 2 == 0
    driver.session.steps.change_mask("selection", half, "Select")
    actions["select.front"].trigger()
    assert scene.selection.any() and not (scene.selection & ~half).any()


def test_the_rim_of_a_selection_is_a_part_of_it_and_one_step(driver):
    driver.wait_idle()
    x = np.asarray(driver.scene.splats.means[:, 0])
    driver.session.steps.change_mask("selection", x > np.median(x), "Select")
    before = driver.scene.selection.copy()
    driver.window.actions_["select.rim"].trigger()
    assert 0 < driver.scene.selection.sum() < before.sum() and not (driver.scene.selection & ~before).any()
    driver.session.history.undo()
    np.testing.assert_array_equal(driver.scene.selection, before)


def test_kept_selections_combine_from_their_menu(driver):
    scene, sets = driver.scene, driver.window.selection_sets
    low, high = np.arange(scene.splats.n_splats) < 200, np.arange(scene.splats.n_splats) >= 100
    driver.session.steps.change_mask("selection", low, "Select")
    sets.keep_as("Low")
    menus = {action.menu().title(): action.menu() for action in sets.actions() if action.menu() is not None}
    expected = {"&Add": high | low, "&Subtract": high & ~low, "&Intersect": high & low}
    for start, mask in expected.items():
        driver.session.steps.change_mask("selection", high, "Select")
        menu = next(menu for title, menu in menus.items() if title.startswith(start))
        (entry,) = menu.actions()
        entry.trigger()
        np.testing.assert_array_equal(scene.selection, mask)
