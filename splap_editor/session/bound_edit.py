"""What quantities of a scene are worked out from, and which of them can be exported."""

from splap_editor.engine.bound_edit import BoundEdit
from splap_editor.engine.quantities import QUANTITIES, Snapshot, missing
from splap_editor.session.scene import Scene


def snapshot_of(scene: Scene, bound: BoundEdit | None) -> Snapshot:
    """Hold on to all that quantities of a scene are worked out from.

    The weight asked for is that of the handle chosen last, else of the first.
    """
    weights, handle = None, None
    if bound is not None:
        weights = bound.weights
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
