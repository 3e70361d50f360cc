"""What a recipe says of the camera: its keys, for videos."""

from typing import Any

from splap_editor.core.camera_path import CameraKey, CameraPose
from splap_editor.core.splats.splats import LARGEST_COORDINATE
from splap_editor.core.timeline import LAST_FRAME
from splap_editor.io.json_object import JsonObject

CAMERA_KEYS = ("frame", "position", "target", "up", "angle", "parallel")


def camera_from_json(recipe: JsonObject, key: str) -> tuple[CameraKey, ...]:
    """Camera keys of a recipe, ascending by frame."""
    keys: list[CameraKey] = []
    for held in recipe.objects(key, CAMERA_KEYS):
        frame = held.integer("frame", 0, low=1, high=LAST_FRAME)
        if keys and frame <= keys[-1].frame:
            raise held.refuse("frame", "after that of the key before")
        keys.append(CameraKey(frame, _pose(held)))
    return tuple(keys)


def _pose(held: JsonObject) -> CameraPose:
    position, target = (held.vector(key, 3, most=LARGEST_COORDINATE) for key in ("position", "target"))
    up = held.vector("up", 3, CameraPose.up, most=LARGEST_COORDINATE)
    angle = held.number("angle", CameraPose.angle, above=0.0)
    if angle >= 180.0:
        raise held.refuse("angle", "below 180 degrees")
    try:
        return CameraPose(position, target, up, angle, held.flag("parallel", CameraPose.is_parallel))
    except ValueError as error:
        is_up = str(error).startswith("up")
        raise held.refuse(
            "up" if is_up else "target", "a vector across the line of sight" if is_up else "away from the position"
        ) from None


def camera_to_json(keys: tuple[CameraKey, ...]) -> list[dict[str, Any]]:
    """Plain objects of camera keys; what is at its default is left out."""
    said = []
    for key in keys:
        pose, usual = key.pose, CameraPose
        held: dict[str, Any] = {"frame": key.frame, "position": list(pose.position), "target": list(pose.target)}
        if pose.up != usual.up:
            held["up"] = list(pose.up)
        if pose.angle != usual.angle:
            held["angle"] = pose.angle
        if pose.is_parallel:
            held["parallel"] = True
        said.append(held)
    return said


def camera_schema() -> dict[str, Any]:
    """JSON Schema of camera keys."""
    point = {"type": "number", "minimum": -LARGEST_COORDINATE, "maximum": LARGEST_COORDINATE}
    three = {"type": "array", "items": point, "minItems": 3, "maxItems": 3}
    return {
        "type": "array",
        "default": [],
        "description": "Where the camera stands at frames of a video, ascending by frame; smooth in between.",
        "items": {
            "type": "object",
            "properties": {
                "frame": {"type": "integer", "minimum": 1, "maximum": LAST_FRAME},
                "position": {**three, "description": "The eye, in the file's coordinates."},
                "target": {**three, "description": "The point looked at, away from the position."},
                "up": {
                    **three,
                    "contains": {"not": {"const": 0}},
                    "default": list(CameraPose.up),
                    "description": "To the top of the picture; not along the line of sight.",
                },
                "angle": {
                    "type": "number",
                    "exclusiveMinimum": 0,
                    "exclusiveMaximum": 180,
                    "default": CameraPose.angle,
                    "description": "Field of view from the lower to the upper edge, in degrees.",
                },
                "parallel": {"type": "boolean", "default": False, "description": "Orthographic."},
            },
            "required": ["frame", "position", "target"],
            "additionalProperties": False,
        },
    }
