"""A slice of the campaign with a fixed seed: nothing crashes, hangs or leaves a traceback, no write breaks a file."""

import os
from collections import Counter
from math import inf

import pytest
from hypothesis import given, settings

from splap_editor.io.ply import read_ply, write_ply
from tests.campaign.display import display
from tests.campaign.inputs import Found, try_inputs
from tests.campaign.kinds import KINDS
from tests.campaign.seeds import odd_plys
from tests.campaign.writes import try_writes

N_INPUTS = 2400
N_WRITES = 48


def test_no_input_breaks_anything():
    with display() as where:
        found = try_inputs(20, range(N_INPUTS), inf, Found(), display=where, shown_share=60)
    assert found.failures == []
    assert found.counts["inputs"] == N_INPUTS
    # Without Xvfb there is nowhere to open a window.
    assert found.counts["windows"] >= 5 or where is None
    assert min(found.counts[f"{kind} accepted"] for kind in KINDS) > 3


@pytest.mark.skipif(not hasattr(os, "fork"), reason="writers are forked to start fast")
def test_no_write_that_is_cut_off_breaks_a_file():
    counts, failures = Counter(), []
    try_writes(20, N_WRITES, counts, failures)
    assert failures == []
    assert counts["kills"] >= 5 and counts["failed writes"] >= 5 and counts["power losses"] >= 5


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(odd_plys)
def test_odd_files_go_out_as_they_came_in(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("odd") / "scene.ply"
    path.write_bytes(data)
    file = read_ply(path)
    write_ply(path, file, file.splats)
    assert path.read_bytes() == data
