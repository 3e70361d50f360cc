"""Edits and their timeline: going to a frame, and setting keys."""

from dataclasses import replace

from splap_editor.engine.edit import Edit


def edit_at_frame(edit: Edit, frame: float) -> Edit:
    """Pose the handles as at a frame of the edit's timeline; those without a key stay as they are.

    The timeline's own frame becomes the whole frame at or before it.
    """
    timeline = replace(edit.timeline, frame=int(frame))
    centers = {handle.handle_id: handle.region.center for handle in edit.handles}
    return replace(edit.with_poses(timeline.poses_at(frame, centers)), timeline=timeline)


def keyed_edit(edit: Edit, frame: int | None = None) -> Edit:
    """Keep the poses of all handles as the key of a frame, by default the one shown."""
    frame = edit.timeline.frame if frame is None else frame
    poses = {handle.handle_id: handle.pose for handle in edit.handles}
    return replace(edit, timeline=edit.timeline.with_key(frame, poses))


def auto_keyed_edit(before: Edit, after: Edit) -> Edit:
    """Set the key of the frame shown where a step poses handles and leaves the timeline alone.

    Without a key on the timeline, or with automatic keys off, the step stays as it is.
    """
    timeline = after.timeline
    if not (timeline.keys and timeline.is_auto) or timeline is not before.timeline:
        return after
    posed = {handle.handle_id: handle.pose for handle in before.handles}
    if all(posed.get(handle.handle_id, handle.pose) == handle.pose for handle in after.handles):
        return after
    return keyed_edit(after)
