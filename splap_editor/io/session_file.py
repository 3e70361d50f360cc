"""Session files (``.splap``): JSON beside the PLY that the edit belongs to."""

import base64
import binascii
import math
import os
import re
from pathlib import Path
from typing import Any

import numpy as np

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.timeline import LAST_FRAME, Key, Timeline
from splap_editor.io.atomic_file import whole_file
from splap_editor.io.json_object import JsonObject, Look, json_lines, no_look, parsed_json, shown
from splap_editor.io.recipe import RecipeError, pose_from_json, pose_to_json, recipe_from_json, recipe_to_json
from splap_editor.io.regular_file import regular_bytes
from splap_editor.io.session_specs import (
    HandleSettings,
    PinSettings,
    PlySpec,
    Scalar,
    SessionFile,
    ViewSpec,
)

FORMAT = "splap-session"
VERSION = 1
SUFFIX = ".splap"

_KEYS = (
    "format",
    "version",
    "ply",
    "recipe",
    "handles",
    "pins",
    "active_handles",
    "active_pins",
    "timeline",
    "view",
    "display",
    "selection",
    "hidden",
    "selection_sets",
    "document",
)


class SessionFileError(ValueError):
    """A session file that cannot be read or written; the message is one sentence for the user."""


def read_session_file(path: str | os.PathLike[str], progress: Progress = no_progress) -> SessionFile:
    """Read a session file; the PLY it names is not looked at.

    ``progress`` is told the share of bytes read, and now and then while they
    are parsed, which takes seconds for the largest; it may cancel.

    Raises
    ------
    SessionFileError
        If it cannot be read, is none, or was written by a newer editor.
    """
    path = Path(path)

    def look() -> None:
        progress(0.5)

    try:
        data = regular_bytes(path, progress=part_of(progress, 0.0, 0.5))
    except OSError as error:
        raise SessionFileError(f"{path} cannot be read: {error.strerror or error}. Check the path.") from error
    try:
        session = session_from_json(parsed_json(data, SessionFileError, look), look)
    except SessionFileError as error:
        raise SessionFileError(f"{path.name}: {error}.") from None
    progress(1.0)
    return session


def write_session_file(path: str | os.PathLike[str], session: SessionFile) -> None:
    """Write a session file, whole or not at all.

    Raises
    ------
    SessionFileError
        If it cannot be written, or could not be read again.
    """
    held = session_to_json(session)
    session_from_json(held)
    try:
        data = json_lines(held).encode()
    except UnicodeEncodeError:
        raise SessionFileError(f"{session.ply.path!r} is not a name that can be written: rename the PLY") from None
    with whole_file(path, SessionFileError) as file:
        file.write(data)


def relative_path(path: Path, folder: Path) -> str:
    """Way from a folder to a file with forward slashes; absolute where there is none, as between Windows drives."""
    path = Path(os.path.abspath(path))
    try:
        return Path(os.path.relpath(path, os.path.abspath(folder))).as_posix()
    except ValueError:
        return path.as_posix()


def session_from_json(value: Any, look: Look = no_look) -> SessionFile:
    """Make a session of what ``json`` parsed.

    Raises
    ------
    SessionFileError
        For anything else than a session of this version.
    """
    if not isinstance(value, dict) or value.get("format") != FORMAT:
        raise SessionFileError("it is not a SpLap session")
    version = value.get("version")
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise SessionFileError(f"version must be {VERSION}, got {shown(version)}")
    if version > VERSION:
        raise SessionFileError(f"it was saved by a newer SpLap Editor (version {version}, this one reads {VERSION})")
    session = JsonObject(value, "", _KEYS, SessionFileError, look)
    ply = _ply(session.object("ply", ("path", "hash", "n_splats", "layout")))
    try:
        recipe = recipe_from_json(value.get("recipe", {}), look)
    except RecipeError as error:
        raise SessionFileError(f"recipe: {error}") from None
    handles = tuple(_handle(h) for h in session.objects("handles", ("id", "color", "enabled")))
    ids = [handle.handle_id for handle in handles]
    if len(handles) != len(recipe.handles) or len(set(ids)) < len(ids):
        raise SessionFileError(f"handles must name each of the {len(recipe.handles)} handles of the recipe once")
    pins = tuple(_pin(pin) for pin in session.objects("pins", ("id", "reach")))
    pin_ids = [pin.pin_id for pin in pins]
    if pins and (len(pins) != len(recipe.pins) or len(set(pin_ids)) < len(pin_ids)):
        raise SessionFileError(f"pins must name each of the {len(recipe.pins)} pins of the recipe once")
    sets = {}
    for item in session.objects("selection_sets", ("name", "splats")):
        name = item.text("name", "")
        if not name or name in sets:
            raise item.refuse("name", "a name that no other selection set has")
        sets[name] = _mask(item, "splats", ply.n_splats)
    return SessionFile(
        ply,
        recipe,
        handles,
        pins,
        _chosen(session, "active_handles", ids),
        _chosen(session, "active_pins", pin_ids),
        _timeline(session.object("timeline", ("frame", "n_frames", "fps", "interpolation", "auto_key", "keys"))),
        _view(session.object("view", _VIEW_KEYS)) if value.get("view") is not None else None,
        _display(value.get("display", {})),
        _mask(session, "selection", ply.n_splats) if "selection" in value else None,
        _mask(session, "hidden", ply.n_splats) if "hidden" in value else None,
        sets,
        session.text("document", "") if "document" in value else None,
    )


