"""A deformer ready to pose, and what it was made for."""

from dataclasses import dataclass

from splap_editor.core.deformer import Deformer, Handles
from splap_editor.engine.edit import Edit
from splap_editor.engine.quantities import QUANTITIES, Snapshot, missing
from splap_editor.session.scene import Scene


@dataclass(frozen=True, eq=False)
class BoundEdit:
    """A deformer, and the edit it was bound for."""

    edit: Edit
    handles: Handles
    deformer: Deformer


def snapshot_of(scene: Scene, bound: BoundEdit | None) -> Snapshot:
    """Hold on to all that quantities of a scene are worked out from.

    The weight asked for is that of the handle chosen last, else of the first.
    """
    weights, handle = None, None
    if bound is not None:
        weights = getattr(bound.deformer, "weights", None)
        held = [each.handle_id for each in bound.edit.active_handles]
        chosen = [held.index(handle_id) for handle_id in scene.active_handles if handle_id in held]
        handle = chosen[-1] if chosen else 0 if held else None
    return Snapshot(
        scene.splats,
        scene.ellipses,
        scene.surface,
        scene.kernels,
        bound.handles if bound is not None else None,
        weights,
        handle,
        scene.picked,
    )


def column_lacks(scene: Scene, bound: BoundEdit | None) -> dict[str, str]:
    """What each quantity lacks to become a column of the exported file, by name; empty where it can."""
    snapshot, taken = snapshot_of(scene, bound), scene.file.table.columns
    return {
        name: "another name: the file has such a column" if name in taken else missing(quantity, snapshot)
        for name, quantity in QUANTITIES.items()
    }
