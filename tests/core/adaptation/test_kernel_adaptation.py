from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.adaptation.kernel_adaptation import KernelBinding, adapt_kernels, adapted_splats
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.surface.geodesics import geodesic_neighbors
from tests.core.adaptation.bound_scenes import SHIFT, TURN, bent, bound, deformation_by, rigid
from tests.core.splat_scenes import ball, joined, moved, sheet, shuffled, splats_of
from tests.reference.kernels import adapted_ellipse


def covariances(splats):
    frames = quats_to_matrices(splats.quats)[:, :, : splats.n_scales]
    return np.einsum("nik,nk,njk->nij", frames, splats.scales**2, frames)


def with_thickness(splats, thickness, first=False):
    """Three scales, the normal in the last column or in the first."""
    log_scales = np.column_stack([splats.log_scales, np.full(splats.n_splats, np.log(thickness))])
    if not first:
        return replace(splats, log_scales=log_scales)
    cycled = quats_to_matrices(splats.quats)[:, :, [2, 0, 1]]
    return replace(
        splats, log_scales=log_scales[:, [2, 0, 1]], quats=Rotation.from_matrix(cycled).as_quat()[:, [3, 0, 1, 2]]
    )


def coloured(splats, seed=0):
    rng = np.random.default_rng(seed)
    return replace(splats, sh0=rng.normal(size=(splats.n_splats, 3)), shN=rng.normal(size=(splats.n_splats, 15, 3)))


def variants():
    scene = ball(150)
    lengths = np.random.default_rng(1).uniform(0.3, 8.0, (150, 1)) * np.random.default_rng(2).choice([-1, 1], (150, 1))
    return {
        "two scales": scene,
        "three scales": with_thickness(scene, 0.002),
        "three scales, normal first": with_thickness(scene, 0.002, first=True),
        "filtered": replace(scene, filter_radii=np.full(150, 0.02)),
        "raw quaternions": replace(scene, quats=lengths * scene.quats),
        "circles": splats_of(scene.means, np.full((150, 2), 0.2), quats_to_matrices(scene.quats)),
        "needles": splats_of(scene.means, np.tile([0.3, 1e-3], (150, 1)), quats_to_matrices(scene.quats)),
    }


@pytest.mark.parametrize("name", variants())
@pytest.mark.parametrize("method", ["surface", "affine"])
def test_a_rigid_motion_comes_through_exactly(name, method):
    scene = coloured(variants()[name])
    binding = bound(scene)
    adapted = adapt_kernels(binding, rigid(binding), method=method)
    result, expected = adapted_splats(scene, adapted), moved(scene, TURN, 1.0, SHIFT)
    np.testing.assert_allclose(result.means, expected.means, atol=1e-12)
    np.testing.assert_allclose(result.log_scales, expected.log_scales, atol=1e-9)
    np.testing.assert_allclose(adapted.rotations, np.tile(TURN.as_matrix(), (150, 1, 1)), atol=1e-9)
    np.testing.assert_allclose(quats_to_matrices(result.quats), quats_to_matrices(expected.quats), atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(result.quats, axis=1), np.linalg.norm(scene.quats, axis=1), rtol=1e-12)


def test_a_uniform_scaling_scales_the_splats():
    scene = ball(150)
    binding = bound(scene)
    result = adapted_splats(scene, adapt_kernels(binding, rigid(binding, scale=2.0)))
    expected = moved(scene, TURN, 2.0, SHIFT)
    np.testing.assert_allclose(result.means, expected.means, atol=1e-12)
    np.testing.assert_allclose(result.log_scales, expected.log_scales, atol=1e-9)
    np.testing.assert_allclose(quats_to_matrices(result.quats), quats_to_matrices(expected.quats), atol=1e-9)