def session_to_json(session: SessionFile) -> dict[str, Any]:
    """Plain objects of a session for ``json``."""
    ply = {"path": session.ply.path, "hash": session.ply.content_hash, "n_splats": session.ply.n_splats}
    if session.ply.layout is not None:
        ply["layout"] = session.ply.layout
    value: dict[str, Any] = {"format": FORMAT, "version": VERSION, "ply": ply}
    value["recipe"] = recipe_to_json(session.recipe)
    value["handles"] = [{"id": h.handle_id, "color": h.color, "enabled": h.enabled} for h in session.handles]
    if session.pins:
        value["pins"] = [_pin_json(pin) for pin in session.pins]
    for name in ("active_handles", "active_pins"):
        if getattr(session, name):
            value[name] = list(getattr(session, name))
    value["timeline"] = _timeline_json(session.timeline)
    if session.view is not None:
        value["view"] = _view_json(session.view)
    if session.display:
        value["display"] = dict(session.display)
    for name in ("selection", "hidden"):
        if getattr(session, name) is not None:
            value[name] = _packed(getattr(session, name))
    if session.selection_sets:
        value["selection_sets"] = [{"name": n, "splats": _packed(mask)} for n, mask in session.selection_sets.items()]
    if session.document is not None:
        value["document"] = session.document
    return value


def _ply(ply: JsonObject) -> PlySpec:
    path = ply.text("path", "")
    if not path or "\0" in path:
        raise ply.refuse("path", "the way to a PLY")
    return PlySpec(
        path,
        ply.text("hash", ""),
        ply.integer("n_splats", -1, low=0),
        ply.text("layout", "") if "layout" in ply else None,
    )


def _handle(handle: JsonObject) -> HandleSettings:
    color = handle.text("color", "")
    if not re.fullmatch("#[0-9a-fA-F]{6}", color):
        raise handle.refuse("color", 'a colour as "#rrggbb"')
    return HandleSettings(handle.integer("id", 0, low=1), color, handle.flag("enabled", True))


def _pin(pin: JsonObject) -> PinSettings:
    reach = pin.number("reach", above=0.0) if "reach" in pin else None
    return PinSettings(pin.integer("id", 0, low=1), reach)


def _pin_json(pin: PinSettings) -> dict[str, Any]:
    return {"id": pin.pin_id} if pin.reach is None else {"id": pin.pin_id, "reach": pin.reach}


def _chosen(session: JsonObject, key: str, known: list[int]) -> tuple[int, ...]:
    """Ids that are chosen, each once, as far as there are such handles or pins."""
    asked = dict.fromkeys(session.rows(key)) if key in session else {}
    there = set(known)
    return tuple(i for i in asked if i in there)


