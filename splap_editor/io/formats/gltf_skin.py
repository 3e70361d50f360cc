"""An animation as a glTF skin: splats at rest, a weight of each for a few joints, and how the joints move."""

from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.camera_path import CameraTrack
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.rotations import matrices_to_quats
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import row_blocks
from splap_editor.io.formats.gltf import GlbBuilder, splat_attributes, splat_document

POINTER = "KHR_animation_pointer"
"""Khronos' extension by which more than nodes is animated; who does not know it leaves those channels out."""

ASPECT = 16 / 9
"""Width by height of a parallel picture, which a glTF has to say."""

_SMALLEST = 1e-5
"""Weights below this move nothing that can be seen, and are left out."""


@dataclass(frozen=True, eq=False)
class Skin:
    """Joints of an animation.

    Parameters
    ----------
    names : tuple of str
        One per joint; after them stands a joint that rests.
    weights : (N, H) float
        Of each joint for each splat; rows sum to at most 1, the rest of it is rest.
    centers : (H, 3) float
        About which the joints turn and scale.
    translations, rotations, scales : (F, H, 3), (F, H, 4) and (F, H, 3) float
        Poses at each frame: scaled along the world axes, turned (w, x, y, z), then moved.
    seconds : (F,) float
        When.
    place : (4, 4) float
        Where the whole is put, a similarity.
    camera : CameraTrack, optional
        At each frame, where the whole is put already.
    """

    names: tuple[str, ...]
    weights: NDArray[np.floating]
    centers: NDArray[np.float64]
    translations: NDArray[np.float64]
    rotations: NDArray[np.float64]
    scales: NDArray[np.float64]
    seconds: NDArray[np.float64]
    place: NDArray[np.float64]
    camera: CameraTrack | None = None

    def blended(self, means: NDArray[np.floating], frame: int, progress: Progress = no_progress) -> NDArray[np.float64]:
        """Where a program that plays the skin puts points at rest, before the whole is put in its place."""
        played = np.empty((len(means), 3))
        for rows in row_blocks(len(means), progress):
            rest = np.asarray(means[rows], np.float64)
            moved = rest * (1 - self.weights[rows].sum(axis=1, keepdims=True))
            for joint, center in enumerate(self.centers):
                w, x, y, z = self.rotations[frame, joint]
                axis, local = np.array([x, y, z]), (rest - center) * self.scales[frame, joint]
                twice = 2 * np.cross(axis, local)
                turned = local + w * twice + np.cross(axis, twice)
                moved += self.weights[rows, joint, None] * (turned + center + self.translations[frame, joint])
            played[rows] = moved
        return played


def write(out: BinaryIO, splats: Splats, skin: Skin, progress: Progress = no_progress) -> None:
    """Write bare splats with their skin as a ``.glb``."""
    builder = GlbBuilder()
    attributes = splat_attributes(builder, splats, part_of(progress, 0.0, 0.3))
    for number, (numbers, weights) in enumerate(_sets(skin.weights, part_of(progress, 0.3, 0.5))):
        attributes[f"JOINTS_{number}"] = builder.add(numbers)
        attributes[f"WEIGHTS_{number}"] = builder.add(weights)
    document = splat_document(attributes)
    n_joints = len(skin.names)
    inverse = np.tile(np.eye(4), (n_joints + 1, 1, 1))
    inverse[:n_joints, :3, 3] = -skin.centers
    # Column by column, as glTF has its matrices.
    bind = builder.add(inverse.transpose(0, 2, 1).reshape(-1, 16).astype("<f4"))
    first = 2
    joints = [
        {"name": name, "translation": center.tolist()} for name, center in zip(skin.names, skin.centers, strict=True)
    ]
    turned = document["nodes"][0]["rotation"]
    place = {"matrix": skin.place.T.ravel().tolist(), "children": [*range(first, first + n_joints + 2)]}
    mesh = {"mesh": 0, "skin": 0, "name": "splats"}
    document["nodes"] = [{"rotation": turned, "children": [1]}, place, *joints, {"name": "rest"}, mesh]
    document["skins"] = [{"joints": [*range(first, first + n_joints + 1)], "inverseBindMatrices": bind, "skeleton": 0}]
    animation = _Animation(builder, skin.seconds)
    for joint in range(n_joints):
        animation.move(first + joint, "translation", skin.centers[joint] + skin.translations[:, joint])
        animation.move(first + joint, "rotation", _turns(skin.rotations[:, joint]))
        animation.move(first + joint, "scale", skin.scales[:, joint])
    if skin.camera is not None:
        _add_camera(document, animation, skin.camera)
    document["animations"] = [animation.held]
    builder.write(out, document, part_of(progress, 0.5, 1.0))
    progress(1.0)


