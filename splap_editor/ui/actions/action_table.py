"""Every action of the program as data: menus, toolbars, tooltips, shortcuts and the help sheet read this one table."""

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.edit_table import EDIT_TABLE
from splap_editor.ui.actions.file_table import FILE_TABLE
from splap_editor.ui.actions.graph_table import GRAPH_TABLE
from splap_editor.ui.actions.help_table import HELP_TABLE
from splap_editor.ui.actions.place_actions import PLACE_TABLE
from splap_editor.ui.actions.removal_table import REMOVAL_TABLE
from splap_editor.ui.actions.tool_actions import TOOL_TABLE
from splap_editor.ui.actions.view_table import VIEW_TABLE

ACTIONS: tuple[ActionSpec, ...] = (
    *FILE_TABLE,
    *EDIT_TABLE,
    *REMOVAL_TABLE,
    *PLACE_TABLE,
    *VIEW_TABLE,
    *TOOL_TABLE,
    *GRAPH_TABLE,
    *HELP_TABLE,
)

MENUS = ("&File", "&Edit", "&Select", "Ha&ndle", "Ani&mation", "&Tools", "G&raph", "&View", "He&lp")
"""Their mnemonics keep clear of the letters that are shortcuts with Alt: A, G, H, P, Z."""
