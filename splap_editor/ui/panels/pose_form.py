"""Numbers of a handle's pose: translation, Euler angles, scale."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QWidget

from splap_editor.core.pose import Pose
from splap_editor.core.splats.rotations import matrices_to_quats, quats_to_matrices
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import NumberField, ScrubLabel
from splap_editor.ui.widgets.plain_text import PlainLabel

AXIS_COLORS = ("#f2746b", "#8fcf5f", "#6ea8ff")


def euler_degrees(quat: ArrayLike) -> NDArray[np.float64]:
    """Angles (x, y, z) in degrees of ``R = Rz Ry Rx`` for a unit quaternion w x y z; at the pole z is 0.

    Of the two triples that mean a rotation it is the one that turns less in all: a turn by 120° about Y and then by
    40° about Z is told as these, not as (-180, 60, -140).
    """
    R = quats_to_matrices(np.asarray(quat, np.float64)[None])[0]
    y = np.arcsin(np.clip(-R[2, 0], -1.0, 1.0))
    if abs(R[2, 0]) < 1.0 - 1e-9:
        x, z = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(R[1, 0], R[0, 0])
    else:
        x, z = np.arctan2(-R[1, 2], R[1, 1]), 0.0
    angles = np.array([x, y, z])
    other = np.array([x - np.copysign(np.pi, x), np.copysign(np.pi, y) - y, z - np.copysign(np.pi, z)])
    # Rounding must not decide between two that turn as far.
    return np.degrees(min(angles, other, key=lambda each: round(np.abs(each).sum(), 9)))


def quat_of_euler(degrees: ArrayLike) -> tuple[float, float, float, float]:
    """Unit quaternion w x y z of ``R = Rz Ry Rx``, angles in degrees."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    R = np.array(
        [
            [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy],
        ]
    )
    w, x, y, z = matrices_to_quats(R[None])[0].tolist()
    return w, x, y, z


class PoseForm(QWidget):
    """Edits one `Pose`. A uniform scale has one field, a scale along the axes three.

    `changed` gives a pose to make an undoable step of; `previewed` one that
    follows the pointer until `changed` or `cancelled` comes.
    """

    changed = Signal(object)
    previewed = Signal(object)

    def __init__(
        self,
        parent: QWidget | None = None,
        *,
        words: tuple[str, str, str] = ("Move", "Rotate", "Scale"),
        scale_range: tuple[float, float] = (0.01, 100.0),
    ) -> None:
        super().__init__(parent)
        self._pose = Pose()
        self._euler = np.zeros(3)
        self._scrubbed: Pose | None = None
        self._grips: dict[NumberField, ScrubLabel] = {}
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(STEP)
        grid.setVerticalSpacing(STEP)
        self.translate = [NumberField(-1e9, 1e9, decimals=4, step=0.01) for _ in range(3)]
        self.rotate = [NumberField(-360, 360, decimals=2, step=1, unit="°") for _ in range(3)]
        self.scales = [
            NumberField(*scale_range, decimals=max(3, round(-np.log10(scale_range[0]))), step=0.01) for _ in range(3)
        ]
        for axis, (name, color) in enumerate(zip("XYZ", AXIS_COLORS, strict=True)):
            head = PlainLabel(name, styleSheet=f"color: {color};")
            grid.addWidget(head, 0, axis + 1)
            grid.setColumnStretch(axis + 1, 1)
            grid.addLayout(self._cell(self.translate[axis], color), 1, axis + 1)
            grid.addLayout(self._cell(self.rotate[axis], color), 2, axis + 1)
            grid.addLayout(self._cell(self.scales[axis], color), 3, axis + 1)
        for row, text in enumerate(words, start=1):
            label = PlainLabel(text)
            label.setProperty("tone", "quiet")
            grid.addWidget(label, row, 0)
        for field in (*self.translate, *self.rotate, *self.scales):
            field.committed.connect(lambda _: self.changed.emit(self._read()))

    def show_pose(self, pose: Pose, unit: float) -> None:
        """Show a pose; ``unit`` is a typical length, from which the steps follow."""
        # Angles as typed are kept while they mean the same rotation: 180° stays 180°.
        if not np.allclose(quat_of_euler(self._euler), pose.rotate, atol=1e-9):
            self._euler = euler_degrees(pose.rotate)
        self._pose = pose
        step = 10.0 ** np.floor(np.log10(max(unit, 1e-9) * 0.01))
        for axis in range(3):
            self.translate[axis].setSingleStep(step)
            self.translate[axis].show_value(pose.translate[axis])
            self.rotate[axis].show_value(self._euler[axis])
        is_uniform = not isinstance(pose.scale, tuple)
        for axis, value in enumerate(pose.scale if isinstance(pose.scale, tuple) else (pose.scale,) * 3):
            self.scales[axis].show_value(value)
            self._grips[self.scales[axis]].setVisible(axis == 0 or not is_uniform)
            self.scales[axis].setVisible(axis == 0 or not is_uniform)

    def _cell(self, field: NumberField, color: str) -> QHBoxLayout:
        grip = ScrubLabel("‖", field)
        grip.setFixedWidth(8)
        grip.setStyleSheet(f"color: {color};")
        self._connect_scrub(grip, field)
        self._grips[field] = grip
        cell = QHBoxLayout()
        cell.setSpacing(0)
        cell.addWidget(grip)
        cell.addWidget(field, 1)
        return cell

    def _connect_scrub(self, grip: ScrubLabel, field: NumberField) -> None:
        def moved(value: float) -> None:
            field.show_value(value)
            self._scrubbed = self._read()
            self.previewed.emit(self._scrubbed)

        def finished() -> None:
            if self._scrubbed is not None:
                pose, self._scrubbed = self._scrubbed, None
                self.changed.emit(pose)

        grip.moved.connect(moved)
        grip.finished.connect(finished)

    def _read(self) -> Pose:
        angles = np.array([field.value() for field in self.rotate])
        shown = np.round(self._euler, self.rotate[0].decimals())
        rotate = self._pose.rotate
        if not np.array_equal(angles, shown):
            self._euler = np.where(angles == shown, self._euler, angles)
            rotate = quat_of_euler(self._euler)
        scale = self._pose.scale
        scale = _all_typed(self.scales, scale) if isinstance(scale, tuple) else _typed(self.scales[0], scale)
        return Pose(_all_typed(self.translate, self._pose.translate), rotate, scale)


def _all_typed(fields: Sequence[NumberField], held: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (_typed(*pair) for pair in zip(fields, held, strict=True))
    return x, y, z


def _typed(field: NumberField, held: float) -> float:
    """Value of a field, with the digits it does not show unless it was changed."""
    return held if field.value() == round(held, field.decimals()) else field.value()
