"""What a format cannot hold of a file, said before it is saved."""

from collections.abc import Iterator

import numpy as np

from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.table import SplatFormat
from splap_editor.io.layout import COMMON_NAMES
from splap_editor.io.ply import SplatFile
from splap_editor.io.ply_table import PlyTable

_SHOWN = 6
_IDLE = ("nx", "ny", "nz")


def losses(
    file: SplatFile, splats: Splats, bare: Splats, n_unusable: int, row: SplatFormat, *, is_kept: bool = False
) -> list[str]:
    """Say what saving in a format loses, each as a sentence.

    Parameters
    ----------
    file : SplatFile
        What the splats were read as.
    splats, bare : Splats
        What is to be saved, and the same after `bare_splats`.
    n_unusable : int
        What `bare_splats` counted.
    row : SplatFormat
        Where to.
    is_kept : bool
        The file was one of that format, and its rows keep their order.
    """
    if row.is_lossless:
        return []
    found = list(_losses(file, splats, bare, n_unusable, row))
    if row.rounds:
        again = " once more, those of splats that stay as they were too" if is_kept else ""
        found.append(f"Numbers are rounded{again}: {row.rounds}.")
    if row.reorders and not is_kept:
        found.append("Rows stand in another order: recipes and sessions that name rows do not fit this file.")
    return found


def _losses(file: SplatFile, splats: Splats, bare: Splats, n_unusable: int, row: SplatFormat) -> Iterator[str]:
    """What is lost of these splats; what happens to any is left to `losses`."""
    smallest, largest = row.log_scales
    if splats.n_scales == 2:
        yield f"Flat splats (2DGS) become discs {np.exp(smallest):.0e} thick."
    if n_unusable:
        yield f"{_splats(n_unusable)} without a usable rotation, scale or opacity: invisible from then on."
    if splats.thresholds is not None:
        yield "The thresholds of SpikingGS are not kept: splats reach farther than they did."
    if splats.filter_radii is not None:
        yield "The filter_3D column is worked into scales and opacities."
    if splats.sh_degree > row.largest_degree:
        yield f"Spherical harmonics above degree {row.largest_degree} are not kept."
    other = _other_columns(file.table)
    if other:
        more = f" and {len(other) - _SHOWN} more" if len(other) > _SHOWN else ""
        yield f"Columns that are no part of a splat are not kept: {', '.join(other[:_SHOWN])}{more}."
    of_splats = {"vertex"} if file.layout.columns is not None else {"vertex", "chunk", "sh"}
    names = [element.name for element in file.table.header.elements if element.name not in of_splats]
    if names:
        yield f"Elements beside the splats are not kept: {', '.join(names[:_SHOWN])}."
    # The thin scale of a flat splat is said already.
    with np.errstate(invalid="ignore"):
        small = int((np.asarray(splats.log_scales) < smallest - 1e-6).any(axis=1).sum())
    large = int((bare.log_scales > largest).any(axis=1).sum())
    if small:
        yield f"{_splats(small)} thinner than {np.exp(smallest):.2g}: made that thick."
    if large:
        yield f"{_splats(large)} larger than {np.exp(largest):.3g}: made that small."
    least, most = row.colors
    if np.isfinite(least):
        pale = int(((bare.sh0 < least) | (bare.sh0 > most)).any(axis=1).sum())
        if pale:
            yield f"{_splats(pale)} of a colour too bright or too dark: made as bright or dark as can be."


def _splats(n: int) -> str:
    return f"{n:,} splats are" if n > 1 else "1 splat is"


def _other_columns(table: PlyTable) -> list[str]:
    """Columns that no splat is made of; normals that are zero say nothing."""
    names = COMMON_NAMES
    known = {*names.means, names.opacity, *names.log_scales, *names.quats, *names.sh0, *names.rgb, names.filter_radius}
    found = []
    for name, values in table.columns.items():
        if name in known or name.startswith((names.sh_rest, "packed_")):
            continue
        if name in _IDLE and not values.any():
            continue
        found.append(name)
    return found
