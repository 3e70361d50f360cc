"""Placing handles on the surface."""

from dataclasses import dataclass

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.tools.bindings import Binding
from splap_editor.tools.disc_tool import RESIZE, DiscOptions, DiscTool


@dataclass(frozen=True)
class HandleOptions(DiscOptions):
    """Size of the next handle."""


class HandleTool(DiscTool):
    """A click makes the disc under the pointer a handle."""

    name = "handle"
    option_kinds = (HandleOptions,)
    bindings = (Binding(("Click",), DiscTool.place, "Place a handle", "place a handle", on="the surface"), RESIZE)

    def take(self, region: Region, pose: Pose) -> None:
        """Add a handle where the splats are."""
        self.context.session.steps.add_handle(region, pose=pose)
