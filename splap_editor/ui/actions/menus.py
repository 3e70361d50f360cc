"""The menu bar, made from the action table."""

from PySide6.QtWidgets import QMenu, QMenuBar

from splap_editor.ui.actions.action_table import MENUS
from splap_editor.ui.actions.actions import ActionSet


def fill_menu_bar(bar: QMenuBar, actions: ActionSet) -> dict[str, QMenu]:
    """Put every action that names a menu into it; gives the menus by the names in the table."""
    menus: dict[str, QMenu] = {title: bar.addMenu(title) for title in MENUS}
    for spec in actions.specs:
        if not spec.menu:
            continue
        if spec.menu not in menus:
            parent, _, title = spec.menu.rpartition("/")
            if spec.breaks:
                menus[parent].addSeparator()
            menus[spec.menu] = menus[parent].addMenu(title)
        elif spec.breaks:
            menus[spec.menu].addSeparator()
        menus[spec.menu].addAction(actions[spec.action_id])
    return menus
