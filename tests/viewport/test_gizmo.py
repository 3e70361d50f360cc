import numpy as np
import pytest

from splap_editor.core.pose import SCALES, Pose
from splap_editor.viewport.camera import turn
from splap_editor.viewport.gizmo import Gizmo
from splap_editor.viewport.gizmo_parts import (
    ARROWS,
    DOT,
    PARTS,
    RING_RADIUS,
    RINGS,
    SCALE_BOX,
    SCALE_BOX_AT,
    SQUARE_FAR,
    SQUARE_NEAR,
    SQUARES,
    VIEW_RING,
    VIEW_RING_RADIUS,
    Act,
    Lock,
    line_of_sight,
)
from splap_editor.viewport.projection import Projection


def looking(is_parallel=False, position=(3.0, -4.0, 2.5)):
    position = np.array(position)
    back = position / np.linalg.norm(position)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = [right, np.cross(back, right), back]
    view[:3, 3] = -view[:3, :3] @ position
    near, far, zoom, aspect = 0.1, 100.0, 2.0, 1.5
    clip = np.zeros((4, 4))
    if is_parallel:
        clip[0, 0], clip[1, 1] = 0.5 / aspect, 0.5
        clip[2, 2:] = -2.0 / (far - near), -(far + near) / (far - near)
        clip[3, 3] = 1.0
    else:
        clip[0, 0], clip[1, 1] = zoom / aspect, zoom
        clip[2, 2:] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
        clip[3, 2] = -1.0
    return Projection(view, clip, 900, 600)


def frame_at(origin=(0.3, -0.2, 0.4), R=None):
    frame = np.eye(4)
    frame[:3, :3] = np.eye(3) if R is None else R
    frame[:3, 3] = origin
    return frame


@pytest.fixture(params=[False, True], ids=["perspective", "parallel"])
def projection(request):
    return looking(request.param)


@pytest.fixture(params=[False, True], ids=["world", "local"])
def gizmo(request):
    gizmo = Gizmo(is_local=request.param)
    gizmo.attach(frame_at(R=turn([1.0, 2.0, 0.5], 0.6)))
    return gizmo


def moved(delta, point):
    return delta[:3, :3] @ point + delta[:3, 3]


def drag(gizmo, part, projection, start, end, **how):
    gizmo.begin(part, projection, *start)
    return gizmo.move(*end, **how)


@pytest.mark.parametrize("part", ARROWS)
def test_grabbed_point_of_an_arrow_follows_the_cursor_along_it(gizmo, projection, part):
    axis = gizmo.axes[:, part.axis]
    grabbed = gizmo.frame[:3, 3] + 0.3 * axis
    goal = grabbed + 0.7 * axis
    delta = drag(gizmo, part, projection, projection.pixel(grabbed), projection.pixel(goal))
    np.testing.assert_allclose(moved(delta, grabbed), goal, atol=1e-9)
    np.testing.assert_allclose(delta[:3, :3], np.eye(3))
    assert gizmo.amount == pytest.approx(0.7)


@pytest.mark.parametrize("part", ARROWS)
def test_arrow_never_leaves_its_axis(gizmo, projection, part):
    delta = drag(gizmo, part, projection, (450.0, 300.0), (610.0, 120.0))
    assert np.linalg.norm(np.cross(delta[:3, 3], gizmo.axes[:, part.axis])) < 1e-9


@pytest.mark.parametrize("is_parallel", [False, True], ids=["perspective", "parallel"])
@pytest.mark.parametrize("part", [*SQUARES, DOT])
def test_grabbed_point_of_a_plane_stays_under_the_cursor(gizmo, is_parallel, part):
    # A square is grabbed where it is seen from the front, which no one view does with all three.
    across, along = gizmo.axes[:, max(part.axis, 0)], gizmo.axes[:, (max(part.axis, 0) + 1) % 3]
    projection = looking(is_parallel, position=4.0 * (across + 0.5 * along))
    assert gizmo.is_part_shown(part, projection)
    normal = projection.direction if part == DOT else across
    start = projection.pixel(gizmo.frame[:3, 3]) + np.array([4.0, -3.0])
    grabbed = projection.on_plane(*start, gizmo.frame[:3, 3], normal)
    delta = drag(gizmo, part, projection, start, start + np.array([60.0, 45.0]))
    np.testing.assert_allclose(projection.pixel(moved(delta, grabbed)), start + np.array([60.0, 45.0]), atol=1e-6)
    assert abs(delta[:3, 3] @ normal) < 1e-9


