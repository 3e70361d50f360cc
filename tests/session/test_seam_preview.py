"""The line of a seam is the shortest way over its contacts."""

import numpy as np
import pytest

from splap_editor.session.seam_preview import seam_line


def test_the_line_joins_what_lies_beside_each_other_and_coincident_contacts_too():
    along = np.random.default_rng(0).permutation([0.0, 0.1, 0.1, 0.3, 0.35, 0.7])
    middles = np.column_stack([along, 2.0 * along, np.zeros(6)])
    line, length = seam_line(middles)
    assert length == pytest.approx(0.7 * np.sqrt(5.0))
    assert len(line) == 5 and set(line.ravel().tolist()) == set(range(6))
    assert [len(part) for part in map(np.atleast_1d, seam_line(middles[:1]))] == [0, 1]
