"""What an export changed, in numbers a person can check."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.splats.splats import Splats


@dataclass(frozen=True)
class ExportReport:
    """Summary of a written file.

    Parameters
    ----------
    path : Path
    n_splats, n_changed : int
        Rows in the file, and rows that differ from the source.
    largest_displacement : float
        World units.
    largest_stretch : float
        Largest factor by which a splat's in-plane semi-axis grew or shrank; 1 when none did.
    """

    path: Path
    n_splats: int
    n_changed: int
    largest_displacement: float
    largest_stretch: float

    def __str__(self) -> str:
        if self.n_changed == 0:
            return f"{self.path.name}: {self.n_splats:,} splats, unchanged"
        return (
            f"{self.path.name}: {self.n_changed:,} of {self.n_splats:,} splats changed, "
            f"moved by up to {self.largest_displacement:.4g}, stretched by up to {self.largest_stretch:.3g} ×"
        )


def export_report(path: Path, splats: Splats, kernels: AdaptedKernels | None) -> ExportReport:
    """Compare adapted kernels with the splats they came from."""
    if kernels is None or not kernels.changed.any():
        return ExportReport(path, splats.n_splats, 0, 0.0, 1.0)
    rows = np.flatnonzero(kernels.changed)
    moved = kernels.means[rows] - np.asarray(splats.means, np.float64)[rows]
    with np.errstate(invalid="ignore", over="ignore"):
        growth = np.abs(np.asarray(kernels.log_scales)[rows] - np.asarray(splats.log_scales, np.float64)[rows])
    growth = growth[np.isfinite(growth)]
    return ExportReport(
        path,
        splats.n_splats,
        len(rows),
        float(np.linalg.norm(moved, axis=1).max()),
        float(np.exp(growth.max())) if growth.size else 1.0,
    )
