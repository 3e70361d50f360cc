"""Laws of colour grades: what is seen is mapped affinely from every side, and a grade at rest is none."""

import numpy as np
import pytest

from splap_editor.core.grade import LUMA, MIDDLE_GREY, color_map, faded_logits, graded_splats
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.options import options_of
from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.spherical_harmonics import rotated_sh, view_colors
from splap_editor.core.splats.splats import Splats

N = 60
FULL = GradeOptions(
    exposure=0.7, contrast=1.3, saturation=0.6, hue=40.0, temperature=0.5, tint=-0.3, opacity=0.5, falloff=1.0
)


class Stop:
    """Progress that cancels at its call of a number."""

    def __init__(self, at):
        self.left = at

    def __call__(self, share):
        self.left -= 1
        if self.left < 0:
            raise Cancelled


def some_splats(n_coefficients=15, dtype=np.float64, seed=0):
    """Splats of any colours, none so bright that a view clips them."""
    rng = np.random.default_rng(seed)
    return Splats(
        means=rng.normal(size=(N, 3)).astype(dtype),
        log_scales=np.full((N, 3), -2.0, dtype),
        quats=np.tile(np.array([1.0, 0, 0, 0], dtype), (N, 1)),
        logit_opacities=rng.normal(scale=3.0, size=N).astype(dtype),
        sh0=rng.normal(scale=0.3, size=(N, 3)).astype(dtype),
        shN=rng.normal(scale=0.02, size=(N, n_coefficients, 3)).astype(dtype),
    )


def seen(splats, eye=(3.0, -5.0, 4.0)):
    """(N, 3) colours from a point, before anything is clipped."""
    rest = np.broadcast_to(np.eye(3), (N, 3, 3))
    lifted = np.asarray(splats.sh0) + 20.0
    colors = view_colors(
        lifted.astype(np.float32),
        np.asarray(splats.shN, np.float32),
        splats.means.astype(np.float32),
        rest,
        np.array(eye),
    )
    return colors.astype(np.float64) - 20.0 * 0.28209479177387814


@pytest.mark.parametrize("options", [GradeOptions(), GradeOptions(falloff=2.0)])
def test_a_grade_at_rest_is_the_same_object(options):
    splats = some_splats()
    assert options.is_identity
    assert graded_splats(splats, [(options, None), (options, np.ones(N))]) is splats
    matrix, offset = color_map(options)
    np.testing.assert_array_equal(matrix, np.eye(3))
    np.testing.assert_array_equal(offset, 0.0)


def test_grading_tells_how_far_it_is_and_can_be_cancelled():
    splats, told = some_splats(), []
    graded_splats(splats, [(FULL, None), (FULL, np.ones(N))], told.append)
    assert told == sorted(told) and told[0] == 0.0 and told[-1] == 1.0
    for at in range(len(told)):
        with pytest.raises(Cancelled):
            graded_splats(splats, [(FULL, None), (FULL, np.ones(N))], Stop(at))


@pytest.mark.parametrize("name", [name for name in options_of(GradeOptions) if name not in ("opacity", "falloff")])
def test_each_option_maps_what_is_seen_from_any_side(name):
    options = GradeOptions(**{name: getattr(FULL, name)})
    splats = some_splats()
    graded = graded_splats(splats, [(options, None)])
    matrix, offset = color_map(options)
    for eye in ((3.0, -5.0, 4.0), (-8.0, 0.1, 0.2)):
        # float32 of colours about 6.
        np.testing.assert_allclose(seen(graded, eye), seen(splats, eye) @ matrix.T + offset, atol=5e-6)
    assert graded.logit_opacities is splats.logit_opacities


@pytest.mark.parametrize("n_coefficients", [0, 3, 8, 15, 24])
def test_all_bands_are_graded_and_types_stay(n_coefficients):
    splats = some_splats(n_coefficients, np.float32)
    graded = graded_splats(splats, [(FULL, None)])
    matrix, _ = color_map(FULL)
    np.testing.assert_allclose(graded.shN, splats.shN @ matrix.T, atol=1e-7)
    for part in ("sh0", "shN", "logit_opacities"):
        assert getattr(graded, part).dtype == np.float32 and getattr(graded, part).shape == getattr(splats, part).shape
    assert graded.means is splats.means and graded.quats is splats.quats


