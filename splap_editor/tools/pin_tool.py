"""Placing pins on the surface."""

from dataclasses import dataclass

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.tools.bindings import Binding
from splap_editor.tools.disc_tool import RESIZE, DiscOptions, DiscTool


@dataclass(frozen=True)
class PinOptions(DiscOptions):
    """Size of the next pin."""


class PinTool(DiscTool):
    """A click holds the disc under the pointer where it is."""

    name = "pin"
    # What was placed last lies where the next click goes.
    mutes_gizmo = True
    option_kinds = (PinOptions,)
    bindings = (Binding(("Click",), DiscTool.place, "Pin it where it is", "pin it", on="the surface"), RESIZE)

    def take(self, region: Region, pose: Pose) -> None:
        """Hold splats at rest by a pin, and what has moved by a handle that keeps its pose."""
        if pose.is_identity:
            self.context.session.steps.add_pin(region, reach=self.radius_world)
        else:
            self.context.session.steps.add_held(region, pose)
