"""Which splats give most to a picture, from wherever it is seen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import RowsByPlace
from splap_editor.viewport.glyphs import Glyphs


@dataclass(frozen=True, eq=False)
class Contribution:
    """Splats in order of what they give to a picture, the most first.

    Parameters
    ----------
    rows : (N,) int32
        A permutation of the file rows.
    covered : (N,) float32
        Share of the area of all that the splats up to this place cover, ascending to 1.
    """

    rows: RowsByPlace
    covered: NDArray[np.float32]

    def share(self, n: int) -> float:
        """Share of the area of all splats that the first ``n`` cover."""
        return float(self.covered[n - 1]) if n else 0.0


def contribution(glyphs: Glyphs, colors: NDArray[np.uint8]) -> Contribution:
    """Order splats by opacity × area at rest; the view does not matter, so that it is done once per scene.

    Parameters
    ----------
    glyphs : Glyphs
        Shapes at rest.
    colors : (N, 4) uint8
        The fourth is the opacity.
    """
    # The area of a splat that may be read goes beyond what single precision holds.
    u, v = np.asarray(glyphs.axes_u, np.float64), np.asarray(glyphs.axes_v, np.float64)
    areas = np.linalg.norm(np.cross(u, v), axis=1) * np.square(glyphs.cutoffs, dtype=np.float64)
    rows = np.argsort(-areas * colors[:, 3], kind="stable").astype(np.int32)
    covered = np.cumsum(areas[rows], dtype=np.float64)
    if len(covered) and covered[-1] > 0.0:
        covered /= covered[-1]
    return Contribution(rows, covered.astype(np.float32))