def test_grey_stays_grey_and_a_white_balance_keeps_its_luma():
    grey = np.full(3, 0.37)
    for options in (GradeOptions(hue=123.0), GradeOptions(saturation=0.0), GradeOptions(saturation=3.0)):
        matrix, offset = color_map(options)
        np.testing.assert_allclose(matrix @ grey + offset, grey, atol=1e-12)
    matrix, offset = color_map(GradeOptions(temperature=0.8, tint=-0.4))
    assert LUMA @ (matrix @ grey + offset) == pytest.approx(0.37, abs=1e-12)
    red, _, blue = matrix @ grey
    assert red > blue, "a positive temperature is warm"
    middle = np.full(3, MIDDLE_GREY)
    matrix, offset = color_map(GradeOptions(contrast=2.5))
    np.testing.assert_allclose(matrix @ middle + offset, middle, atol=1e-12)


def test_exposures_add_up_and_hues_turn_round():
    def of(**held):
        return color_map(GradeOptions(**held))[0]

    np.testing.assert_allclose(of(exposure=0.5) @ of(exposure=1.0), of(exposure=1.5), rtol=1e-12)
    np.testing.assert_allclose(of(exposure=1.0), 2.0 ** (1 / 2.2) * np.eye(3), rtol=1e-12)
    np.testing.assert_allclose(of(hue=100.0) @ of(hue=-100.0), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(of(hue=180.0), of(hue=-180.0), atol=1e-12)
    np.testing.assert_allclose(of(hue=120.0) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)


def test_grading_and_turning_a_splat_go_in_either_order():
    splats = some_splats()
    quats = np.random.default_rng(1).normal(size=(N, 4))
    turns = quats_to_matrices(quats / np.linalg.norm(quats, axis=1, keepdims=True))
    every = np.ones(N, bool)
    matrix, _ = color_map(FULL)
    np.testing.assert_allclose(
        rotated_sh(splats.shN @ matrix.T, turns, every), rotated_sh(splats.shN, turns, every) @ matrix.T, atol=1e-6
    )


def test_a_share_mixes_before_and_after_and_none_keeps_every_bit():
    splats = some_splats(dtype=np.float32)
    shares = np.linspace(0.0, 1.0, N)
    full, part = graded_splats(splats, [(FULL, None)]), graded_splats(splats, [(FULL, shares)])
    for name in ("sh0", "shN"):
        before, after = (np.asarray(getattr(held, name), np.float64) for held in (splats, full))
        w = shares.reshape(-1, *[1] * (before.ndim - 1))
        np.testing.assert_allclose(getattr(part, name), before + w * (after - before), atol=1e-6)
    np.testing.assert_allclose(
        part.opacities, splats.opacities + shares * (full.opacities - splats.opacities), atol=1e-6
    )
    for name in ("sh0", "shN", "logit_opacities"):
        assert getattr(part, name)[0].tobytes() == getattr(splats, name)[0].tobytes()


def test_grades_are_applied_one_over_the_other():
    splats = some_splats()
    first, second = GradeOptions(exposure=1.0, opacity=0.5), GradeOptions(contrast=0.4, hue=70.0)
    mask = np.arange(N) % 2 == 0
    both = graded_splats(splats, [(first, None), (second, mask)])
    twice = graded_splats(graded_splats(splats, [(first, None)]), [(second, mask)])
    for name in ("sh0", "shN", "logit_opacities"):
        np.testing.assert_allclose(getattr(both, name), getattr(twice, name), atol=1e-12)


@pytest.mark.parametrize("factor", [0.0, 0.25, 1.0, 2.0, 4.0])
def test_opacities_follow_their_factor_and_stay_in_range(factor):
    alpha = np.array([1e-6, 0.01, 0.3, 0.9, 0.999999])
    logits = np.log(alpha / (1.0 - alpha))
    faded = 1.0 / (1.0 + np.exp(-faded_logits(logits, factor)))
    wanted = factor * alpha if factor <= 1.0 else 1.0 - (1.0 - alpha) ** factor
    np.testing.assert_allclose(faded, wanted, rtol=1e-8, atol=3e-9)
    ends = faded_logits(np.array([np.inf, -30.0, np.nan]), factor)
    assert np.isnan(ends[2]) and ends[1] <= -20.0
    if factor >= 1.0:
        assert ends[0] == np.inf, "what is opaque stays so"
    else:
        assert 1.0 / (1.0 + np.exp(-ends[0])) == pytest.approx(factor, abs=3e-9)


@pytest.mark.parametrize(
    ("name", "value"), [("exposure", 9.0), ("contrast", -0.1), ("hue", float("nan")), ("opacity", 5), ("falloff", -1)]
)
def test_a_value_out_of_range_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"{name} must be a finite number"):
        GradeOptions(**{name: value})
