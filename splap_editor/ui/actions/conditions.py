"""Conditions of the action table that a scene meets or not."""

from splap_editor.session.scene import Scene


def scene_meets(scene: Scene, condition: str) -> bool:
    """Whether a scene has what an action needs."""
    if condition == "scene":
        return True
    if condition == "selection":
        return bool(scene.selection.any())
    if condition == "surface_selection":
        return scene.surface is not None and bool(scene.selection.any())
    if condition == "hidden":
        return bool(scene.hidden.any())
    if condition == "weights":
        return scene.edit.method == "bbw" and bool(scene.edit.handles)
    if condition == "handles":
        return bool(scene.edit.handles)
    if condition == "keys":
        return bool(scene.edit.timeline.keys)
    if condition == "key":
        return scene.edit.timeline.frame in scene.edit.timeline.key_frames
    if condition == "pins":
        return bool(scene.edit.pins)
    if condition == "active_handles":
        return bool(scene.active_handles)
    raise ValueError(f"unknown condition {condition!r}")
