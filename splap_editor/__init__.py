"""SpLap Editor: surface-aware Laplacian deformation of captured Gaussian splats.

``import splap_editor as splap`` gives scripts the names below; each is imported when it is first used.
"""

import os

# Small dense BLAS calls run 3-5 times slower with BLAS threads; numpy reads this when it is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"

__all__ = [
    "Edit",
    "Handle",
    "Pin",
    "Pose",
    "bind",
    "deform",
    "options",
    "prepare",
    "read_ply",
    "write_ply",
]

TYPE_CHECKING = False
if TYPE_CHECKING:
    from splap_editor import options
    from splap_editor.core.pose import Pose
    from splap_editor.engine.bound_edit import bind
    from splap_editor.engine.scripting import deform, prepare
    from splap_editor.io.plain_edit import Edit, Handle, Pin
    from splap_editor.io.ply import read_ply, write_ply
    from splap_editor.io.recipe import read_recipe as read_recipe
    from splap_editor.io.recipe import write_recipe as write_recipe

# A script that keeps its edits finds the recipe's functions here too.
_PLACES = {
    "Edit": "io.plain_edit",
    "Handle": "io.plain_edit",
    "Pin": "io.plain_edit",
    "Pose": "core.pose",
    "bind": "engine.bound_edit",
    "deform": "engine.scripting",
    "options": "options",
    "prepare": "engine.scripting",
    "read_ply": "io.ply",
    "read_recipe": "io.recipe",
    "write_ply": "io.ply",
    "write_recipe": "io.recipe",
}


def __getattr__(name: str) -> object:
    """Import a name when it is first used."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module = import_module(f"{__name__}.{_PLACES[name]}")
    found = globals()[name] = module if _PLACES[name] == name else getattr(module, name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
