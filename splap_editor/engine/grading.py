"""The colour grades of an edit: the steps that say them, and the splats that each is of in the open file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.grade import GradeStep, Share, graded_splats
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.removal import Finder as Find
from splap_editor.core.removal import RemovalStep, after_step, rows_step
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.removal import Finder

if TYPE_CHECKING:
    from splap_editor.engine.surface import Surface

LARGEST_STACK = 64
"""Grades that one edit may stack: each is worked out again for every picture of a slider that is dragged."""


@dataclass(frozen=True, eq=False)
class Grading:
    """Colour grades, one over the other, and what they come to in a file.

    Parameters
    ----------
    steps : tuple of GradeStep
        As a recipe has them.
    masks : tuple of (N,) bool or None
        The splats that each is of; None: all. Never written to.
    """

    steps: tuple[GradeStep, ...] = ()
    masks: tuple[FileMask | None, ...] = ()

    @property
    def is_identity(self) -> bool:
        """Whether everything looks as in the file."""
        return all(step.options.is_identity for step in self.steps)

    @property
    def needs_surface(self) -> bool:
        """Whether a grade fades out along the surface."""
        return any(
            mask is not None and step.options.falloff > 0.0 and not step.options.is_identity
            for step, mask in zip(self.steps, self.masks, strict=True)
        )

    @property
    def nbytes(self) -> int:
        """Memory of masks and of the rows that steps name."""
        rows = sum(getattr(step.picked, "rows", np.empty(0)).nbytes for step in self.steps)
        return rows + sum(mask.nbytes for mask in self.masks if mask is not None)

    def with_grade(self, mask: FileMask | None = None) -> Grading:
        """Put a grade at rest over the others, of the splats of a mask (N,), or of all.

        Raises
        ------
        ValueError
            There are as many as there may be.
        """
        if len(self.steps) >= LARGEST_STACK:
            raise ValueError(f"an edit may have {LARGEST_STACK} grades: delete one first")
        picked = None if mask is None else rows_step(mask).picked
        return Grading((*self.steps, GradeStep(picked=picked)), (*self.masks, mask))

    def with_options(self, index: int, options: GradeOptions) -> Grading:
        """Change what one grade does."""
        steps = list(self.steps)
        steps[index] = replace(steps[index], options=options)
        return Grading(tuple(steps), self.masks)

    def without(self, index: int) -> Grading:
        """Leave one grade out."""
        return Grading(self.steps[:index] + self.steps[index + 1 :], self.masks[:index] + self.masks[index + 1 :])

    def like(self, other: Grading) -> bool:
        """Whether both make the same of the same file."""
        if self is other or (self.is_identity and other.is_identity):
            return True
        return self.steps == other.steps

    def graded(self, splats: Splats, surface: Surface | None = None, progress: Progress = no_progress) -> Splats:
        """Grade splats of the file, at rest or posed; where nothing is graded they are the same object.

        Parameters
        ----------
        splats : Splats
        surface : Surface, optional
            Of the file's scene; needed for a falloff.
        progress : Progress
            Told the share done; may cancel.

        Raises
        ------
        ValueError
            A grade fades out along a surface that is not there.
        """
        if self.is_identity:
            return splats
        if self.needs_surface and surface is None:
            raise ValueError("a grade with a falloff needs the surface of the scene: prepare it first")
        shares = self._shares(surface, part_of(progress, 0.0, 0.5))
        return graded_splats(splats, shares, part_of(progress, 0.5, 1.0))

    def graded_so_far(self, splats: Splats, surface: Surface | None) -> Splats:
        """The same for a picture: while there is no surface yet a falloff is left out."""
        return splats if self.is_identity else graded_splats(splats, self._shares(surface))

    def _shares(
        self, surface: Surface | None, progress: Progress = no_progress
    ) -> list[tuple[GradeOptions, Share | None]]:
        found: list[tuple[GradeOptions, Share | None]] = []
        for step, mask in zip(self.steps, self.masks, strict=True):
            progress(len(found) / len(self.steps))
            share: Share | None = mask
            if mask is not None and surface is not None:
                share = faded_share(mask, step.options.falloff, surface)
            found.append((step.options, share))
        return found


_SHARES: WeakKeyDictionary[Surface, tuple[tuple[FileMask, float, NDArray[np.float32]], ...]] = WeakKeyDictionary()
"""Of the surfaces that are in use: a slider asks for the same again and again."""

_KEPT_SHARES = 8


def faded_share(mask: FileMask, falloff: float, surface: Surface) -> Share:
    """Find the share to which each splat of a file is graded.

    Parameters
    ----------
    mask : (N,) bool
        Splats that are graded fully. Never written to.
    falloff : float
        Length along the surface over which it fades, in the file's units; 0: not at all.
    surface : Surface

    Returns
    -------
    (N,) float32 or bool
        In [0, 1], smooth at both ends. Inert splats have the mean of the nodes that carry them. Where no path leads to
        a graded splat, and where none of those is part of the surface, nothing fades in.
    """
    if falloff <= 0.0 or mask.all() or not mask.any():
        return mask
    kept = _SHARES.get(surface, ())
    for known, length, shares in kept:
        if known is mask and length == falloff:
            return shares
    shares = _faded_share(mask, falloff, surface)
    _SHARES[surface] = (*kept, (mask, falloff, shares))[-_KEPT_SHARES:]
    return shares


def _faded_share(mask: FileMask, falloff: float, surface: Surface) -> NDArray[np.float32]:
    # It brings the compiler with it, which who only reads a recipe shall not wait for.
    from splap_editor.core.surface.geodesics import geodesic_distances
    from splap_editor.engine.quantities import splat_weights

    sources = np.flatnonzero(mask[surface.ellipses.rows])
    distances = geodesic_distances(surface.graph, sources, limit=falloff)
    near = np.clip(1.0 - distances / falloff, 0.0, 1.0)
    shares = splat_weights(surface, (near * near * (3.0 - 2.0 * near))[:, None], 0).astype(np.float32)
    shares[mask] = 1.0
    return shares


def grading_of(
    steps: Iterable[GradeStep], splats: Splats, removed: FileMask | None = None, find: Find | None = None
) -> Grading:
    """Find the splats of a file that the grades of a recipe are of.

    Parameters
    ----------
    steps : iterable of GradeStep
    splats : Splats
        All of the file's.
    removed : (N,) bool, optional
        Splats that are left out, which quantities take no account of.
    find : callable, optional
        As of `splap_editor.engine.removal.removal_of`.

    Raises
    ------
    ValueError
        A row is not in the file, a quantity does not exist, or there are too many steps.
    """
    steps = tuple(steps)
    if len(steps) > LARGEST_STACK:
        raise ValueError(f"an edit may have {LARGEST_STACK} grades, not {len(steps)}")
    left_out = np.zeros(splats.n_splats, bool) if removed is None else removed
    masks: list[FileMask | None] = []
    for step in steps:
        if step.picked is None:
            masks.append(None)
            continue
        picked = RemovalStep(step.picked, step.outside)
        # As a removal would take them, from among those that are left.
        masks.append(after_step(left_out, picked, splats.means, find or Finder(splats)) & ~left_out)
    return Grading(steps, tuple(masks))
