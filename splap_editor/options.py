"""Option groups, for ``splap.Edit(options=[splap.options.GraphOptions(rule="paper")])``: one frozen dataclass each.

`GROUPS` holds all that an edit may have, by name, those of every deformer among them.
"""

from typing import TYPE_CHECKING

from splap_editor.core.graph.options import Joint, Separation
from splap_editor.io.recipe import recipe_groups

if TYPE_CHECKING:
    # For type checkers, which read no tables; at run time the groups come from `GROUPS`.
    from splap_editor.core.adaptation.options import AdaptationOptions as AdaptationOptions
    from splap_editor.core.adaptation.options import RepairOptions as RepairOptions
    from splap_editor.core.arap.options import ArapOptions as ArapOptions
    from splap_editor.core.bbw.options import BbwOptions as BbwOptions
    from splap_editor.core.graph.options import GraphOptions as GraphOptions
    from splap_editor.core.reach_options import ReachOptions as ReachOptions

GROUPS: dict[str, type] = {group.__name__: group for _, group in recipe_groups()}

globals().update(GROUPS)

__all__ = ["GROUPS", "Joint", "Separation", *sorted(GROUPS)]