@pytest.mark.parametrize("is_parallel", [False, True], ids=["perspective", "parallel"])
@pytest.mark.parametrize("part", [*RINGS, VIEW_RING])
def test_grabbed_direction_of_a_ring_follows_the_cursor(gizmo, is_parallel, part):
    # A ring seen edge on turns by the way along it instead: each is looked at from its front.
    origin, front = gizmo.frame[:3, 3], gizmo.axes[:, max(part.axis, 0)]
    projection = looking(is_parallel, position=4.0 * (front + 0.5 * gizmo.axes[:, (part.axis + 1) % 3]))
    axis = line_of_sight(projection, origin) if part == VIEW_RING else front
    arm = np.cross(axis, [0.3, 0.5, -0.7])
    grabbed, goal = origin + 0.2 * arm, origin + 0.2 * turn(axis, 1.1) @ arm
    delta = drag(gizmo, part, projection, projection.pixel(grabbed), projection.pixel(goal))
    np.testing.assert_allclose(moved(delta, grabbed), goal, atol=1e-7)
    np.testing.assert_allclose(moved(delta, origin), origin, atol=1e-12)
    assert np.linalg.det(delta[:3, :3]) == pytest.approx(1.0)


def test_ring_counts_whole_turns(projection):
    gizmo = Gizmo()
    gizmo.attach(frame_at())
    center = projection.pixel(gizmo.frame[:3, 3])

    def at(angle):
        return center + 80.0 * np.array([np.cos(angle), np.sin(angle)])

    gizmo.begin(VIEW_RING, projection, *at(0.0))
    for angle in np.linspace(0.0, 5.0 * np.pi, 60):
        gizmo.move(*at(angle))
    # The eye's own perspective bends the circle about the centre a little.
    assert abs(gizmo.amount) == pytest.approx(5.0 * np.pi, abs=0.02)


def test_ring_seen_edge_on_still_turns():
    projection = looking(position=(5.0, 0.0, 0.0))
    gizmo = Gizmo()
    gizmo.attach(frame_at((0.0, 0.0, 0.0)))
    start = projection.pixel([0.0, 0.0, 0.0])
    delta = drag(gizmo, RINGS[2], projection, start, start + np.array([40.0, 0.0]))
    near_point = np.array([0.5, 0.0, 0.0])
    assert projection.pixel(moved(delta, near_point))[0] > start[0] + 10.0


