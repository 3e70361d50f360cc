"""An edit as plain values: what a script writes and a recipe holds, by place or file row, of no file in particular."""

from dataclasses import dataclass

from splap_editor.core.base_edit import BaseEdit
from splap_editor.core.camera_path import CameraKey
from splap_editor.core.grade import GradeStep
from splap_editor.core.index_spaces import FileRow
from splap_editor.core.options import Length
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import CageOptions
from splap_editor.core.removal import RemovalStep

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Pin:
    """Splats that stay put: within a ball, or by file row.

    Parameters
    ----------
    center : 3 floats, optional
        World units.
    radius : float, optional
        World units.
    rows : tuple of int, optional
        File rows, instead of center and radius.
    name : str
        As listed; empty for a numbered one.
    """

    center: Vector | None = None
    radius: float | None = None
    rows: tuple[FileRow, ...] | None = None
    name: str = ""


@dataclass(frozen=True)
class Handle:
    """Splats that are moved, and where to.

    Parameters
    ----------
    name : str
        As listed.
    center : 3 floats, optional
        Point about which the pose turns and scales, world units; with rows it
        may be left out and is then the mean of their positions.
    radius : float, optional
        Every active splat within it belongs; world units.
    rows : tuple of int, optional
        File rows, instead of radius.
    translate : 3 floats
        World units.
    rotate : 4 floats
        Unit quaternion, w x y z.
    scale : float or 3 floats
        Uniform, or along the world axes before the rotation; greater than 0.
    cage_radius : float, ShareOfSize or None
        Reach of the handle's weight, see `CageOptions`.
    frees : bool
        Whether the free radius is measured from it too; False for one that only holds splats where they have gone.
    """

    name: str = ""
    center: Vector | None = None
    radius: float | None = None
    rows: tuple[FileRow, ...] | None = None
    translate: Vector = (0.0, 0.0, 0.0)
    rotate: Quaternion = (1.0, 0.0, 0.0, 0.0)
    scale: float | Vector = 1.0
    cage_radius: Length = CageOptions.cage_radius
    frees: bool = True

    @property
    def pose(self) -> Pose:
        """How far the handle is moved, turned and scaled about its centre."""
        return Pose(self.translate, self.rotate, self.scale)


@dataclass(frozen=True)
class Edit(BaseEdit[Handle, Pin]):
    """An edit by place or file row; `BaseEdit` with the following.

    Parameters
    ----------
    rows_of : str
        Content hash of the only file that rows may be meant of, ``"blake2b:…"``; empty where any file of that many
        rows will do. Formats that put rows in an order of their own need it.
    remove : tuple of RemovalStep
        Splats that are left out of everything.
    grade : tuple of GradeStep
        Colour grades, one over the other.
    camera : tuple of CameraKey
        Where the camera stands at frames of a video, ascending; in the file's coordinates.
    """

    rows_of: str = ""
    remove: tuple[RemovalStep, ...] = ()
    grade: tuple[GradeStep, ...] = ()
    camera: tuple[CameraKey, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "remove", tuple(self.remove))
        object.__setattr__(self, "grade", tuple(self.grade))
        object.__setattr__(self, "camera", tuple(self.camera))
