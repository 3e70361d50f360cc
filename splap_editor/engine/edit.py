"""The edit: handles and their poses, pins, options, what is removed, graded and where all stands, as one value."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.options import RepairOptions
from splap_editor.core.base_edit import BaseEdit
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.options import Length
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import CageOptions
from splap_editor.core.timeline import Timeline
from splap_editor.engine.grading import Grading
from splap_editor.engine.removal import Removal

HANDLE_COLORS = ("#f2a93b", "#4fb3ff", "#7bd66b", "#e66fb0", "#b18cff", "#ff7a59", "#30bfae", "#d9d24a")
"""Handle colours in the order they are given out; told apart by the colour-blind too when neighbours in the list."""

PIN_COLOR = "#e42460"
"""Colour of every pin; the colour-blind too tell it from handles, selection and what is under the pointer."""


@dataclass(frozen=True, eq=False)
class Handle:
    """Splats that the artist moves, and where to.

    Parameters
    ----------
    handle_id : int
        Stays the same through every change; never used twice in a session.
    name, color : str
        As listed; the colour as ``#rrggbb``.
    region : Region
        The splats, by centre and radius or by file rows. Compared by identity: a change of region is a new object.
    pose : Pose
        About the region's centre.
    enabled : bool
        A disabled handle neither moves nor holds anything and is not in the recipe.
    cage_radius : float, ShareOfSize or None
        Reach of the handle's weight, see `CageOptions`.
    frees : bool
        Whether the free radius is measured from it too; a pin put where something has moved holds it and frees nothing.
    """

    handle_id: int
    name: str
    color: str
    region: Region
    pose: Pose = field(default_factory=Pose)
    enabled: bool = True
    cage_radius: Length = CageOptions.cage_radius
    frees: bool = True

    @property
    def transform(self) -> NDArray[np.float64]:
        """(4, 4) world transform of the pose."""
        return self.pose.matrix(np.asarray(self.region.center, np.float64))

    @property
    def moved_center(self) -> NDArray[np.float64]:
        """(3,) where the pose brings the centre, world units."""
        return np.asarray(self.region.center, np.float64) + self.pose.translate


@dataclass(frozen=True, eq=False)
class Pin:
    """Splats that stay where they are.

    Parameters
    ----------
    pin_id : int
        Stays the same through every change.
    name : str
        As listed.
    region : Region
        The splats. Compared by identity: a change of region is a new object.
    reach : float, optional
        Radius, in world units, of the disc on the surface, or the ball, that the region is; None where it is neither.
    """

    pin_id: int
    name: str
    region: Region
    reach: float | None = None


@dataclass(frozen=True, eq=False)
class Edit(BaseEdit[Handle, Pin]):
    """Everything that decides the pose, as one immutable value; undo swaps references to it. `BaseEdit` with these.

    Parameters
    ----------
    timeline : Timeline
        Poses at other frames than the one shown.
    removal : Removal
        Splats that are left out of everything; handles, pins and mends go on counting in the file's rows.
    grading : Grading
        Colour grades; neither surface nor pose goes by them.
    """

    timeline: Timeline = field(default_factory=Timeline)
    removal: Removal = field(default_factory=Removal)
    grading: Grading = field(default_factory=Grading)

    @property
    def graph(self) -> GraphOptions:
        """What the scene's surface is made by."""
        return self.options[GraphOptions]

    def with_options(self, *groups: object) -> "Edit":
        """Replace some option groups."""
        return replace(self, options=self.options.with_groups(*groups))

    @property
    def active_handles(self) -> tuple[Handle, ...]:
        """The enabled handles."""
        return tuple(handle for handle in self.handles if handle.enabled)

    @property
    def transforms(self) -> NDArray[np.float64]:
        """(H, 4, 4) world transforms of the enabled handles."""
        return np.array([handle.transform for handle in self.active_handles]).reshape(-1, 4, 4)

    @property
    def repair(self) -> float:
        """Stretch beyond which splats are split in a file; 0 where none are."""
        return self.options[RepairOptions].repair

    @property
    def removed(self) -> FileMask | None:
        """(N,) splats that are left out; None where none are."""
        return self.removal.mask

    @property
    def is_identity(self) -> bool:
        """Whether a file is written as it was read: nothing is moved, left out, graded or put in another place."""
        is_at_rest = all(handle.pose.is_identity for handle in self.active_handles)
        return is_at_rest and self.removed is None and self.place.is_identity and self.grading.is_identity

    @property
    def needs_surface(self) -> bool:
        """Whether splats cannot be written without the surface: a handle holds some, or a grade fades along it."""
        return bool(self.active_handles) or self.grading.needs_surface

    @property
    def has_work(self) -> bool:
        """Whether there is anything a person made: handles and pins are work before anything is moved by them."""
        graph = self.graph
        mends = graph.cut or graph.add or graph.separate or graph.join
        return bool(self.handles or self.pins or mends) or not (self.timeline.is_empty and self.is_identity)

    def handle(self, handle_id: int) -> Handle:
        """Find a handle by its id; KeyError when there is none."""
        for handle in self.handles:
            if handle.handle_id == handle_id:
                return handle
        raise KeyError(handle_id)

    def with_handle(self, changed: Handle) -> "Edit":
        """Replace the handle of the same id, or append it."""
        if any(handle.handle_id == changed.handle_id for handle in self.handles):
            return replace(
                self, handles=tuple(changed if h.handle_id == changed.handle_id else h for h in self.handles)
            )
        return replace(self, handles=(*self.handles, changed))

    def without_handles(self, handle_ids: Iterable[int]) -> "Edit":
        """Drop the handles of these ids."""
        gone = set(handle_ids)
        return replace(self, handles=tuple(h for h in self.handles if h.handle_id not in gone))

    def pin(self, pin_id: int) -> Pin:
        """Find a pin by its id; KeyError when there is none."""
        for pin in self.pins:
            if pin.pin_id == pin_id:
                return pin
        raise KeyError(pin_id)

    def with_pin(self, changed: Pin) -> "Edit":
        """Replace the pin of the same id, or append it."""
        if any(pin.pin_id == changed.pin_id for pin in self.pins):
            return replace(self, pins=tuple(changed if p.pin_id == changed.pin_id else p for p in self.pins))
        return replace(self, pins=(*self.pins, changed))

    def without_pins(self, pin_ids: Iterable[int]) -> "Edit":
        """Drop the pins of these ids."""
        gone = set(pin_ids)
        return replace(self, pins=tuple(pin for pin in self.pins if pin.pin_id not in gone))

    def with_poses(self, poses: dict[int, Pose]) -> "Edit":
        """Pose some handles, by id."""
        return replace(
            self,
            handles=tuple(replace(h, pose=poses[h.handle_id]) if h.handle_id in poses else h for h in self.handles),
        )

    def next_handle_id(self) -> int:
        """Give an id that no handle of this edit has, nor any of its keys."""
        keyed = (handle_id for key in self.timeline.keys for handle_id in key.poses)
        return max((*(handle.handle_id for handle in self.handles), *keyed), default=0) + 1

    def next_pin_id(self) -> int:
        """Give an id that no pin of this edit has."""
        return max((pin.pin_id for pin in self.pins), default=0) + 1


