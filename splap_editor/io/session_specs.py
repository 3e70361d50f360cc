"""What a session file says: an edit, how it is looked at, and the PLY it belongs to, as plain values."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.timeline import Timeline
from splap_editor.io.plain_edit import Edit, Vector

Scalar = str | bool | int | float


@dataclass(frozen=True)
class PlySpec:
    """The splat PLY that a session belongs to.

    Parameters
    ----------
    path : str
        Relative to the folder of the session file, with forward slashes; absolute where there is no such way.
    content_hash : str
        As `splap_editor.io.content_hash.content_hash` gives it; empty where it was not known.
    n_splats : int
    layout : str, optional
        Layout chosen by hand.
    """

    path: str
    content_hash: str
    n_splats: int
    layout: str | None = None


@dataclass(frozen=True)
class HandleSettings:
    """What a handle has besides its recipe."""

    handle_id: int
    color: str
    enabled: bool = True


@dataclass(frozen=True)
class PinSettings:
    """What a pin has besides its recipe."""

    pin_id: int
    reach: float | None = None


@dataclass(frozen=True)
class ViewSpec:
    """Where the camera stands: the fields of `splap_editor.viewport.camera.View`, and its turntable's axis.

    The view is in the file's coordinates, the axis in those of the placed scene.
    """

    position: Vector
    focal_point: Vector
    view_up: Vector
    angle: float = 35.0
    is_parallel: bool = False
    is_turntable: bool = True
    world_up: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class SessionFile:
    """Everything a session file holds.

    Parameters
    ----------
    ply : PlySpec
    recipe : Edit
        With the disabled handles too.
    handles : tuple of HandleSettings
        In the order of the recipe's handles.
    pins : tuple of PinSettings
        In the order of the recipe's pins; empty in files from before pins had ids.
    active_handles, active_pins : tuple of int
        Ids of the chosen handles and pins.
    timeline : Timeline
    view : ViewSpec, optional
    display : mapping
        Display options by name. Which there are is up to the window: unknown ones are carried along.
    selection, hidden : (N,) bool, optional
        None for none.
    selection_sets : mapping of name to (N,) bool
    document : str, optional
        Of a recovery file: absolute path of the session file that it continues; empty where there is none.
    """

    ply: PlySpec
    recipe: Edit = field(default_factory=Edit)
    handles: tuple[HandleSettings, ...] = ()
    pins: tuple[PinSettings, ...] = ()
    active_handles: tuple[int, ...] = ()
    active_pins: tuple[int, ...] = ()
    timeline: Timeline = field(default_factory=Timeline)
    view: ViewSpec | None = None
    display: Mapping[str, Scalar] = field(default_factory=dict)
    selection: FileMask | None = None
    hidden: FileMask | None = None
    selection_sets: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    document: str | None = None
