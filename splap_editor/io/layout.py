"""What can be said of a trainer's files: where each part of a splat is, what it means, what gives the trainer away."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.thresholds import Thresholds, read_thresholds, sibling_npz

AXIS_NAMES: dict[int | None, str] = {None: "thinnest", 0: "0", 1: "1", 2: "2"}
"""Local axes that may be the surface normal, as they are written after a layout's name."""

CHOSEN = "chosen by hand"

THRESHOLDS_SHARE, SPLATS_SHARE = 0.1, 0.6
"""Shares of the work that are done once thresholds are read, and once the splats are made."""


class PlyEvidence:
    """What there is to recognise a layout by, and to read splats from: a table, and what lies beside the file.

    Parameters
    ----------
    table : PlyTable
    path : Path
        The file.
    progress : Progress
        Told the share done of reading what lies beside the file, making splats and looking them over; may cancel.
    """

    def __init__(self, table: PlyTable, path: Path, progress: Progress = no_progress) -> None:
        self.table = table
        self.path = path
        self.progress = progress

    @cached_property
    def thresholds(self) -> Thresholds | str | None:
        """SpikingGS thresholds beside the file; a sentence if they are of no use, None if there are none."""
        npz = sibling_npz(self.path)
        return (
            None
            if npz is None
            else read_thresholds(npz, self.table.n_rows, part_of(self.progress, 0.0, THRESHOLDS_SHARE))
        )

    @property
    def making(self) -> Progress:
        """Told the share of the splats made."""
        return part_of(self.progress, THRESHOLDS_SHARE, SPLATS_SHARE)

    def every(self, column: str, test: Callable[[np.ndarray], np.ndarray]) -> bool:
        """Whether every value of a column passes; a first look at a few spares most files the whole column."""
        values = self.table.columns[column]
        with np.errstate(invalid="ignore"):
            return bool(test(values[:64]).all() and test(values).all())


@dataclass(frozen=True)
class ColumnNames:
    """Names under which a trainer writes the parts of a splat, in the order of the arrays of `Splats`.

    Parameters
    ----------
    log_scales : tuple of 2 or 3 str
        Those that mean something; a 2DGS file may carry an idle third.
    sh0, rgb : tuple of 3 str
        Degree-0 coefficients, or instead colours: floats from 0 to 1, integers over their type's range.
    sh_rest : str
        What the higher coefficients' names begin with, a number after it: channel-major, ``f_rest_[c K + k]``.
    normals, filter_radius
        Read where they are there.
    """

    means: tuple[str, ...] = ("x", "y", "z")
    opacity: str = "opacity"
    log_scales: tuple[str, ...] = ("scale_0", "scale_1", "scale_2")
    quats: tuple[str, ...] = ("rot_0", "rot_1", "rot_2", "rot_3")
    sh0: tuple[str, ...] = ("f_dc_0", "f_dc_1", "f_dc_2")
    rgb: tuple[str, ...] = ("red", "green", "blue")
    sh_rest: str = "f_rest_"
    normals: tuple[str, ...] = ("nx", "ny", "nz")
    filter_radius: str = "filter_3D"

    def needed(self, names: Collection[str]) -> tuple[str, ...]:
        """Columns that a table with these names must have, colours in the one form or the other."""
        colours = () if set(self.rgb) <= set(names) else self.sh0
        return (*self.means, self.opacity, *self.log_scales, *self.quats, *colours)


COMMON_NAMES = ColumnNames()
"""What every program reads."""


@dataclass(frozen=True)
class Layout:
    """What a trainer's columns mean.

    Parameters
    ----------
    name : str
        Key of `splap_editor.io.layouts.LAYOUTS`.
    reason : str
        How it was recognised, as a clause: "two scales per splat"; in the table, what its columns show.
    splats : callable (evidence, layout) → splats, warnings
        Reads them; warnings are sentences.
    columns : ColumnNames, optional
        Where each part of a splat is. None for a packed table, whose cells cannot be changed one by one.
    packed : tuple of str
        Columns that a packed table must have.
    normal_axis : int, optional
        Local axis that is the surface normal, None for the thinnest one.
    activated_opacity : bool
        The opacity column holds α itself, not its logit.
    bound : bool
        Positions are relative to a mesh that the file does not hold.
    axis_is_chosen : bool
        A person chose the normal axis too.
    by_columns : callable (names) → bool, optional
        Whether the columns alone give it away.
    by_values : callable (evidence) → str, optional
        The reason, if the numbers give it away; empty if not.
    by_comments : tuple of str
        Beginnings of comments that do, in lower case.
    by_order : tuple of str
        Columns that do by following each other so.
    """

    name: str
    reason: str
    splats: Callable[[PlyEvidence, "Layout"], tuple[Splats, list[str]]]
    columns: ColumnNames | None = COMMON_NAMES
    packed: tuple[str, ...] = ()
    normal_axis: int | None = None
    activated_opacity: bool = False
    bound: bool = False
    axis_is_chosen: bool = False
    by_columns: Callable[[Collection[str]], bool] | None = None
    by_values: Callable[[PlyEvidence], str] | None = None
    by_comments: tuple[str, ...] = ()
    by_order: tuple[str, ...] = ()

    @property
    def n_scales(self) -> int:
        """Scales that mean something, 2 or 3."""
        return 3 if self.columns is None else len(self.columns.log_scales)

    @property
    def is_chosen(self) -> bool:
        """Whether a person chose it, against what would have been recognised."""
        return self.reason == CHOSEN

    @property
    def choice(self) -> str:
        """What ``read_ply(layout=...)`` takes to read the file like this again: ``"3dgs"``, or ``"3dgs@1"``."""
        axis = AXIS_NAMES[self.normal_axis]
        return f"{self.name}@{axis}" if self.axis_is_chosen else self.name

    def needed(self, names: Collection[str]) -> tuple[str, ...]:
        """Columns that a table with these names must have to be read so."""
        return self.packed if self.columns is None else self.columns.needed(names)

    def missing(self, names: Collection[str]) -> list[str]:
        """Those of them that it lacks."""
        return [name for name in self.needed(names) if name not in names]
