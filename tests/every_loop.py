"""Calls every compiled loop of the program with the types that it has there."""

from typing import Any

import numpy as np

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels, adapted_splats
from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.bbw.levels import Level, coarser_level
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.deformers import method_titles
from splap_editor.core.graph.ellipse_offset import normal_offsets, touch_scales
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import OptionSet
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.splats.floaters import floaters
from splap_editor.core.splats.spherical_harmonics import view_colors
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import geodesic_distances
from splap_editor.core.surface.separation import seam_between
from splap_editor.engine.bound_edit import bind, ready_for_drags
from splap_editor.engine.edit import Edit, Handle, Pin, Pose
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.ply_header import ply_header
from splap_editor.io.ply_lists import list_table
from tests.reference.ply import ply_bytes, splat_columns


def call_first_loops() -> None:
    """Call those that a first handle and its drag wait for: prepare, bind, drag, settle, and drag on."""
    _drag(surface_of(_sheet(), GraphOptions()), Edit().method)


def call_every_loop() -> None:
    """Run every stage on a sheet of splats, and look at it."""
    splats = _sheet()
    surface = surface_of(splats, GraphOptions())
    surface_of(splats, GraphOptions(rule="paper"))
    for method in method_titles():
        kernels = _drag(surface, method)
    adapted_splats(splats, kernels)
    floaters(splats, surface.ellipses).ties.pieces(np.ones(surface.ellipses.n_nodes, np.bool_))
    for method, options in CHOICES:
        bind(surface, _edit(surface, method, options)).pose()
    normal_offsets(surface.ellipses, surface.graph.edges[:4])
    touch_scales(surface.ellipses, surface.graph.edges[:4], 0.0)
    geodesic_distances(surface.graph, np.array([0]))
    seam_between(surface.graph, np.array([0]), np.array([len(surface.rest) - 1]))
    # Weights of a few thousand nodes are found without.
    n = len(surface.rest)
    coarser_level(Level(surface.rest, surface.L, surface.M, np.arange(n), np.zeros(0, np.int64)), np.zeros(n, np.bool_))
    _read_lists()
    _look(splats)


def _edit(surface: Surface, method: str, *options: Any) -> Edit:
    pose = Pose((0.0, 0.0, 0.3), (0.9, 0.1, 0.2, 0.3))
    handle = Handle(1, "", "#ffffff", Region(surface.rest[0], 0.1), pose)
    pin = Pin(1, "", Region(surface.rest[-1], 0.1))
    return Edit((handle,), (pin,), method, OptionSet(ReachOptions(None), *options))


def _drag(surface: Surface, method: str) -> AdaptedKernels:
    ready_for_drags(surface)
    edit = _edit(surface, method)
    bound = bind(surface, edit)
    bound.drag(edit)
    kernels = bound.pose().kernels
    # A drag that goes on from a settled pose takes another path.
    bound.drag(edit)
    assert kernels is not None
    return kernels


CHOICES = (
    ("arap", ArapOptions(kind="local-global", iterations=1)),
    ("arap", AdaptationOptions("affine")),
    ("arap", AdaptationOptions("none")),
    ("bbw", BbwOptions("linear")),
)
"""Options that lead to loops which the defaults do not call."""


def _read_lists() -> None:
    """Read a file whose rows differ in size."""
    columns = splat_columns(4, np.random.default_rng(0))
    data = ply_bytes(columns, after={"face": {"vertex_indices": [np.arange(3, dtype="i4")]}})
    header = ply_header(data, "faces.ply")
    list_table("faces.ply", header, np.frombuffer(data[len(header.raw) :], np.uint8).copy())


def _look(splats: Splats) -> None:
    """Draw, pick and select without a window."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - registers the OpenGL implementations
    from vtkmodules.vtkRenderingCore import vtkRenderer

    from splap_editor.core.splats.main_subject import main_subject
    from splap_editor.viewport.depth_order import depth_order
    from splap_editor.viewport.edge_lines import EdgeLines
    from splap_editor.viewport.frame_quality import FrameQuality
    from splap_editor.viewport.glyphs import base_colors, splat_glyphs
    from splap_editor.viewport.picking import surface_hit
    from splap_editor.viewport.projection import Projection
    from splap_editor.viewport.regions import in_brush, in_rectangle, screen_points, visible_only
    from splap_editor.viewport.splat_actor import SplatActor

    n = splats.n_splats
    view_colors(splats.sh0, splats.shN, np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros(3))
    depth_order(splats.means, np.array([0.0, 0.0, -1.0], np.float32))
    actor = SplatActor(splat_glyphs(splats), base_colors(splats), main_subject(splats.means, splats.opacities))
    actor.set_tints(np.zeros((n, 4), np.uint8))
    view = np.eye(4)
    view[2, 3] = -3.0
    projection = Projection(view, np.diag([1.0, 1.0, -1.0, 1.0]), 64, 64)
    surface_hit(actor, projection, 32.0, 32.0)
    screen = screen_points(actor, projection)
    in_brush(screen, [(8.0, 8.0), (56.0, 8.0)], 4.0)
    visible_only(actor, projection, screen, in_rectangle(screen, 8.0, 8.0, 56.0, 56.0))
    lines = EdgeLines(actor, vtkRenderer())
    lines.show([[0, 1], [1, 2]], (0, 0, 0))
    lines.refresh(projection, FrameQuality(0))


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