@pytest.mark.parametrize("method", ["surface", "affine", "none"])
def test_where_nothing_moves_the_files_own_numbers_stay(method):
    scene = coloured(with_thickness(ball(150), 0.002))
    scene = replace(scene, **{name: getattr(scene, name).astype(np.float32) for name in ("means", "quats", "shN")})
    binding = bound(scene)
    rest = binding.ellipses.centers
    # The rounding errors of a solver are no motion.
    noise = 1e-14 * np.random.default_rng(0).normal(size=rest.shape)
    adapted = adapt_kernels(binding, Deformation(rest + noise, np.tile(np.eye(3), (150, 1, 1))), method=method)
    assert not adapted.changed.any()
    result = adapted_splats(scene, adapted)
    for name in ("means", "log_scales", "quats", "sh0", "shN"):
        old, new = getattr(scene, name), getattr(result, name)
        assert new.dtype == old.dtype and new.tobytes() == old.tobytes()


def test_only_what_hangs_on_a_moved_node_changes():
    scene = coloured(ball(300))
    binding = bound(scene)
    rest = binding.ellipses.centers
    lifted = rest[:, 2] > 0.5
    still = Deformation(rest + 0.1 * lifted[:, None], np.tile(np.eye(3), (300, 1, 1)))
    adapted = adapt_kernels(binding, still)
    carried = lifted[binding.carriers].any(axis=1)
    assert adapted.changed[binding.ellipses.rows[carried]].all()
    kept = binding.ellipses.rows[~carried]
    assert len(kept) > 50 and not adapted.changed[kept].any()
    result = adapted_splats(scene, adapted)
    for name in ("means", "log_scales", "quats", "shN"):
        np.testing.assert_array_equal(getattr(result, name)[kept], getattr(scene, name)[kept])


@pytest.mark.parametrize(
    "scene", [ball(150), sheet(150, tilt=0.2), ball(60, cover=30.0)], ids=["ball", "sheet", "deep"]
)
def test_adapted_ellipses_are_the_twins(scene):
    binding = bound(scene)
    deformation = deformation_by(
        binding, lambda p: bent(0.7)(p * [1.0, 1.3, 0.9]) + 0.1 * np.sin(3.0 * p[:, [1, 2, 0]])
    )
    adapted = adapt_kernels(binding, deformation)
    result = covariances(adapted_splats(scene, adapted))
    neighborhoods = geodesic_neighbors(binding.graph, 30)
    # The weights of the carriers are kept in single precision.
    for i, row in enumerate(binding.ellipses.rows):
        center, covariance, rotation = adapted_ellipse(binding.ellipses, neighborhoods, deformation, i)
        np.testing.assert_allclose(adapted.means[row], center, atol=1e-8)
        np.testing.assert_allclose(result[row], covariance, atol=1e-6 * np.abs(covariance).max())
        np.testing.assert_allclose(adapted.rotations[row], rotation, atol=1e-6)


def test_the_file_order_does_not_matter():
    scene, order = ball(200), np.random.default_rng(0).permutation(200)
    results = []
    for splats in (scene, shuffled(scene, order)):
        binding = bound(splats)
        results.append(adapted_splats(splats, adapt_kernels(binding, deformation_by(binding, bent(1.5)))))
    np.testing.assert_allclose(results[1].means, results[0].means[order], atol=1e-12)
    np.testing.assert_allclose(covariances(results[1]), covariances(results[0])[order], atol=1e-12)


def test_the_sign_and_length_of_quaternions_do_not_matter():
    scene = ball(200)
    factors = np.random.default_rng(0).uniform(0.2, 9.0, (200, 1)) * np.random.default_rng(1).choice([-1, 1], (200, 1))
    results = []
    for splats in (scene, replace(scene, quats=factors * scene.quats)):
        binding = bound(splats)
        results.append(adapted_splats(splats, adapt_kernels(binding, deformation_by(binding, bent(1.5)))))
    np.testing.assert_allclose(results[1].means, results[0].means, atol=1e-12)
    np.testing.assert_allclose(covariances(results[1]), covariances(results[0]), atol=1e-12)
    np.testing.assert_allclose(results[1].quats, factors * results[0].quats, atol=1e-9)


