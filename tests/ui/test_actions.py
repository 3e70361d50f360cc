"""The action table is complete and free of contradictions."""

from PySide6.QtGui import QKeySequence

from splap_editor.resources import resource
from splap_editor.ui.actions.action_table import ACTIONS, MENUS
from splap_editor.ui.dialogs.help_sheet import HelpSheet


def test_ids_and_shortcuts_are_given_once():
    ids = [spec.action_id for spec in ACTIONS]
    assert len(set(ids)) == len(ids)
    keys = [QKeySequence(keys).toString() for spec in ACTIONS for keys in spec.shortcuts]
    assert all(keys), "every shortcut is one that Qt reads"
    assert len(set(keys)) == len(keys)


def test_every_action_has_a_tip_its_icon_and_a_menu():
    for spec in ACTIONS:
        assert spec.tip.endswith("."), spec.action_id
        assert spec.menu.split("/")[0] in MENUS, spec.action_id
        if spec.icon:
            assert resource("icons", f"{spec.icon}.svg").is_file()


def test_conditions_decide_what_can_be_used(driver):
    actions = driver.window.actions_
    assert actions["file.export"].isEnabled()
    assert not actions["handle.delete"].isEnabled()
    actions["select.all"].trigger()
    assert actions["select.grow"].isEnabled()
    assert actions["edit.undo"].isEnabled()
    assert actions["edit.undo"].text() == "&Undo select all"


def test_help_sheet_names_every_shortcut(driver, qtbot):
    sheet = HelpSheet(ACTIONS, driver.window)
    qtbot.addWidget(sheet)
    from PySide6.QtWidgets import QLabel

    texts = {label.text() for label in sheet.findChildren(QLabel)}
    assert {spec.label for spec in ACTIONS if spec.shortcuts} <= texts
    sheet.close()


def test_every_selection_command_is_undone_by_undo(driver):
    actions, scene = driver.window.actions_, driver.scene
    scene.selection[:40] = True
    for name in ("invert", "grow", "shrink", "connected", "none", "all"):
        before = scene.selection.copy()
        actions[f"select.{name}"].trigger()
        assert (scene.selection != before).any(), name
        actions["edit.undo"].trigger()
        assert (scene.selection == before).all(), name
        scene.set_selection(scene.selection.copy())


def test_hide_isolate_and_show_all_change_what_is_drawn(driver):
    actions, scene = driver.window.actions_, driver.scene
    selection = scene.selection.copy()
    selection[:100] = True
    driver.session.steps.change_mask("selection", selection, "Select")
    actions["select.isolate"].trigger()
    assert scene.hidden.sum() == scene.splats.n_splats - 100
    actions["select.show_all"].trigger()
    assert not scene.hidden.any()
    actions["edit.undo"].trigger()
    assert scene.hidden.any()
