"""The undoable steps: each a swap between a value before and a value after."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.handle_nodes import Region
from splap_editor.core.index_spaces import FileMask
from splap_editor.engine.edit import Edit
from splap_editor.session.history import Command
from splap_editor.session.scene import Scene

EDIT_BYTES = 2048
"""What an edit costs beside the rows of its regions, about."""


@dataclass(eq=False)
class ChangeEdit:
    """Handles, poses, pins, graph mends or options changed; undo chooses again what was, where nothing is chosen."""

    scene: Scene
    before: Edit
    after: Edit
    label: str
    _chosen: tuple[tuple[int, ...], tuple[int, ...]] = field(init=False)

    def __post_init__(self) -> None:
        self._chosen = self.scene.active_handles, self.scene.active_pins

    @property
    def nbytes(self) -> int:
        """Rows that only the state before or after holds, and a little."""
        shared = {id(region) for region in _regions(self.before)} & {id(region) for region in _regions(self.after)}
        rows = sum(
            np.asarray(region.rows).nbytes
            for edit in (self.before, self.after)
            for region in _regions(edit)
            if region.rows is not None and id(region) not in shared
        )
        removals = {id(edit.removal): edit.removal for edit in (self.before, self.after)}
        removed = sum(removal.nbytes for removal in removals.values()) if len(removals) > 1 else 0
        gradings = {id(edit.grading): edit.grading for edit in (self.before, self.after)}
        graded = sum(grading.nbytes for grading in gradings.values()) if len(gradings) > 1 else 0
        return EDIT_BYTES + rows + removed + graded

    def do(self) -> None:
        """Put the changed edit in place."""
        self.scene.set_edit(self.after)

    def undo(self) -> None:
        """Put the edit from before back."""
        self.scene.set_edit(self.before)
        if not (self.scene.active_handles or self.scene.active_pins):
            self.scene.set_active_handles(*self._chosen)


@dataclass(eq=False)
class StandUp(ChangeEdit):
    """The whole scene was turned, so that up is elsewhere in it."""

    up_before: tuple[float, float, float]
    up_after: tuple[float, float, float]

    def do(self) -> None:
        """Turn it."""
        self.scene.up = self.up_after
        super().do()
        self.scene.up_changed.emit()

    def undo(self) -> None:
        """Turn it back."""
        self.scene.up = self.up_before
        super().undo()
        self.scene.up_changed.emit()


class ChangeTogether:
    """Several changes as one step."""

    def __init__(self, commands: Sequence[Command], label: str) -> None:
        self.label = label
        self._commands = tuple(commands)

    @property
    def nbytes(self) -> int:
        """What they keep alive together."""
        return sum(command.nbytes for command in self._commands)

    def do(self) -> None:
        """Put them in place one after the other."""
        for command in self._commands:
            command.do()

    def undo(self) -> None:
        """Take them back, the last one first."""
        for command in reversed(self._commands):
            command.undo()


class ChangeMask:
    """The selection or the hidden splats changed; the masks are kept eight splats to a byte."""

    def __init__(self, scene: Scene, name: str, after: FileMask, label: str) -> None:
        self.label = label
        self._scene = scene
        self._name = name
        self._before = np.packbits(getattr(scene, name))
        self._after = np.packbits(after)

    @property
    def nbytes(self) -> int:
        """Both packed masks."""
        return self._before.nbytes + self._after.nbytes

    def do(self) -> None:
        """Put the changed mask in place."""
        self._set(self._after)

    def undo(self) -> None:
        """Put the mask from before back."""
        self._set(self._before)

    def _set(self, packed: NDArray[np.uint8]) -> None:
        mask = np.unpackbits(packed, count=self._scene.splats.n_splats).astype(bool)
        getattr(self._scene, f"set_{self._name}")(mask)


class ChangeSelectionSets:
    """A selection was kept by name, or forgotten."""

    def __init__(self, scene: Scene, after: Mapping[str, FileMask], label: str) -> None:
        self.label = label
        self._scene = scene
        self._before = scene.selection_sets
        self._after = dict(after)

    @property
    def nbytes(self) -> int:
        """Masks that only the state before or after holds."""
        masks = {id(mask): mask.nbytes for sets in (self._before, self._after) for mask in sets.values()}
        shared = {id(mask) for mask in self._before.values()} & {id(mask) for mask in self._after.values()}
        return sum(nbytes for key, nbytes in masks.items() if key not in shared)

    def do(self) -> None:
        """Put the changed sets in place."""
        self._scene.set_selection_sets(self._after)

    def undo(self) -> None:
        """Put the sets from before back."""
        self._scene.set_selection_sets(self._before)


def _regions(edit: Edit) -> Iterator[Region]:
    yield from (pin.region for pin in edit.pins)
    yield from (handle.region for handle in edit.handles)