def test_turning_and_scaling_the_scene_commutes_with_adaptation():
    # A quarter turn, since the scene's bounding box, and with it the graph's tolerance, would change with any other.
    turn = Rotation.from_euler("xz", [90.0, 90.0], degrees=True)
    scene = ball(200)
    other = moved(scene, turn, 3.0, SHIFT)
    mapping = bent(1.5)

    def mapping_there(points):
        return 3.0 * turn.apply(mapping(turn.inv().apply(points - SHIFT) / 3.0)) + SHIFT

    here, there = bound(scene), bound(other)
    result = adapted_splats(scene, adapt_kernels(here, deformation_by(here, mapping)))
    result_there = adapted_splats(other, adapt_kernels(there, deformation_by(there, mapping_there)))
    expected = moved(result, turn, 3.0, SHIFT)
    # The rotations come from differences over 1e-6.
    np.testing.assert_allclose(result_there.means, expected.means, atol=1e-7)
    np.testing.assert_allclose(covariances(result_there), covariances(expected), atol=1e-7)


def test_frames_follow_a_growing_bend_without_a_jump():
    scene = sheet(300, size=1.0)
    scene = replace(scene, log_scales=scene.log_scales + np.array([0.05, 0.0]))
    binding = bound(scene)
    aspects = np.exp(np.abs(np.diff(scene.log_scales, axis=1)[:, 0]))
    earlier = None
    for radius in 1.0 / np.linspace(0.01, 4.0, 60):
        adapted = adapt_kernels(binding, deformation_by(binding, bent(radius)))
        result = adapted_splats(scene, adapted)
        frames = quats_to_matrices(result.quats)
        if earlier is not None:
            # A splat half a unit from the axis turns by 0.034 rad a step; a swap of axes would be 1.6.
            assert np.abs(adapted.rotations - earlier[0]).max() < 0.1
            assert np.abs(frames - earlier[1])[aspects > 1.2].max() < 0.15
            assert np.abs(result.log_scales - earlier[2])[aspects > 1.2].max() < 0.1
            assert np.abs(covariances(result) - earlier[3]).max() < 0.1 * covariances(scene).max()
        assert np.linalg.det(frames).min() > 0.999
        earlier = adapted.rotations, frames, result.log_scales, covariances(result)


