"""SpikingGS thresholds, which its trainer leaves in an .npz beside the PLY."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress


@dataclass(frozen=True, eq=False)
class Thresholds:
    """What the sibling file says.

    Parameters
    ----------
    cutoffs : (N,) float32
        ``V = |Vth_pdf|``: the kernel is zero where it falls below.
    opacity_floor : float
        ``Vth_opa``: splats of lower opacity are not drawn; 0 if the file has none.
    """

    cutoffs: NDArray[np.float32]
    opacity_floor: float


def sibling_npz(path: str | os.PathLike[str]) -> Path | None:
    """Find the .npz that belongs to a PLY: of the same stem, or the trainer's ``point_cloud.npz``."""
    path = Path(path)
    candidates = (path.with_suffix(".npz"), path.with_name("point_cloud.npz"))
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def read_thresholds(npz: Path, n_splats: int, progress: Progress = no_progress) -> Thresholds | str:
    """Read the thresholds of the splats of a PLY.

    Parameters
    ----------
    npz : Path
        The trainer's archive.
    n_splats : int
        Rows of the PLY; the archive's rows must be the same ones.
    progress : Progress
        Told the share of an array for each MiB of it; may cancel.

    Returns
    -------
    Thresholds or str
        A sentence for the user if the archive is damaged, not SpikingGS's, or
        has other rows: the splats can be shown without thresholds.
    """
    # Only SpikingGS has such a file; reading any other needs no zip reader.
    from splap_editor.io.npz import NpzError, NpzFile
    from splap_editor.io.regular_file import open_regular

    try:
        with open_regular(npz) as file:
            # As many numbers as the splats need, and what little more an archive may hold.
            archive = NpzFile(file, most_bytes=16 * n_splats + 1024, progress=progress)
            if "Vth_pdf" not in archive.names:
                return f"{npz.name} beside the file holds no Vth_pdf: it is read without thresholds."
            n_rows = math.prod(archive.shape("Vth_pdf"))
            if n_rows != n_splats:
                return (
                    f"{npz.name} holds {n_rows:,} thresholds for {n_splats:,} splats: it belongs to another save and "
                    "is not used. Put the archive of the same iteration beside the file."
                )
            cutoffs = np.abs(archive.array("Vth_pdf").reshape(-1).astype(np.float32))
            floor = 0.0
            if "Vth_opa" in archive.names and math.prod(archive.shape("Vth_opa")) == 1:
                floor = float(archive.array("Vth_opa").reshape(-1)[0])
    except (OSError, NpzError, MemoryError) as error:
        return f"{npz.name} beside the file cannot be read ({error}): its thresholds are not used."
    bad = np.flatnonzero(~np.isfinite(cutoffs))
    if len(bad):
        return f"{npz.name} holds {len(bad):,} thresholds that are not finite, first in row {bad[0]:,}: none is used."
    return Thresholds(cutoffs, floor if np.isfinite(floor) else 0.0)
