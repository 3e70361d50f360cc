"""Every tool that can be chosen: a module, a row here and an icon make one."""

from dataclasses import dataclass

from splap_editor.tools.axes_tool import AxesTool
from splap_editor.tools.ball_tool import BallTool
from splap_editor.tools.bindings import Binding
from splap_editor.tools.brush_tool import BrushTool
from splap_editor.tools.click_tool import ClickTool
from splap_editor.tools.crop_tool import CropTool
from splap_editor.tools.floaters_tool import FloatersTool
from splap_editor.tools.handle_tool import HandleTool
from splap_editor.tools.inspect_tool import InspectTool
from splap_editor.tools.join_tool import JoinTool
from splap_editor.tools.lasso_tool import LassoTool
from splap_editor.tools.level_tool import LevelTool
from splap_editor.tools.measure_tool import MeasureTool
from splap_editor.tools.navigate_tool import NavigateTool
from splap_editor.tools.pin_tool import PinTool
from splap_editor.tools.place_tool import PlaceTool
from splap_editor.tools.polygon_tool import PolygonTool
from splap_editor.tools.rectangle_tool import RectangleTool
from splap_editor.tools.separate_tool import SeparateTool
from splap_editor.tools.similar_tool import SimilarTool
from splap_editor.tools.tool import Tool, ToolContext
from splap_editor.tools.tool_manager import ToolManager
from splap_editor.tools.transform_tool import TransformTool


@dataclass(frozen=True)
class ToolEntry:
    """One tool as menus, tool column and help know it.

    Parameters
    ----------
    kind : type of Tool
    text : str
        As in the menu, with a mnemonic.
    key : str
        Shortcut, or empty.
    tip : str
        One sentence. The icon in ``resources/icons`` has the tool's name.
    group : str
        Tools of a group stand together, and share a block of the help sheet.
    """

    kind: type[Tool]
    text: str
    key: str
    tip: str
    group: str

    @property
    def name(self) -> str:
        """Name of the tool."""
        return self.kind.name

    @property
    def title(self) -> str:
        """The text without its mnemonic."""
        return self.text.replace("&", "")


TOOLS: tuple[ToolEntry, ...] = (
    ToolEntry(RectangleTool, "&Rectangle", "Q", "Drag a frame to select splats, or click them.", "Select"),
    ToolEntry(LassoTool, "&Lasso", "K", "Draw round splats to select them.", "Select"),
    ToolEntry(BrushTool, "&Brush", "C", "Paint a selection.", "Select"),
    ToolEntry(PolygonTool, "Pol&ygon", "Shift+K", "Click corners round splats to select them.", "Select"),
    ToolEntry(BallTool, "B&all", "Shift+C", "Drag a ball out of the surface to select what is in it.", "Select"),
    ToolEntry(SimilarTool, "Si&milar", "Shift+L", "Select splats like the one clicked, or flood from it.", "Select"),
    ToolEntry(ClickTool, "&Click", "Shift+Q", "Select splats one by one; a drag looks around.", "Select"),
    ToolEntry(HandleTool, "&Handle", "W", "Click the surface to place a handle.", "Place handles and pins"),
    ToolEntry(PinTool, "&Pin", "E", "Click the surface to hold it in place.", "Place handles and pins"),
    ToolEntry(CropTool, "Cr&op", "Shift+B", "Remove what is outside or inside of a box, sphere or plane.", "Clean up"),
    ToolEntry(FloatersTool, "&Floaters", "Shift+F", "Find haze, clumps and specks, and remove them.", "Clean up"),
    ToolEntry(PlaceTool, "Plac&e", "T", "Move, turn and scale the whole object.", "Set upright"),
    ToolEntry(LevelTool, "Le&vel", "Shift+T", "Click the floor that the object shall stand level on.", "Set upright"),
    ToolEntry(MeasureTool, "Meas&ure", "M", "Measure between two splats, and set a true size.", "Set upright"),
    ToolEntry(SeparateTool, "&Separate", "", "Draw over two parts to take them apart.", "Mend the surface"),
    ToolEntry(JoinTool, "&Join", "", "Draw across a gap to tie its two rims together.", "Mend the surface"),
    ToolEntry(InspectTool, "&Inspect", "I", "See a splat's card and neighbours, or an edge's.", "Inspect"),
)

FIRST = HandleTool.name
"""The tool in use at the start."""


def made_tools(context: ToolContext) -> ToolManager:
    """Make all tools, and whoever passes events to them."""
    navigation = NavigateTool(context)
    context.orbit = navigation.stroke
    standing = (AxesTool(context), TransformTool(context))
    return ToolManager(context, {entry.name: entry.kind(context) for entry in TOOLS}, standing, navigation, FIRST)


def bindings_by_group() -> dict[str, tuple[Binding, ...]]:
    """All rows that need telling, by the title they are told under; standing tools first."""
    groups: dict[str, tuple[Binding, ...]] = {
        "Look around": (*NavigateTool.bindings, *AxesTool.bindings),
        "Handles": (*TransformTool.bindings, *TransformTool.active_bindings),
    }
    for entry in TOOLS:
        groups[entry.group] = (*groups.get(entry.group, ()), *entry.kind.bindings)
    return {title: tuple(row for row in rows if row.sentence) for title, rows in groups.items()}
