"""The actions that remove splats from the scene and bring them back."""

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.conditions import (
    can_delete,
    has_removed,
    has_removed_selected,
    has_scene,
    has_selection,
)
from splap_editor.ui.actions.removal_actions import RemovalActions

A = ActionSpec

REMOVAL_TABLE: tuple[ActionSpec, ...] = (
    A(
        "edit.delete",
        RemovalActions.delete,
        "&Delete",
        ("Delete", "Backspace"),
        icon="trash",
        tip="Delete the chosen handles and pins; without any, the selected splats.",
        needs=can_delete,
        menu="&Edit",
        breaks=True,
    ),
    A(
        "remove.selected",
        RemovalActions.selected,
        "Delete selected &splats",
        ("X",),
        tip="Leave them out of surface, pictures and export; undo or restore brings them back.",
        needs=has_selection,
        menu="&Edit",
    ),
    A(
        "remove.others",
        RemovalActions.all_but_selected,
        "Keep &only selected",
        ("Shift+X",),
        tip="Remove everything else.",
        needs=has_selection,
        menu="&Edit",
    ),
    A(
        "remove.show",
        RemovalActions.show,
        "Sho&w removed",
        tip="Draw removed splats, tinted, so that they can be selected and restored.",
        needs=has_scene,
        menu="&Edit",
        checkable=True,
        breaks=True,
    ),
    A(
        "remove.restore_selected",
        RemovalActions.restore_selected,
        "R&estore selected",
        tip="Bring back the removed splats among the selected.",
        needs=has_removed_selected,
        menu="&Edit",
    ),
    A(
        "remove.restore_all",
        RemovalActions.restore_all,
        "Restore &all",
        tip="Bring back every removed splat.",
        needs=has_removed,
        menu="&Edit",
    ),
)
