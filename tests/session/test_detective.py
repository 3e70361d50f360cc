"""What is odd about splats, and how far to trust their graph."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.io.ply import read_ply, write_ply
from splap_editor.resources import resource
from splap_editor.session.detective import oddities, reading, round_rows, verdict


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """The tube with a third scale."""
    flat = read_ply(resource("samples", "tube.ply"))
    path = tmp_path_factory.mktemp("thick") / "tube.ply"
    write_ply(path, flat, flat.splats, as_3dgs=True)
    return path


@pytest.fixture(scope="module")
def file(path):
    return read_ply(path)


def with_rows(array, rows, value):
    changed = np.array(array)
    changed[rows] = value
    return changed


def test_each_oddity_names_its_rows(file):
    splats = file.splats
    broken = replace(
        splats,
        means=with_rows(splats.means, [11], splats.means[10]),
        quats=with_rows(splats.quats, [3, 4], 0.0),
        logit_opacities=with_rows(splats.logit_opacities, [7, 8, 9], -20.0),
        log_scales=with_rows(splats.log_scales, [20], -3.0),
    )
    found = {oddity.sentence: oddity.rows.tolist() for oddity in oddities(broken, occupancy_ellipses(broken))}
    assert found["2 splats have a zero rotation."] == [3, 4]
    assert found["1 splat has the position of an earlier splat."] == [11]
    faint = next(sentence for sentence in found if "too faint" in sentence)
    assert faint.startswith("3 splats are") and "0.12 % of all" in faint and found[faint] == [7, 8, 9]
    assert 20 in found[next(sentence for sentence in found if "nearly round" in sentence)]


def test_the_verdict_follows_the_flatness(file):
    splats = file.splats

    def of_thickness(share):
        scales = np.tile(np.log([1.0, 0.8, 0.8 * share]), (splats.n_splats, 1)).astype(np.float32)
        return verdict(replace(splats, log_scales=scales))

    words = [of_thickness(share) for share in (0.01, 0.2, 0.45, 0.95)]
    assert len({sentence for sentence, _ in words}) == 4
    assert [tone for _, tone in words] == ["", "", "warning", "warning"]
    assert len(round_rows(replace(splats, log_scales=splats.log_scales[:, :2]))) == 0


def test_the_reading_says_activations_and_normal(path):
    plain, turned = read_ply(path), read_ply(path, layout="spikinggs@0")
    assert reading(plain.layout, plain.splats).endswith("opacities through a sigmoid; the thinnest axis is the normal")
    assert reading(turned.layout, turned.splats).endswith("opacities as they are; axis 0 is the normal")


def test_the_verdict_warns_of_haze_and_of_thick_splats_among_flat_ones(file):
    splats = file.splats
    n = splats.n_splats
    thin = np.tile(np.log([1.0, 0.8, 0.16]), (n, 1)).astype(np.float32)
    mixed = thin.copy()
    mixed[: n // 10, 2] = np.log(0.7)
    hazy = np.full(n, 3.0, np.float32)
    hazy[: n // 10] = -3.0
    words, tone = verdict(replace(splats, log_scales=mixed, logit_opacities=np.full(n, 3.0, np.float32)))
    assert tone == "warning" and "mixed" in words
    words, tone = verdict(replace(splats, log_scales=thin, logit_opacities=hazy))
    assert tone == "warning" and words.startswith("Haze: 10% of the splats")
    assert verdict(replace(splats, log_scales=np.log([[1.0, 0.8, 0.01]]).repeat(n, 0), logit_opacities=hazy))[1] == ""