def _timeline(timeline: JsonObject) -> Timeline:
    keys: list[Key] = []
    for key in timeline.objects("keys", ("frame", "poses")):
        poses = {}
        for pose in key.objects("poses", ("id", "translate", "rotate", "scale")):
            handle_id = pose.integer("id", 0, low=1)
            if handle_id in poses:
                raise pose.refuse("id", "a handle that no other pose of the key has")
            poses[handle_id] = pose_from_json(pose)
        frame = key.integer("frame", 0, low=1, high=LAST_FRAME)
        if keys and frame <= keys[-1].frame:
            raise key.refuse("frame", "after that of the key before")
        keys.append(Key(frame, poses))
    usual = Timeline()
    fps = timeline.number("fps", usual.fps, above=0.0)
    if fps > 1000.0:
        raise timeline.refuse("fps", "at most 1000")
    return Timeline(
        tuple(keys),
        timeline.integer("frame", usual.frame, low=1, high=LAST_FRAME),
        timeline.integer("n_frames", usual.n_frames, low=1, high=LAST_FRAME),
        fps,
        timeline.choice("interpolation", ("smooth", "linear"), "smooth") == "smooth",
        timeline.flag("auto_key", usual.is_auto),
    )


def _timeline_json(timeline: Timeline) -> dict[str, Any]:
    return {
        "frame": timeline.frame,
        "n_frames": timeline.n_frames,
        "fps": timeline.fps,
        "interpolation": "smooth" if timeline.is_smooth else "linear",
        "auto_key": timeline.is_auto,
        "keys": [
            {"frame": key.frame, "poses": [{"id": h, **pose_to_json(pose)} for h, pose in key.poses.items()]}
            for key in timeline.keys
        ],
    }


_VIEW_KEYS = ("position", "focal_point", "view_up", "angle", "parallel", "turntable", "world_up")


def _view(view: JsonObject) -> ViewSpec:
    position, focal_point, up = (view.vector(key, 3) for key in _VIEW_KEYS[:3])
    # A camera in its own focal point, or one that looks along its own upward vector, shows nothing.
    distance, length = math.dist(position, focal_point), math.hypot(*up)
    if not 0.0 < distance < math.inf:
        raise view.refuse("focal_point", "away from the position")
    if not 0.0 < length < math.inf:
        raise view.refuse("view_up", "a vector that is not zero")
    if np.linalg.norm(np.cross(np.subtract(focal_point, position) / distance, np.divide(up, length))) < 1e-6:
        raise view.refuse("view_up", "across the line of sight")
    angle = view.number("angle", ViewSpec.angle, above=0.0)
    if angle >= 180.0:
        raise view.refuse("angle", "below 180 degrees")
    world_up = view.vector("world_up", 3, ViewSpec.world_up)
    if not 0.0 < math.hypot(*world_up) < math.inf:
        raise view.refuse("world_up", "a vector that is not zero")
    is_parallel, is_turntable = view.flag("parallel", False), view.flag("turntable", True)
    return ViewSpec(position, focal_point, up, angle, is_parallel, is_turntable, world_up)


def _view_json(view: ViewSpec) -> dict[str, Any]:
    values = (view.position, view.focal_point, view.view_up)
    return {
        **{key: list(value) for key, value in zip(_VIEW_KEYS[:3], values, strict=True)},
        "angle": view.angle,
        "parallel": view.is_parallel,
        "turntable": view.is_turntable,
        "world_up": list(view.world_up),
    }


def _display(value: Any) -> dict[str, Scalar]:
    if not isinstance(value, dict):
        raise SessionFileError(f"display must be an object in braces, got {shown(value)}")
    for key, item in value.items():
        if not isinstance(item, str | bool | int | float) or (isinstance(item, float) and not math.isfinite(item)):
            raise SessionFileError(f"display.{key} must be text, a finite number, true or false, got {shown(item)}")
    return dict(value)


def _packed(mask: FileMask) -> str:
    return base64.b64encode(np.packbits(mask).tobytes()).decode()


def _mask(item: JsonObject, key: str, n_splats: int) -> FileMask:
    """Splats as bits, eight to a byte, in base64."""
    wanted = f"base64 of a bit for each of {n_splats} splats"
    try:
        data = base64.b64decode(item.text(key, ""), validate=True)
    except (binascii.Error, ValueError):
        raise item.refuse(key, wanted) from None
    if len(data) != -(-n_splats // 8):
        raise item.refuse(key, wanted)
    bits = np.unpackbits(np.frombuffer(data, np.uint8))
    if bits[n_splats:].any():
        raise item.refuse(key, wanted)
    return bits[:n_splats].astype(bool)
