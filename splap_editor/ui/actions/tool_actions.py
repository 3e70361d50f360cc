"""Choosing the tool that the left button works with."""

from functools import partial

from splap_editor.tools.tool_manager import ToolManager
from splap_editor.tools.tool_table import TOOLS
from splap_editor.ui.actions.action_spec import ActionSpec


class ToolActions:
    """One action for each tool of the table."""

    def __init__(self, tools: ToolManager) -> None:
        self._tools = tools

    def choose(self, name: str) -> None:
        """Work with a tool from now on."""
        self._tools.choose(name)


TOOL_TABLE: tuple[ActionSpec, ...] = tuple(
    ActionSpec(
        f"tool.{entry.name}",
        partial(ToolActions.choose, name=entry.name),
        entry.text,
        (entry.key,) if entry.key else (),
        icon=entry.name,
        tip=entry.tip,
        menu="&Tools",
        group="tool",
        checkable=True,
        breaks=k > 0 and TOOLS[k - 1].group != entry.group,
    )
    for k, entry in enumerate(TOOLS)
)
