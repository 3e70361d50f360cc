"""A scene and its edit as a session file says them, each made from the other."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.removal import Finder as Find
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.edit import Edit
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.io.session_file import SessionFileError, relative_path
from splap_editor.io.session_specs import (
    HandleSettings,
    PinSettings,
    PlySpec,
    Scalar,
    SessionFile,
    ViewSpec,
)
from splap_editor.session.scene import Scene


@dataclass(frozen=True, eq=False)
class Look:
    """Camera and display options, which belong to the window."""

    view: ViewSpec | None = None
    display: Mapping[str, Scalar] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SavedState:
    """All of a scene that a session file keeps, as references to values that never change.

    Made in no time on the main thread; what becomes of it may be done on any other.
    """

    source: Path
    layout: str | None
    n_splats: int
    edit: Edit
    active_handles: tuple[int, ...]
    active_pins: tuple[int, ...]
    selection: FileMask
    hidden: FileMask
    selection_sets: Mapping[str, FileMask]
    look: Look

    def keeps_like(self, other: "SavedState") -> bool:
        """Whether nothing is in one that a person would miss in the other; camera and selection are not missed."""
        return (
            self.edit is other.edit
            and np.array_equal(self.hidden, other.hidden)
            and list(self.selection_sets) == list(other.selection_sets)
            and all(np.array_equal(mask, other.selection_sets[name]) for name, mask in self.selection_sets.items())
        )


def saved_state(scene: Scene, look: Look) -> SavedState:
    """Take the state of a scene as it is."""
    layout = scene.file.layout
    return SavedState(
        scene.file.path,
        layout.choice if layout.is_chosen else None,
        scene.splats.n_splats,
        scene.edit,
        scene.active_handles,
        scene.active_pins,
        scene.selection,
        scene.hidden,
        scene.selection_sets,
        look,
    )


def session_file_of(state: SavedState, folder: Path | None, content_hash: str) -> SessionFile:
    """Write a state as a session file in a folder; the way to the PLY is absolute without one."""
    source = state.source.absolute().as_posix() if folder is None else relative_path(state.source, folder)
    edit = state.edit
    return SessionFile(
        PlySpec(source, content_hash, state.n_splats, state.layout),
        recipe_of(edit, with_disabled=True),
        tuple(HandleSettings(h.handle_id, h.color, h.enabled) for h in edit.handles),
        tuple(PinSettings(pin.pin_id, pin.reach) for pin in edit.pins),
        state.active_handles,
        state.active_pins,
        edit.timeline,
        state.look.view,
        state.look.display,
        state.selection if state.selection.any() else None,
        state.hidden if state.hidden.any() else None,
        state.selection_sets,
    )


def session_edit(
    session: SessionFile, splats: Splats, find: Find | None = None, progress: Progress = no_progress
) -> Edit:
    """Make the edit of a session file.

    Parameters
    ----------
    session : SessionFile
    splats : Splats
        Of the PLY it belongs to.
    find : callable, optional
        As in `splap_editor.engine.removal.removal_of`.
    progress : Progress
        As of `splap_editor.engine.recipe_edit.edit_of`.

    Raises
    ------
    RecipeError
        A row is not in the PLY.
    """
    edit = edit_of(session.recipe, splats, find, progress)
    handles = tuple(
        replace(handle, handle_id=settings.handle_id, color=settings.color, enabled=settings.enabled)
        for handle, settings in zip(edit.handles, session.handles, strict=True)
    )
    pins = edit.pins
    if session.pins:
        pins = tuple(
            replace(pin, pin_id=settings.pin_id, reach=settings.reach)
            for pin, settings in zip(pins, session.pins, strict=True)
        )
    # The camera's keys are the recipe's.
    timeline = replace(session.timeline, camera_keys=edit.timeline.camera_keys)
    return replace(edit, handles=handles, pins=pins, timeline=timeline)


def restore_scene(
    scene: Scene, session: SessionFile, find: Find | None = None, progress: Progress = no_progress
) -> None:
    """Put what a session file holds into a scene just read, before anyone follows it.

    ``find`` and ``progress`` are as of `session_edit`.

    Raises
    ------
    SessionFileError
        The session belongs to another PLY: it names rows that this one does not have.
    """
    try:
        scene.edit = session_edit(session, scene.splats, find, progress)
    except ValueError as error:
        raise SessionFileError(f"the session does not fit {scene.file.path.name}: {error}") from None
    known = {handle.handle_id for handle in scene.edit.handles}
    scene.active_handles = tuple(handle_id for handle_id in session.active_handles if handle_id in known)
    pins = {pin.pin_id for pin in scene.edit.pins}
    scene.active_pins = tuple(pin_id for pin_id in session.active_pins if pin_id in pins)
    if session.ply.n_splats == scene.splats.n_splats:
        for name in ("selection", "hidden"):
            if getattr(session, name) is not None:
                setattr(scene, name, getattr(session, name))
        scene.selection_sets = dict(session.selection_sets)