def test_circles_take_any_shape_and_keep_their_frame_where_they_stay_circles():
    scene = splats_of(sheet(196).means, np.full((196, 2), 0.08))
    binding = bound(scene)
    shear = np.array([[1.0, 0.6, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    adapted = adapt_kernels(binding, deformation_by(binding, lambda p: p @ shear.T))
    sheared = np.einsum("ij,njk,lk->nil", shear, covariances(scene), shear)
    assert (np.abs(np.arctan2(adapted.arrays.twists[:, 1], adapted.arrays.twists[:, 0])) <= np.pi / 4 + 1e-12).all()
    middle = np.abs(scene.means[:, :2] - 0.5).max(axis=1) < 0.3
    # Stretch is read from neighbours with a damping of 2 %, most in the direction in which they lie least apart.
    np.testing.assert_allclose(
        covariances(adapted_splats(scene, adapted))[middle], sheared[middle], atol=0.15 * np.abs(sheared).max()
    )


@pytest.mark.parametrize("first", [False, True])
def test_thickness_is_kept_and_the_normal_follows_the_plane(first):
    flat = sheet(200)
    thin = with_thickness(flat, 0.003, first=first)
    bindings = bound(flat), bound(thin)
    results = [adapted_splats(b.splats, adapt_kernels(b, deformation_by(b, bent(0.5)))) for b in bindings]
    column = 0 if first else 2
    np.testing.assert_array_equal(results[1].log_scales[:, column], thin.log_scales[:, column])
    normals = quats_to_matrices(results[1].quats)[:, :, column]
    np.testing.assert_allclose(
        covariances(results[1]),
        covariances(results[0]) + 0.003**2 * np.einsum("ni,nj->nij", normals, normals),
        atol=1e-12,
    )
    np.testing.assert_allclose(
        np.abs(np.einsum("ni,ni->n", normals, quats_to_matrices(results[0].quats)[:, :, 2])), 1.0
    )


def test_with_a_filter_the_effective_size_grows():
    scene = sheet(196)
    filtered = replace(scene, filter_radii=np.full(196, 0.01), log_scales=scene.log_scales - 0.3)
    binding = bound(filtered)
    stretch = deformation_by(binding, lambda p: p * [2.0, 1.0, 1.0])
    adapted = adapt_kernels(binding, stretch)
    result = adapted_splats(filtered, adapted)
    columns = binding.ellipses.axes[:, :2].astype(int)
    rows = binding.ellipses.rows[:, None]
    np.testing.assert_allclose(
        result.scales[rows, columns], adapted.arrays.growths * filtered.scales[rows, columns], rtol=1e-12
    )
    lengths = np.linalg.norm(adapted.axes_f32, axis=2)
    np.testing.assert_allclose(lengths[rows, columns], result.scales[rows, columns], rtol=1e-6)
    shrunk = adapted_splats(filtered, adapt_kernels(binding, rigid(binding, scale=0.01)))
    assert np.isfinite(shrunk.log_scales).all()


def test_drawn_axes_hold_the_written_covariance():
    scene = ball(200)
    binding = bound(scene)
    adapted = adapt_kernels(binding, deformation_by(binding, bent(1.5)))
    axes = adapted.axes_f32.astype(float)
    written = covariances(adapted_splats(scene, adapted))
    # Single precision.
    np.testing.assert_allclose(np.einsum("nki,nkj->nij", axes, axes), written, atol=1e-6 * np.abs(written).max())
    np.testing.assert_allclose(adapted.means_f32, adapted.means, atol=1e-6)
    at_rest = adapt_kernels(binding, rigid(binding, Rotation.identity(), 0.0))
    axes = at_rest.axes_f32.astype(float)
    np.testing.assert_allclose(np.einsum("nki,nkj->nij", axes, axes), covariances(scene), atol=1e-7)


def test_inert_splats_go_with_their_surroundings_and_keep_their_size():
    scene = coloured(ball(200))
    logits = scene.logit_opacities.copy()
    logits[:20] = -30.0
    quats, log_scales = scene.quats.copy(), scene.log_scales.copy()
    quats[20], quats[21, 1], log_scales[22, 0], logits[23] = 0.0, np.nan, np.inf, np.nan
    scene = replace(scene, logit_opacities=logits, quats=quats, log_scales=log_scales)
    binding = bound(scene)
    assert binding.ellipses.n_nodes == 176
    adapted = adapt_kernels(binding, rigid(binding))
    result = adapted_splats(scene, adapted)
    np.testing.assert_allclose(result.means, TURN.apply(scene.means) + SHIFT, atol=1e-12)
    np.testing.assert_allclose(adapted.rotations, np.tile(TURN.as_matrix(), (200, 1, 1)), atol=1e-9)
    np.testing.assert_array_equal(result.log_scales[:24], scene.log_scales[:24])
    expected = TURN.as_matrix() @ quats_to_matrices(scene.quats[:20])
    np.testing.assert_allclose(quats_to_matrices(result.quats[:20]), expected, atol=1e-9)
    assert not result.quats[20].any() and np.isnan(result.quats[21]).any()
    assert np.isfinite(adapted.means_f32).all() and np.isfinite(adapted.axes_f32).all()
    bend = adapt_kernels(binding, deformation_by(binding, bent(1.5)))
    assert np.isfinite(bend.means).all() and np.isfinite(bend.rotations).all()


def test_a_collapsed_surface_gives_finite_splats():
    scene = ball(200)
    binding = bound(scene)
    rest = binding.ellipses.centers
    for positions in (np.zeros_like(rest), rest * [1.0, 0.0, 0.0], rest * [1.0, 1.0, 0.0], rest * 1e-9):
        for method in ("surface", "affine"):
            adapted = adapt_kernels(binding, Deformation(positions, rigid(binding).rotations), method=method)
            result = adapted_splats(scene, adapted)
            for values in (result.means, result.log_scales, result.quats, adapted.rotations, adapted.axes_f32):
                assert np.isfinite(values).all()
            np.testing.assert_allclose(np.linalg.det(adapted.rotations), 1.0, atol=1e-9)


def test_lonely_and_coinciding_splats_move_with_their_own_node():
    scene = joined(sheet(100), splats_of([[5.0, 0.0, 0.0]] * 3 + [[9.0, 9.0, 9.0]], np.full((4, 2), 0.05)))
    binding = bound(scene)
    result = adapted_splats(scene, adapt_kernels(binding, rigid(binding)))
    np.testing.assert_allclose(result.means, TURN.apply(scene.means) + SHIFT, atol=1e-12)
    np.testing.assert_allclose(result.log_scales, scene.log_scales, atol=1e-9)


@pytest.mark.parametrize("hops", [1, 2, 3])
def test_affine_adaptation_reproduces_a_linear_map_of_a_plane(hops):
    scene = sheet(300)
    binding = bound(scene)
    matrix = np.array([[1.2, 0.5, 0.0], [-0.3, 0.8, 0.0], [0.2, 0.4, 1.0]])
    adapted = adapt_kernels(binding, deformation_by(binding, lambda p: p @ matrix.T), method="affine", hops=hops)
    inner = np.abs(scene.means[:, :2] - 0.5).max(axis=1) < 0.4
    expected = np.einsum("ij,njk,lk->nil", matrix, covariances(scene), matrix)
    # The damping towards the rotation is 1e-6 of the ring's spread, and rings may be nearly in line.
    error = np.abs(covariances(adapted_splats(scene, adapted)) - expected).max(axis=(1, 2))
    assert np.quantile(error[inner], 0.9) < 1e-5 * np.abs(expected).max()


def test_without_adaptation_only_centres_move():
    scene = coloured(ball(150))
    binding = bound(scene)
    adapted = adapt_kernels(binding, rigid(binding), method="none")
    result = adapted_splats(scene, adapted)
    np.testing.assert_allclose(result.means[binding.ellipses.rows], rigid(binding).positions, atol=0.0)
    np.testing.assert_allclose(adapted.means_f32, result.means, atol=1e-6)
    for name in ("log_scales", "shN"):
        np.testing.assert_array_equal(getattr(result, name), getattr(scene, name))
    np.testing.assert_allclose(result.quats, scene.quats, atol=1e-15)


def test_on_a_bend_adapted_ellipses_lie_closer_to_the_surface_than_unadapted_and_affine_ones():
    # Few graph neighbours, all close to the centre, see little of a large splat's ellipse.
    scene = sheet(400, cover=30.0, tilt=0.1, seed=2)
    scene = replace(scene, means=scene.means + 0.01 * np.random.default_rng(0).normal(size=(400, 3)) * [0, 0, 1])
    binding = bound(scene)
    deformation = deformation_by(binding, bent(0.5))
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    distances = {}
    for method in ("surface", "affine", "none"):
        adapted = adapt_kernels(binding, deformation, method=method)
        axes = 2.5 * adapted.axes_f32.astype(float)
        rim = adapted.means[:, None] + np.cos(angles)[:, None] * axes[:, :1] + np.sin(angles)[:, None] * axes[:, 1:]
        distances[method] = np.sqrt(np.mean((np.hypot(rim[..., 0], rim[..., 2] - 0.5) - 0.5) ** 2))
    assert distances["surface"] < 0.95 * distances["affine"] < 0.5 * distances["none"]


def test_arrays_of_an_earlier_result_may_be_written_over():
    scene = ball(150)
    binding = bound(scene)
    expected = adapt_kernels(binding, deformation_by(binding, bent(1.5)))
    earlier = adapt_kernels(binding, rigid(binding))
    assert earlier.quats is not None
    result = adapt_kernels(binding, deformation_by(binding, bent(1.5)), out=earlier)
    assert result.arrays.means is earlier.arrays.means
    np.testing.assert_array_equal(result.means, expected.means)
    np.testing.assert_array_equal(result.quats, expected.quats)
    np.testing.assert_array_equal(result.axes_f32, expected.axes_f32)


def test_carriers_lie_along_the_surface_not_across_a_gap():
    upper = sheet(200, height=0.05, seed=1)
    scene = joined(sheet(200), upper)
    binding = bound(scene)
    height = binding.ellipses.centers[:, 2]
    np.testing.assert_array_equal(height[binding.carriers], np.tile(height[:, None], (1, 9)))
    assert (binding.weights > 0.0).all() and (binding.weights.reshape(-1, 3, 2).sum(axis=2) < 1.0).all()


def test_binding_tells_its_progress_and_can_be_cancelled():
    scene = ball(100)
    shares = []
    ellipses = occupancy_ellipses(scene)
    neighborhoods = geodesic_neighbors(splat_graph(ellipses), 30)
    KernelBinding(scene, ellipses, neighborhoods, progress=shares.append)
    assert shares[0] == 0.0 and shares[-1] == 1.0

    def cancel(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        KernelBinding(scene, ellipses, neighborhoods, progress=cancel)


def test_rejects_what_does_not_belong_together():
    scene, other = ball(100), ball(90)
    binding, ellipses = bound(scene), occupancy_ellipses(other)
    graph = splat_graph(ellipses)
    neighborhoods = geodesic_neighbors(graph, 30)
    still = rigid(binding)
    with pytest.raises(ValueError, match="ellipses are of 90 splats, the scene has 100"):
        KernelBinding(scene, ellipses, neighborhoods)
    with pytest.raises(ValueError, match="neighborhoods are of 90 nodes, the ellipses of 100"):
        KernelBinding(scene, binding.ellipses, neighborhoods)
    with pytest.raises(ValueError, match="graph is of 90 nodes, the ellipses of 100"):
        KernelBinding(scene, binding.ellipses, geodesic_neighbors(binding.graph, 30), graph=graph)
    with pytest.raises(ValueError, match='adaptation must be "surface" or "affine" or "paper" or "none"'):
        adapt_kernels(binding, still, method="mesh")
    with pytest.raises(ValueError, match="hops must be a whole number, 1 to 3, got 4"):
        adapt_kernels(binding, still, method="affine", hops=4)
    with pytest.raises(ValueError, match="needs a KernelBinding made with the splat graph"):
        adapt_kernels(KernelBinding(other, ellipses, neighborhoods), still, method="affine")
    with pytest.raises(ValueError, match=r"positions must have shape \(100, 3\), got \(99, 3\)"):
        adapt_kernels(binding, replace(still, positions=still.positions[1:]))
    with pytest.raises(ValueError, match=r"rotations must have shape \(100, 3, 3\), got \(100, 4\)"):
        adapt_kernels(binding, replace(still, rotations=np.zeros((100, 4))))
    with pytest.raises(ValueError, match="adapted kernels are of 100 splats, the scene has 90"):
        adapted_splats(other, adapt_kernels(binding, still))


@pytest.mark.parametrize("method", ["surface", "affine", "none"])
def test_no_splat_moves_farther_than_its_node_and_its_carriers(method):
    binding = bound(ball(300))
    rest = binding.ellipses.centers
    rng = np.random.default_rng(0)
    # Neighbours torn apart, as beside the rim of a handle among pins.
    shifts = np.where(rng.random(len(rest)) < 0.2, 1.0, 0.0)[:, None] * np.array([0.0, 0.3, 1.0])
    deformation = Deformation(rest + shifts, np.tile(np.eye(3), (len(rest), 1, 1)))
    adapted = adapt_kernels(binding, deformation, method=method)
    shifted = np.linalg.norm(adapted.means[binding.ellipses.rows] - rest, axis=1)
    around = np.concatenate([np.arange(len(rest))[:, None], binding.carriers], axis=1)
    assert (shifted <= np.linalg.norm(shifts, axis=1)[around].max(axis=1) * (1.0 + 1e-9) + 1e-12).all()
    assert (shifted > 0.0).any()


def test_what_is_held_at_rest_keeps_its_bits_whatever_moves_beside_it():
    binding = bound(ball(300))
    rest = binding.ellipses.centers
    moving = np.arange(len(rest)) % 5 == 0
    deformation = Deformation(
        rest + moving[:, None] * np.array([0.0, 0.3, 1.0]),
        TURN.as_matrix()[None].repeat(len(rest), axis=0),
        resting=~moving,
    )
    for method, hops in (("surface", 1), ("affine", 1), ("affine", 2), ("none", 1)):
        adapted = adapt_kernels(binding, deformation, method=method, hops=hops)
        changed = adapted.changed[binding.ellipses.rows]
        assert changed[moving].any() and not changed[~moving].any()
        np.testing.assert_array_equal(adapted.means[binding.ellipses.rows][~moving], rest[~moving])