def binds_like(a: Edit, b: Edit) -> bool:
    """Whether a deformer bound for one edit serves the other: same regions, pins and options it uses, any pose."""
    row = a.deformer
    if row != b.deformer or a.graph != b.graph or len(a.pins) != len(b.pins) or not a.removal.like(b.removal):
        return False
    if any(a.options[group] != b.options[group] for group in row.bound_by):
        return False
    left, right = a.active_handles, b.active_handles
    return (
        len(left) == len(right)
        and all(x.region is y.region for x, y in zip(a.pins, b.pins, strict=True))
        and all(
            x.region is y.region and x.frees == y.frees and (not row.has_weights or x.cage_radius == y.cage_radius)
            for x, y in zip(left, right, strict=True)
        )
    )


def poses_like(a: Edit, b: Edit) -> bool:
    """Whether two edits that bind alike also give the same kernels."""
    same_options = all(a.options[group] == b.options[group] for group in a.deformer.posed_by)
    return same_options and [h.pose for h in a.active_handles] == [h.pose for h in b.active_handles]


def writes_like(a: Edit, b: Edit) -> bool:
    """Whether two edits make the same file of the same splats."""
    is_alike = a.place == b.place and a.grading.like(b.grading) and a.repair == b.repair
    return is_alike and binds_like(a, b) and poses_like(a, b)
