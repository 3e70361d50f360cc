"""SuperSplat's compressed files decode to what was encoded, within the steps of their bits."""

import numpy as np
import pytest

from splap_editor.io.ply import read_ply
from tests.reference.ply import compressed_bytes, splat_columns


@pytest.fixture(params=[0, 9, 24, 45])
def pair(request, tmp_path):
    """Columns and the splats of their compressed file; two chunks, the second not full."""
    columns = splat_columns(300, np.random.default_rng(request.param), n_rest=request.param)
    # The ends of the ranges, and what compression clamps.
    columns["scale_0"][:2] = [-50, 50]
    columns["opacity"][:2] = [-50, 50]
    if request.param:
        columns["f_rest_0"][:2] = [-5, 5]
    (tmp_path / "a.ply").write_bytes(compressed_bytes(columns))
    return columns, read_ply(tmp_path / "a.ply")


def step(values, bits):
    """Half a step of the bits between the bounds of each chunk, with room for float32."""
    chunks = [values[:256], values[256:]]
    return np.concatenate([np.full(len(c), np.ptp(c) / (2**bits - 1) * 0.5 + 2e-6) for c in chunks])


def test_positions_and_scales_are_within_half_a_step(pair):
    columns, file = pair
    for c, bits in enumerate((11, 10, 11)):
        means = columns["xyz"[c]]
        assert (np.abs(file.splats.means[:, c] - means) <= step(means, bits)).all()
        scales = np.clip(columns[f"scale_{c}"], -20, 20)
        assert (np.abs(file.splats.log_scales[:, c] - scales) <= step(scales, bits)).all()


def test_colours_and_opacities_are_within_half_a_step(pair):
    columns, file = pair
    for c in range(3):
        colour = columns[f"f_dc_{c}"]
        assert (np.abs(file.splats.sh0[:, c] - colour) <= step(colour, 8) + 1e-5).all()
    alpha = 1 / (1 + np.exp(-columns["opacity"].astype(np.float64)))
    assert (np.abs(file.splats.opacities - alpha) <= 0.5 / 255 + 1e-6).all()
    assert file.splats.logit_opacities[0] == -np.inf
    assert file.splats.logit_opacities[1] == np.inf


def test_rotations_are_the_same_up_to_sign(pair):
    columns, file = pair
    quats = np.stack([columns[f"rot_{c}"] for c in range(4)], axis=1).astype(np.float64)
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    quats *= np.sign(quats[np.arange(300), np.abs(quats).argmax(axis=1)])[:, None]
    # Half a step of ten bits over √2 in three components, and what that moves the fourth.
    assert np.abs(file.splats.quats - quats).max() < 2 * np.sqrt(2) / 1023
    np.testing.assert_allclose(np.linalg.norm(file.splats.quats, axis=1), 1, atol=1e-6)  # float32


def test_harmonics_are_channel_major_bytes(pair):
    columns, file = pair
    n_coefficients = file.splats.shN.shape[1]
    assert 3 * n_coefficients == sum(name.startswith("f_rest_") for name in columns)
    for channel in range(3):
        for k in range(n_coefficients):
            values = np.clip(columns[f"f_rest_{channel * n_coefficients + k}"], -4, 4)
            # A byte covers 8/256; its first and last value stand for the very ends.
            assert np.abs(file.splats.shN[:, k, channel] - values).max() <= 8 / 256 + 1e-6


def test_chunks_without_colour_bounds_take_colours_as_they_are(tmp_path):
    columns = splat_columns(10, np.random.default_rng(0))
    columns |= {f"f_dc_{c}": np.linspace(-1, 1, 10, dtype="f4") / 0.6 for c in range(3)}
    data = compressed_bytes(columns)
    start = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:start]
    for end in ("min", "max"):
        for name in "rgb":
            header = header.replace(f"property float {end}_{name}\n".encode(), b"")
    (tmp_path / "old.ply").write_bytes(header + data[start : start + 48] + data[start + 72 :])
    splats = read_ply(tmp_path / "old.ply").splats
    packed = np.frombuffer(data[start + 72 :], "<u4").reshape(10, 4)[:, 3]
    red = (packed >> 24) / 255
    np.testing.assert_allclose(0.5 + 0.28209479177387814 * splats.sh0[:, 0], red, atol=1e-6)  # float32
