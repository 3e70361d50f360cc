"""What is written of a scene: its splats as posed, graded, repaired and placed, and the file they are the rows of."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.index_spaces import FileMask, FileRows
from splap_editor.core.place import placed_splats
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.bound_edit import unplaced_splats
from splap_editor.engine.edit import Edit
from splap_editor.engine.surface import Surface
from splap_editor.io.grown_file import grown_file
from splap_editor.io.splat_files import SplatFile


@dataclass(frozen=True, eq=False)
class WrittenScene:
    """Splats to write, and the file that they are the rows of.

    Parameters
    ----------
    file : SplatFile
        The one that was read; after its rows, where splats are split, copies of these.
    splats : Splats
    removed : FileMask or None
        Rows that are left out.
    copied : (M,) int64
        Row of the file that was read of which each new one is a copy.
    n_split : int
    """

    file: SplatFile
    splats: Splats
    removed: FileMask | None
    copied: FileRows
    n_split: int = 0

    def with_copies(self, columns: Mapping[str, ArrayLike]) -> dict[str, NDArray]:
        """Columns (N,) of the file that was read, for the new rows too."""
        held = {name: np.asarray(values) for name, values in columns.items()}
        return {name: np.concatenate([values, values[self.copied]]) for name, values in held.items()}


def written_scene(
    file: SplatFile,
    kernels: AdaptedKernels | None,
    edit: Edit,
    surface: Surface | None = None,
    progress: Progress = no_progress,
) -> WrittenScene:
    """Make what is written of a scene.

    Parameters
    ----------
    file : SplatFile
    kernels : AdaptedKernels or None
        None where everything is at rest.
    edit : Edit
        As of `splap_editor.engine.scripting.write_posed`.
    surface : Surface, optional
        Needed by a grade's falloff.
    progress : Progress
        Told the share done; may cancel.
    """
    splats = unplaced_splats(file.splats, kernels, edit, surface, part_of(progress, 0.0, 0.6))
    removed, n_split = edit.removed, 0
    copied: FileRows = np.empty(0, np.int64)
    if edit.repair and kernels is not None:
        # Only who repairs waits for it.
        from splap_editor.core.adaptation.repair import repaired

        repair = repaired(splats, kernels, edit.repair, part_of(progress, 0.6, 0.7))
        if repair is not None:
            splats, copied, n_split = repair.splats, repair.copied, repair.n_split
            file = grown_file(file, copied)
            # What is left out has no ellipse that could be split.
            removed = None if removed is None else np.concatenate([removed, np.zeros(len(copied), np.bool_)])
    placed = placed_splats(splats, edit.place, part_of(progress, 0.7, 1.0))
    return WrittenScene(file, placed, removed, copied, n_split)
