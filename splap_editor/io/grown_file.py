"""A splat file with copies of some of its rows after its own."""

from dataclasses import replace

import numpy as np

from splap_editor.core.index_spaces import FileRows
from splap_editor.io.ply import SplatFile
from splap_editor.io.splat_cells import plain_table


def grown_file(file: SplatFile, rows: FileRows) -> SplatFile:
    """Put copies of some rows after all those of a file: its columns, lists and further elements stay as they are.

    Parameters
    ----------
    file : SplatFile
    rows : (M,) int64
        May name a row several times.

    Returns
    -------
    SplatFile
        Of N + M rows. A compressed PLY, whose rows are no copies of each other, has the columns of a plain one.
    """
    splats = file.splats.at(np.concatenate([np.arange(file.splats.n_splats), rows]))
    is_plain = file.layout.columns is not None
    table = file.table.with_copies(rows) if is_plain else plain_table(file.table.name, splats)
    return replace(file, splats=splats, table=table)