def test_scale_is_the_ratio_of_distances_to_the_centre(gizmo, projection):
    origin = gizmo.frame[:3, 3]
    center = projection.pixel(origin)
    delta = drag(gizmo, SCALE_BOX, projection, center + np.array([30.0, 0.0]), center + np.array([0.0, 75.0]))
    np.testing.assert_allclose(delta[:3, :3], 2.5 * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(moved(delta, origin), origin, atol=1e-12)


def test_scale_bound_to_an_axis_or_plane_leaves_the_rest(gizmo, projection):
    center = projection.pixel(gizmo.frame[:3, 3])
    drag(gizmo, SCALE_BOX, projection, center + np.array([30.0, 0.0]), center + np.array([60.0, 0.0]))
    axes = gizmo.axes
    np.testing.assert_allclose(axes.T @ gizmo.bind(Lock.AXIS, 0)[:3, :3] @ axes, np.diag([2.0, 1.0, 1.0]), atol=1e-12)
    np.testing.assert_allclose(axes.T @ gizmo.bind(Lock.PLANE, 0)[:3, :3] @ axes, np.diag([1.0, 2.0, 2.0]), atol=1e-12)


@pytest.mark.parametrize("part", PARTS)
def test_going_back_to_the_start_is_the_identity(gizmo, projection, part):
    start = projection.pixel(gizmo.frame[:3, 3]) + np.array([50.0, 20.0])
    gizmo.begin(part, projection, *start)
    rng = np.random.default_rng(2)
    for xy in start + rng.uniform(-40.0, 40.0, (20, 2)):
        gizmo.move(*xy)
    turns = np.round(gizmo.amount / (2 * np.pi)) if part.act is Act.ROTATE else 0
    # Nothing accumulates: only the number of whole turns is remembered, and whole turns are the identity.
    np.testing.assert_allclose(gizmo.move(*start), np.eye(4), atol=1e-9 * (1 + abs(turns)))


def test_fine_motion_is_a_tenth_and_does_not_jump(gizmo, projection):
    start = projection.pixel(gizmo.frame[:3, 3])
    before = drag(gizmo, DOT, projection, start, start + np.array([50.0, 0.0]))
    np.testing.assert_allclose(gizmo.move(*(start + np.array([50.0, 0.0])), fine=True), before)
    fine = gizmo.move(*(start + np.array([150.0, 0.0])), fine=True)
    coarse = drag(gizmo, DOT, projection, start, start + np.array([60.0, 0.0]))
    np.testing.assert_allclose(fine, coarse, atol=1e-9)


def test_snapped_moves_are_whole_steps(gizmo, projection):
    start = projection.pixel(gizmo.frame[:3, 3]) + np.array([50.0, 20.0])
    drag(gizmo, ARROWS[0], projection, start, start + np.array([90.0, 33.0]), snap=True)
    assert gizmo.amount / 0.1 == pytest.approx(round(gizmo.amount / 0.1), abs=1e-9)
    drag(gizmo, VIEW_RING, projection, start, start + np.array([0.0, 60.0]), snap=True)
    assert np.degrees(gizmo.amount) / 5.0 == pytest.approx(round(np.degrees(gizmo.amount) / 5.0), abs=1e-9)
    drag(gizmo, SCALE_BOX, projection, start, start + np.array([33.0, 0.0]), snap=True)
    assert gizmo.amount / 0.1 == pytest.approx(round(gizmo.amount / 0.1), abs=1e-9)


def test_typed_numbers_win_over_the_pointer_until_taken_back(gizmo, projection):
    start = projection.pixel(gizmo.frame[:3, 3]) + np.array([40.0, 10.0])
    pointed = drag(gizmo, DOT, projection, start, start + np.array([20.0, 5.0]))
    gizmo.bind(Lock.AXIS, 1)
    delta = gizmo.type(2.5)
    np.testing.assert_allclose(delta[:3, 3], 2.5 * gizmo.axes[:, 1])
    np.testing.assert_allclose(gizmo.move(*(start + np.array([300.0, 0.0]))), delta)
    gizmo.type(None)
    gizmo.bind(Lock.VIEW)
    np.testing.assert_allclose(gizmo.move(*(start + np.array([20.0, 5.0]))), pointed, atol=1e-9)
    gizmo.begin(VIEW_RING, projection, *start)
    gizmo.bind(Lock.AXIS, 2)
    np.testing.assert_allclose(gizmo.type(90.0)[:3, :3], turn(gizmo.axes[:, 2], np.pi / 2), atol=1e-12)
    gizmo.begin(SCALE_BOX, projection, *start)
    np.testing.assert_allclose(gizmo.type(0.5)[:3, :3], 0.5 * np.eye(3))


@pytest.mark.parametrize("part", [DOT, VIEW_RING, SCALE_BOX])
@pytest.mark.parametrize("number", [1e300, -1e300, 0.0, 1e39])
def test_no_typed_number_leads_out_of_the_limits_of_a_pose(gizmo, projection, part, number):
    gizmo.begin(part, projection, *projection.pixel(gizmo.frame[:3, 3]))
    pose = Pose().moved(gizmo.type(number), gizmo.frame[:3, 3])
    assert np.isfinite(pose.matrix(gizmo.frame[:3, 3]).astype(np.float32)).all()
    assert SCALES[0] <= pose.scale <= SCALES[1]


def test_gizmo_keeps_its_size_on_the_screen(projection):
    gizmo = Gizmo(scale=2.0)
    for origin in ((0.0, 0.0, 0.0), (1.0, 2.0, -0.5), (-2.0, 3.0, 1.0)):
        gizmo.attach(frame_at(origin))
        end = np.array(origin) + gizmo.arm_length(projection) * projection.right
        length = np.linalg.norm(projection.pixel(end) - projection.pixel(origin))
        assert length == pytest.approx(2.0 * gizmo.size_px, rel=1e-9)


def test_each_part_is_hit_where_it_is_drawn(projection):
    gizmo = Gizmo()
    gizmo.attach(frame_at())
    origin, size = gizmo.frame[:3, 3], gizmo.arm_length(projection)
    sight = origin - projection.eye if not projection.is_parallel else projection.direction
    assert any(gizmo.is_part_shown(square, projection) for square in SQUARES)
    for i in range(3):
        e, f, g = np.roll(np.eye(3), -i, axis=0)
        assert gizmo.hit(projection, *projection.pixel(origin + 0.95 * size * e)) == ARROWS[i]
        middle = 0.5 * (SQUARE_NEAR + SQUARE_FAR) * size
        if gizmo.is_part_shown(SQUARES[i], projection):
            assert gizmo.hit(projection, *projection.pixel(origin + middle * (f + g))) in (SQUARES[i], *RINGS)
        near = -(sight - (sight @ e) * e)
        near = turn(e, 0.25) @ near / np.linalg.norm(near)
        assert gizmo.hit(projection, *projection.pixel(origin + RING_RADIUS * size * near)) in (RINGS[i], *SQUARES)
    assert gizmo.hit(projection, *projection.pixel(origin)) == DOT
    on_ring = origin + VIEW_RING_RADIUS * size * projection.right
    assert gizmo.hit(projection, *projection.pixel(on_ring)) == VIEW_RING
    box = origin + SCALE_BOX_AT * size * (projection.right + projection.up)
    assert gizmo.hit(projection, *projection.pixel(box)) == SCALE_BOX
    assert gizmo.hit(projection, 5.0, 5.0) is None


def test_parts_that_face_the_viewer_badly_are_hidden():
    projection = looking(position=(0.001, -5.0, 0.0))
    gizmo = Gizmo()
    gizmo.attach(frame_at((0.0, 0.0, 0.0)))
    assert not gizmo.is_part_shown(ARROWS[1], projection)
    assert gizmo.is_part_shown(ARROWS[0], projection)
    assert gizmo.is_part_shown(SQUARES[1], projection)
    assert not gizmo.is_part_shown(SQUARES[0], projection)


def test_cancel_and_detach_leave_nothing(gizmo, projection):
    before = gizmo.shown_frame
    drag(gizmo, DOT, projection, (450.0, 300.0), (500.0, 320.0))
    assert not np.allclose(gizmo.shown_frame, before)
    gizmo.cancel()
    np.testing.assert_array_equal(gizmo.shown_frame, before)
    assert gizmo.dragged is None
    gizmo.detach()
    assert gizmo.hit(projection, 450.0, 300.0) is None
    with pytest.raises(ValueError, match="attached"):
        gizmo.begin(DOT, projection, 0.0, 0.0)


def test_acts_that_are_off_are_neither_shown_nor_hit(projection):
    gizmo = Gizmo(acts=frozenset({Act.ROTATE}))
    gizmo.attach(frame_at())
    origin, size = gizmo.frame[:3, 3], gizmo.arm_length(projection)
    assert gizmo.hit(projection, *projection.pixel(origin)) is None
    assert gizmo.hit(projection, *projection.pixel(origin + VIEW_RING_RADIUS * size * projection.right)) == VIEW_RING


@pytest.mark.parametrize("part", [ARROWS[0], RINGS[2], SCALE_BOX], ids=["arrow", "ring", "box"])
def test_a_gizmo_that_carries_everything_stays_on_what_it_carries_and_its_axes_in_the_world(projection, part):
    gizmo = Gizmo(carries_all=True)
    gizmo.attach(frame_at())
    start = projection.pixel(frame_at()[:3, 3]) + np.array([50.0, 3.0])
    delta = drag(gizmo, part, projection, start, start + np.array([30.0, 25.0]))
    assert not np.allclose(delta, np.eye(4))
    gizmo.begin(part, projection, *start)
    gizmo.move(*(start + np.array([30.0, 25.0])))
    np.testing.assert_allclose(gizmo.shown_frame[:3, 3], frame_at()[:3, 3], atol=1e-12)
    turned = gizmo.delta[:3, :3] / np.cbrt(np.linalg.det(gizmo.delta[:3, :3]))
    np.testing.assert_allclose(turned @ gizmo.axes, np.eye(3), atol=1e-12)


def test_numbers_are_in_units_of_the_world(projection):
    gizmo = Gizmo(unit=0.5, world_axes=turn([0, 0, 1], 0.3))
    gizmo.attach(frame_at())
    gizmo.begin(ARROWS[0], projection, *projection.pixel(frame_at()[:3, 3]))
    delta = gizmo.type(3.0)
    np.testing.assert_allclose(delta[:3, 3], 1.5 * turn([0, 0, 1], 0.3)[:, 0], atol=1e-12)
    assert gizmo.amount == 3.0
    gizmo.type(None)
    shift = gizmo.move(*(projection.pixel(frame_at()[:3, 3]) + np.array([80.0, 0.0])))[:3, 3]
    assert gizmo.amount == pytest.approx(float(shift @ gizmo.axes[:, 0]) / 0.5)