class _Animation:
    """Channels of nodes and cameras, one key a frame."""

    def __init__(self, builder: GlbBuilder, seconds: NDArray[np.float64]) -> None:
        self._builder = builder
        ends = {"min": [float(seconds.min())], "max": [float(seconds.max())]}
        self._times = builder.add(seconds.astype("<f4"), **ends)
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []

    @property
    def held(self) -> dict[str, Any]:
        """Its JSON."""
        return {"name": "timeline", "samplers": self._samplers, "channels": self._channels}

    def move(self, number: int, path: str, values: NDArray[np.floating]) -> None:
        """Move a property of the document's node of a number."""
        self._add({"node": number, "path": path}, values)

    def change(self, pointer: str, values: NDArray[np.floating]) -> None:
        """Change another number of the document, for programs that know `POINTER`."""
        self._add({"path": "pointer", "extensions": {POINTER: {"pointer": pointer}}}, values)

    def _add(self, target: dict[str, Any], values: NDArray[np.floating]) -> None:
        output = self._builder.add(values.astype("<f4"))
        self._samplers.append({"input": self._times, "output": output, "interpolation": "LINEAR"})
        self._channels.append({"sampler": len(self._samplers) - 1, "target": target})


def _turns(quats: NDArray[np.floating]) -> NDArray[np.floating]:
    """Rotations w, x, y, z as glTF has them, the shorter way between neighbours."""
    turns = quats.copy()
    for frame in range(1, len(turns)):
        if turns[frame] @ turns[frame - 1] < 0:
            turns[frame] *= -1
    return turns[:, [1, 2, 3, 0]]


def _add_camera(document: dict[str, Any], animation: _Animation, camera: CameraTrack) -> None:
    """Add a camera under the turned node, and how it moves; its lens moves where a program knows `POINTER`."""
    near, far = camera.clipping
    y_halves, angles = camera.heights / 2, np.radians(camera.angles)
    lens: dict[str, Any] = {"znear": near, "zfar": far}
    if camera.is_parallel:
        kind, moving = "orthographic", {"ymag": y_halves, "xmag": y_halves * ASPECT}
    else:
        kind, moving = "perspective", {"yfov": angles}
    lens |= {name: float(values[0]) for name, values in moving.items()}
    document["cameras"] = [{"type": kind, kind: lens, "name": "camera"}]
    number = len(document["nodes"])
    turns, places = _turns(matrices_to_quats(camera.matrices[:, :3, :3])), camera.matrices[:, :3, 3]
    node = {"name": "camera", "camera": 0, "translation": places[0].tolist(), "rotation": turns[0].tolist()}
    document["nodes"].append(node)
    document["nodes"][0]["children"].append(number)
    animation.move(number, "translation", places)
    animation.move(number, "rotation", turns)
    for name, values in moving.items():
        if np.ptp(values) > 1e-6 * abs(float(values[0])):
            animation.change(f"/cameras/0/{kind}/{name}", values)
            document["extensionsUsed"] = sorted({*document["extensionsUsed"], POINTER})


def _sets(weights: NDArray[np.floating], progress: Progress) -> list[tuple[NDArray[np.uint16], NDArray[np.float32]]]:
    """Joints and weights in fours, the heaviest first; the resting joint takes what is left of one."""
    n, n_joints = weights.shape
    n_most = -(-(n_joints + 1) // 4)
    joints, shares = np.zeros((n, 4 * n_most), "<u2"), np.zeros((n, 4 * n_most), "<f4")
    n_used = 1
    for rows in row_blocks(n, progress):
        held = np.where(weights[rows] < _SMALLEST, 0, weights[rows])
        whole = np.column_stack([held, np.maximum(1 - held.sum(axis=1), 0)])
        whole /= whole.sum(axis=1, keepdims=True)
        n_used = max(n_used, int((whole > 0).sum(axis=1).max()))
        order = np.argsort(-whole, axis=1, kind="stable")
        held = np.take_along_axis(whole, order, axis=1)
        # A joint that weighs nothing must be number 0.
        joints[rows, : n_joints + 1], shares[rows, : n_joints + 1] = np.where(held > 0, order, 0), held
    fours = [slice(4 * number, 4 * number + 4) for number in range(-(-n_used // 4))]
    return [(joints[:, four], shares[:, four]) for four in fours]
