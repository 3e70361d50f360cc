"""What a pose spoils is found, what it is meant to do is not: laws on sheets that are moved by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.bound_edit import Posed, bind
from splap_editor.engine.deformation_check import (
    DeformationCheck,
    deformation_check,
    joint_of,
    posed_check,
    separation_of,
)
from splap_editor.engine.edit import Edit, Handle, Pose
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from tests.core.splat_scenes import joined, moved, sheet, shuffled

N = 900
STEP = 1.0 / 30.0


def as_if_plain(surface: Surface) -> Surface:
    """The surface, with its mends taken for what the rule made of the splats."""
    plain = GraphOptions()
    return replace(surface, options=plain, stages=surface.stages._replace(options=plain, mends=plain))


def checked(surface: Surface, positions: np.ndarray) -> DeformationCheck:
    """Check of nodes moved to some positions, turned nowhere."""
    turns = np.broadcast_to(np.eye(3), (len(positions), 3, 3))
    deformation = Deformation(positions, turns)
    return deformation_check(surface, adapt_kernels(surface.binding, deformation), deformation)


def slit_rows(splats: Splats) -> tuple[tuple[int, int], ...]:
    """Edges of a sheet that cross its middle."""
    surface = surface_of(splats, GraphOptions())
    right = surface.rest[:, 0] > 0.5
    edges = surface.graph.edges
    crossing = edges[right[edges[:, 0]] != right[edges[:, 1]]]
    return tuple((int(a), int(b)) for a, b in surface.ellipses.rows[crossing])


@pytest.fixture(scope="module")
def slit() -> Surface:
    """A sheet whose halves do not hang together, though they touch."""
    splats = sheet(N)
    return surface_of(splats, GraphOptions(cut=slit_rows(splats)))


def opened(surface: Surface, gap: float) -> np.ndarray:
    """The right half moved away."""
    return surface.rest + np.where(surface.rest[:, :1] > 0.5, [gap, 0.0, 0.0], 0.0)


def leaves(*, gap: float = 1.6 * STEP, n_contacts: int = 3) -> tuple[Surface, np.ndarray]:
    """One sheet over another, tied to it by a few contacts; which nodes are of the upper one."""
    splats = joined(sheet(N), sheet(N, height=gap, seed=1))
    plain = surface_of(splats, GraphOptions())
    upper = plain.rest[:, 2] > 0.5 * gap
    ends = []
    for part in (upper, ~upper):
        nodes = np.flatnonzero(part)
        ends.append(nodes[np.argsort(np.linalg.norm(plain.rest[nodes, :2] - 0.5, axis=1))[:n_contacts]])
    rows = plain.ellipses.rows
    pairs = tuple((int(rows[a]), int(rows[b])) for a, b in zip(*ends, strict=True))
    return surface_of(splats, GraphOptions(add=pairs), near=plain), upper


def lifted(surface: Surface, upper: np.ndarray, height: float) -> np.ndarray:
    """The upper sheet lifted, but for what lies within two steps of the contacts, which is held back half the way."""
    near = np.exp(-np.square(np.linalg.norm(surface.rest[:, :2] - 0.5, axis=1) / (2.0 * STEP)))
    rise = height * np.where(upper, 1.0 - 0.4 * near, 0.4 * near)
    return surface.rest + rise[:, None] * [0.0, 0.0, 1.0]


def test_a_slit_that_opens_is_one_tear_with_a_side_on_either_half(slit):
    check = checked(as_if_plain(slit), opened(slit, 0.05))
    (tear,) = check.places
    means = slit.binding.splats.means
    assert tear.kind == "tear" and str(check) == "1 tear"
    assert np.all(np.abs(means[tear.rows, 0] - 0.5) < 2.5 * STEP)
    assert np.ptp(means[tear.rows, 1]) > 0.8
    assert (means[tear.a_rows, 0] > 0.5).all() and (means[tear.b_rows, 0] < 0.5).all()
    assert 0.02 < tear.size < 0.06
    assert np.linalg.norm(means[tear.rows] - tear.center, axis=1).max() < tear.radius + 0.05


def test_the_cure_of_a_tear_ties_both_halves(slit):
    (tear,) = checked(as_if_plain(slit), opened(slit, 0.05)).places
    splats = slit.binding.splats
    mended = surface_of(splats, replace(slit.options, join=(joint_of(tear),)))
    assert slit.graph.components.max() == 1
    assert mended.graph.components.max() == 0
    assert not checked(mended, opened(slit, 0.05)).places


def test_what_was_cut_by_hand_may_come_apart(slit):
    assert not checked(slit, opened(slit, 0.05)).places


def test_what_tore_is_told_wherever_else_it_hangs_together():
    splats = sheet(N)
    y = splats.means[:, 1]
    far = tuple((a, b) for a, b in slit_rows(splats) if max(y[a], y[b]) > 0.15)
    surface = as_if_plain(surface_of(splats, GraphOptions(cut=far)))
    assert surface.graph.components.max() == 0
    for hinge in (0.2, 0.5):
        torn = surface.rest[:, 1:2] > hinge
        (tear,) = checked(surface, np.where(torn, opened(surface, 0.05), surface.rest)).places
        assert tear.kind == "tear"


def test_one_surface_lifted_off_another_that_it_rests_on_is_no_tear():
    surface = surface_of(joined(sheet(N), sheet(N, height=0.3 * STEP, seed=1)), GraphOptions())
    upper = surface.rest[:, 2] > 0.15 * STEP
    assert surface.graph.components.max() == 1
    rise = np.where(upper, 0.3 * np.maximum(surface.rest[:, 1] - 0.2, 0.0), 0.0)
    assert not checked(surface, surface.rest + rise[:, None] * [0.0, 0.0, 1.0]).places


@pytest.mark.parametrize("gap", [0.0, 0.004])
def test_a_gap_too_narrow_to_be_seen_is_not_told(slit, gap):
    assert not checked(as_if_plain(slit), opened(slit, gap)).places


def test_a_tear_that_nothing_shows_is_not_told(slit):
    splats = joined(slit.binding.splats, *(sheet(N, height=h, cover=12.0, seed=2) for h in (-0.2, 0.2)))
    surface = surface_of(splats, GraphOptions(cut=slit_rows_of_middle(splats)))
    between = np.abs(surface.rest[:, 2]) < 0.1
    positions = surface.rest + np.where(between[:, None], opened(surface, 0.05) - surface.rest, 0.0)
    kept = [place for place in checked(as_if_plain(surface), positions).places if place.kind == "tear"]
    bare = checked(as_if_plain(slit), opened(slit, 0.05)).places[0].severity
    assert sum(place.severity for place in kept) < 0.3 * bare


def slit_rows_of_middle(splats: Splats) -> tuple[tuple[int, int], ...]:
    middle = np.flatnonzero(np.abs(splats.means[:, 2]) < 0.1)
    return tuple((a, b) for a, b in slit_rows(splats) if a in middle and b in middle)


def test_contacts_between_two_leaves_are_one_web_and_its_cure_frees_them():
    surface, upper = leaves()
    check = checked(as_if_plain(surface), lifted(surface, upper, 0.3))
    webs = [place for place in check.places if place.kind == "web"]
    assert len(webs) == 1
    ends = {row for pair in surface.options.add for row in pair}
    assert ends & set(webs[0].rows.tolist())
    assert surface.graph.components.max() == 0
    freed = surface_of(surface.binding.splats, replace(surface.options, separate=(separation_of(webs[0]),)))
    assert freed.graph.components.max() == 1


def test_what_was_tied_by_hand_may_be_drawn_out():
    surface, upper = leaves()
    assert not [place for place in checked(surface, lifted(surface, upper, 0.3)).places if place.kind == "web"]


def test_leaves_that_rightly_part_are_no_tear():
    surface, upper = leaves(n_contacts=0)
    assert not checked(surface, surface.rest + np.where(upper[:, None], [0.0, 0.0, 0.3], 0.0)).places


@pytest.mark.parametrize("stretch", [1.3, 2.0])
def test_a_sheet_that_is_drawn_out_evenly_is_neither_torn_nor_a_web(stretch):
    surface = surface_of(sheet(N), GraphOptions())
    assert not checked(surface, surface.rest * [stretch, 1.0, 1.0]).places


def test_a_bent_and_a_rigidly_moved_sheet_are_whole():
    surface = surface_of(sheet(N), GraphOptions())
    angle = 2.0 * (surface.rest[:, 0] - 0.5)
    bent = np.column_stack([np.sin(angle), surface.rest[:, 1], np.cos(angle)])
    bent[:, [0, 2]] *= 0.5
    turned = Rotation.from_rotvec([0.3, 0.8, -0.2]).apply(surface.rest) + 3.0
    assert not checked(surface, bent).places
    assert not checked(surface, turned).places


def test_one_splat_drawn_out_is_a_spike():
    surface = surface_of(sheet(N), GraphOptions())
    node = int(np.argmin(np.linalg.norm(surface.rest[:, :2] - 0.5, axis=1)))
    deformation = Deformation(surface.rest, np.broadcast_to(np.eye(3), (surface.ellipses.n_nodes, 3, 3)))
    kernels = adapt_kernels(surface.binding, deformation)
    row = int(surface.ellipses.rows[node])
    kernels.axes_f32[row] *= 6.0
    (spike,) = deformation_check(surface, kernels, deformation).places
    assert spike.kind == "spike" and spike.rows.tolist() == [row] and not spike.b


def test_places_are_the_same_whatever_turns_scales_and_shuffles_the_scene(slit):
    splats = slit.binding.splats
    order = np.random.default_rng(3).permutation(splats.n_splats)
    rotation, scale = Rotation.from_rotvec([0.4, -0.7, 0.2]), 3.0
    other = shuffled(moved(splats, rotation, scale, np.array([1.0, 2.0, 3.0])), order)
    back = np.argsort(order)
    cut = tuple((int(back[a]), int(back[b])) for a, b in slit.options.cut)
    surface = as_if_plain(surface_of(other, GraphOptions(cut=cut)))
    is_right = splats.means[order[surface.ellipses.rows], :1] > 0.5
    moves = np.where(is_right, scale * rotation.apply([0.05, 0.0, 0.0]), 0.0)
    (here,) = checked(as_if_plain(slit), opened(slit, 0.05)).places
    (there,) = checked(surface, surface.rest + moves).places
    assert set(order[there.rows].tolist()) == set(here.rows.tolist())
    assert there.size == pytest.approx(scale * here.size, rel=1e-4)
    # Pictures are taken from directions in the frame of the subject's box, which is the same but for its rounding.
    assert there.severity == pytest.approx(here.severity, rel=0.05)


def test_the_report_tells_each_place_with_a_cure_that_a_recipe_takes(slit):
    check = checked(as_if_plain(slit), opened(slit, 0.05))
    told = check.told
    assert (told["tears"], told["webs"], told["spikes"]) == (1, 0, 0)
    (place,) = told["places"]
    assert place["join"]["reach"] > 0.0 and len(place["join"]["a"]) == 16
    assert check.lines[0] == "check: 1 tear" and "came apart by up to" in check.lines[1]


def test_everyday_drags_of_a_trained_scene_are_silent():
    surface = surface_of(read_ply(resource("samples", "windmill_2dgs.ply")).splats, GraphOptions())
    rng, s = np.random.default_rng(23), surface.scene_scale
    for middle in surface.rest[rng.choice(len(surface.rest), 3, replace=False)]:
        rows = surface.ellipses.rows[np.linalg.norm(surface.rest - middle, axis=1) < 0.05 * s]
        move = rng.normal(size=3)
        move *= rng.uniform(0.02, 0.1) * s / np.linalg.norm(move)
        handle = Handle(1, "", "#ffffff", Region(middle, 0.0, rows), Pose(tuple(map(float, move))))
        posed = bind(surface, Edit((handle,)).with_options(surface.options)).pose()
        assert np.linalg.norm(posed.deformation.positions - surface.rest, axis=1).max() > 0.015 * s
        assert not posed_check(posed).places


def test_where_nothing_is_posed_nothing_is_spoilt():
    assert str(posed_check(Posed(sheet(16)))) == "nothing torn or drawn out"
