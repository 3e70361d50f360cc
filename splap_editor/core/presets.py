"""Options that belong together, by one name: a row here is known to recipes, their schema and the window."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.options import Choice, OptionSet


@dataclass(frozen=True)
class Preset(Choice):
    """One name for some options.

    Parameters
    ----------
    changes : mapping of type to mapping of str to object
        Values of options by name, by their group.
    """

    changes: Mapping[type, Mapping[str, Any]] = field(default_factory=dict)


PRESETS = {
    "paper": Preset(
        "As in the paper",
        "The published method: its rule and Laplacian, ten plain iterations or linear blending, its own adaptation.",
        changes={
            GraphOptions: {
                "rule": "paper",
                "carriers": "all",
                "k": 30,
                "neighborhood": "geodesic",
                "laplacian": "robust",
            },
            ArapOptions: {"kind": "local-global", "iterations": 10},
            BbwOptions: {"blending": "linear"},
            AdaptationOptions: {"adaptation": "paper"},
        },
    ),
}


def with_preset(options: OptionSet, name: str) -> OptionSet:
    """Set what a preset names; mends and all other options stay as they are.

    Raises
    ------
    ValueError
        There is no such preset.
    """
    if name not in PRESETS:
        raise ValueError(f"preset must be one of {', '.join(PRESETS)}, got {name!r}")
    return options.with_groups(
        *(replace(options[group], **changes) for group, changes in PRESETS[name].changes.items())
    )
