"""SpLap Editor: surface-aware Laplacian deformation of captured Gaussian splats.

``import splap_editor as splap`` gives scripts the names below; each is imported when it is first used.
"""

import os

# Small dense BLAS calls run 3-5 times slower with BLAS threads; numpy reads this when it is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"

__all__ = [
    "AdaptationOptions",
    "ArapOptions",
    "BbwOptions",
    "Edit",
    "GraphOptions",
    "Handle",
    "Pin",
    "Pose",
    "ReachOptions",
    "StageCache",
    "bind",
    "deform",
    "prepare",
    "read_edit",
    "read_ply",
    "write_edit",
    "write_ply",
]

TYPE_CHECKING = False
if TYPE_CHECKING:
    from splap_editor.core.adaptation.options import AdaptationOptions
    from splap_editor.core.arap.options import ArapOptions
    from splap_editor.core.bbw.options import BbwOptions
    from splap_editor.core.graph.options import GraphOptions
    from splap_editor.core.pose import Pose
    from splap_editor.core.reach_options import ReachOptions
    from splap_editor.engine.bound_edit import bind
    from splap_editor.engine.cache import StageCache
    from splap_editor.engine.scripting import deform, prepare
    from splap_editor.io.ply import read_ply, write_ply
    from splap_editor.io.recipe import read_recipe as read_edit
    from splap_editor.io.recipe import write_recipe as write_edit
    from splap_editor.io.recipe_specs import HandleSpec as Handle
    from splap_editor.io.recipe_specs import PinSpec as Pin
    from splap_editor.io.recipe_specs import Recipe as Edit

_PLACES = {
    "AdaptationOptions": "core.adaptation.options",
    "ArapOptions": "core.arap.options",
    "BbwOptions": "core.bbw.options",
    "Edit": "io.recipe_specs:Recipe",
    "GraphOptions": "core.graph.options",
    "Handle": "io.recipe_specs:HandleSpec",
    "Pin": "io.recipe_specs:PinSpec",
    "Pose": "core.pose",
    "ReachOptions": "core.reach_options",
    "StageCache": "engine.cache",
    "bind": "engine.bound_edit",
    "deform": "engine.scripting",
    "prepare": "engine.scripting",
    "read_edit": "io.recipe:read_recipe",
    "read_ply": "io.ply",
    "write_edit": "io.recipe:write_recipe",
    "write_ply": "io.ply",
}


def __getattr__(name: str) -> object:
    """Import one of `__all__` when it is first used."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module, _, held = _PLACES[name].partition(":")
    found = globals()[name] = getattr(import_module(f"{__name__}.{module}"), held or name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
