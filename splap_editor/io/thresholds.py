"""SpikingGS thresholds, which its trainer leaves in an .npz beside the PLY."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import zipfile


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


def read_thresholds(npz: Path, n_splats: int) -> Thresholds | str:
    """Read the thresholds of the splats of a PLY.

    Parameters
    ----------
    npz : Path
        The trainer's archive.
    n_splats : int
        Rows of the PLY; the archive's rows must be the same ones.

    Returns
    -------
    Thresholds or str
        A sentence for the user if the archive is damaged, not SpikingGS's, or
        has other rows: the splats can be shown without thresholds.
    """
    import zipfile
    import zlib

    try:
        with zipfile.ZipFile(npz) as archive:
            if "Vth_pdf.npy" not in archive.namelist():
                return f"{npz.name} beside the file holds no Vth_pdf: it is read without thresholds."
            # The header is looked at first: a damaged one may promise more rows than the memory holds.
            n_rows = _n_values(archive, "Vth_pdf")
            if n_rows != n_splats:
                return (
                    f"{npz.name} holds {n_rows:,} thresholds for {n_splats:,} splats: it belongs to another save and "
                    "is not used. Put the archive of the same iteration beside the file."
                )
            cutoffs = np.abs(_values(archive, "Vth_pdf").astype(np.float32))
            floor = 0.0
            if "Vth_opa.npy" in archive.namelist() and _n_values(archive, "Vth_opa") == 1:
                floor = float(_values(archive, "Vth_opa")[0])
    except (OSError, ValueError, TypeError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        return f"{npz.name} beside the file cannot be read ({error}): its thresholds are not used."
    bad = np.flatnonzero(~np.isfinite(cutoffs))
    if len(bad):
        return f"{npz.name} holds {len(bad):,} thresholds that are not finite, first in row {bad[0]:,}: none is used."
    return Thresholds(cutoffs, floor if np.isfinite(floor) else 0.0)


def _n_values(archive: "zipfile.ZipFile", key: str) -> int:
    """Number of values that the header of an array in the archive promises."""
    with archive.open(key + ".npy") as member:
        version = np.lib.format.read_magic(member)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read_header(member)
    if dtype.kind not in "fiu":
        raise ValueError(f"{key} is not numeric")
    return int(np.prod(shape, dtype=object))


def _values(archive: "zipfile.ZipFile", key: str) -> NDArray:
    """Values of an array in the archive, flat."""
    with archive.open(key + ".npy") as member:
        return np.lib.format.read_array(member, allow_pickle=False).reshape(-1)
