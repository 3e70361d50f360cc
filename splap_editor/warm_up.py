"""Compiles every loop of the engine into the cache on disk, in a process of its own.

Compiling holds Python's lock for half a minute in all; done here, the window of another process stays alive
meanwhile. Two processes may do it at once: entries are written whole or not at all.
"""

import subprocess
import sys
from pathlib import Path

import numba
import numpy as np

import splap_editor
from splap_editor.core.adaptation.kernel_adaptation import adapted_splats
from splap_editor.core.deformers import method_titles
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import OptionSet
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.splats.spherical_harmonics import view_colors
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.bound_edit import bind, ready_for_drags
from splap_editor.engine.cache import default_cache_folder
from splap_editor.engine.edit import Edit, Handle, Pose
from splap_editor.engine.surface import surface_of

PARTS = ("view", "engine")
"""What is compiled side by side; the first is enough to show a scene."""


def is_warm(part: str = "engine") -> bool:
    """Whether the loops of a part, for this state of the program, this Python and compiler, have been compiled."""
    return _stamp(part).exists()


def warm_up(part: str) -> None:
    """Compile the loops of a part, so that they are kept for every process to come."""
    load_view_loops() if part == "view" else _warm_engine()
    _stamp(part).parent.mkdir(parents=True, exist_ok=True)
    _stamp(part).touch()


def _warm_engine() -> None:
    """Run every stage on a sheet of splats."""
    splats = _sheet()
    surface = surface_of(splats, GraphOptions())
    surface_of(splats, GraphOptions(rule="paper"))
    ready_for_drags(surface)
    center = surface.rest[0]
    handles = (Handle(1, "", "#ffffff", Region(center, 0.1), Pose((0.0, 0.0, 0.3), (0.9, 0.1, 0.2, 0.3))),)
    pins = (Region(surface.rest[-1], 0.1),)
    for method in method_titles():
        edit = Edit(handles, pins, method, OptionSet(ReachOptions(None)))
        bound = bind(surface, edit)
        bound.drag(edit)
        kernels = bound.pose().kernels
        # A drag that goes on from a settled pose takes another path.
        bound.drag(edit)
    adapted_splats(splats, kernels)


def load_view_loops() -> None:
    """Load what picks, sorts and colours from the cache, or compile it, so that its first use is quick."""
    splats = _sheet(4)
    _view(splats, splats.means)
    n = len(splats.means)
    view_colors(splats.sh0, splats.shN, np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros(3))


def warm_up_elsewhere() -> dict[str, subprocess.Popen]:
    """Start `warm_up` of each part in a process of its own; an exit code of 0 says that it is compiled."""
    command = [sys.executable, "-m", "splap_editor.warm_up"]
    return {part: subprocess.Popen([*command, part], stdin=subprocess.DEVNULL) for part in PARTS}


def _stamp(part: str) -> Path:
    """An empty file named after everything that the compiled loops depend on."""
    python = f"py{sys.version_info.major}.{sys.version_info.minor}"
    newest = max(int(path.stat().st_mtime) for path in Path(splap_editor.__file__).parent.rglob("*.py"))
    return default_cache_folder() / f"compiled-{part}-{splap_editor.__version__}-{newest}-{python}-{numba.__version__}"


def _sheet(n: int = 80) -> Splats:
    """A wavy sheet of n² overlapping splats, large enough for the coarse model of a drag."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n)))
    rng = np.random.default_rng(0)
    x, y = x + rng.normal(0, 0.1 / n, n * n), y + rng.normal(0, 0.1 / n, n * n)
    return Splats(
        means=np.stack([x, y, 0.1 * np.sin(3 * x)], 1).astype(np.float32),
        log_scales=np.full((n * n, 2), np.log(1.0 / n), np.float32),
        quats=np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (n * n, 1)),
        logit_opacities=np.full(n * n, 3.0, np.float32),
        sh0=np.zeros((n * n, 3), np.float32),
        shN=np.zeros((n * n, 15, 3), np.float32),
    )


def _view(splats: Splats, means: np.ndarray) -> None:
    """Compile what picks and sorts."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - registers the OpenGL implementations

    from splap_editor.viewport.depth_order import depth_order
    from splap_editor.viewport.glyphs import base_colors, splat_glyphs
    from splap_editor.viewport.picking import surface_hit
    from splap_editor.viewport.projection import Projection
    from splap_editor.viewport.regions import in_brush, in_lasso, in_rectangle, screen_points, visible_only
    from splap_editor.viewport.splat_actor import SplatActor

    depth_order(means, np.array([0.0, 0.0, -1.0], np.float32))
    actor = SplatActor(splat_glyphs(splats), base_colors(splats))
    view = np.eye(4)
    view[2, 3] = -3.0
    projection = Projection(view, np.diag([1.0, 1.0, -1.0, 1.0]), 64, 64)
    surface_hit(actor, projection, 32.0, 32.0)
    screen = screen_points(actor, projection)
    square = [(8.0, 8.0), (56.0, 8.0), (56.0, 56.0), (8.0, 56.0)]
    in_rectangle(screen, 8.0, 8.0, 56.0, 56.0)
    in_brush(screen, square, 4.0)
    visible_only(actor, projection, screen, in_lasso(screen, square))


if __name__ == "__main__":
    for name in sys.argv[1:] or PARTS:
        warm_up(name)
