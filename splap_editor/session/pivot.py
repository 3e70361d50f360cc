"""The point that the chosen handles turn and scale about."""

from collections.abc import Sequence
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from splap_editor.engine.edit import Handle


class Pivot(Enum):
    """Which point that is: the mean of the chosen handles, the active one of them, or one placed by hand."""

    MEDIAN = "median"
    ACTIVE = "active"
    POINT = "point"


def pivot_point(pivot: Pivot, placed: NDArray[np.float64] | None, chosen: Sequence[Handle]) -> NDArray[np.float64]:
    """(3,) world point that these handles, of which the last is the active one, turn about.

    A point that was not placed yet is the mean.
    """
    if pivot is Pivot.POINT and placed is not None:
        return placed
    if pivot is Pivot.ACTIVE:
        return chosen[-1].moved_center
    return np.mean([handle.moved_center for handle in chosen], axis=0)
