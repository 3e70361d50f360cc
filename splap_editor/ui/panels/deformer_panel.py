"""Which deformer bends the splats, its options, and how far it is."""

from dataclasses import dataclass, replace

import numpy as np
from PySide6.QtCore import QEvent, QObject, Signal
from PySide6.QtWidgets import QCheckBox, QGridLayout, QLabel, QVBoxLayout, QWidget

from splap_editor.engine.edit import Edit
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.panels.weights_form import WeightsForm
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import NumberField, set_tone
from splap_editor.ui.widgets.options_form import FieldHint, OptionsForm, form_label

METHODS = {"arap": "As-rigid-as-possible", "bbw": "Bounded biharmonic weights"}

SOLVER_HINTS = {
    "kind": FieldHint(
        "Solver",
        "Converged gives the settled shape; the others are the published iterations, for comparison.",
        choices={"converged": "Converged", "local-global": "Local/global steps", "libigl": "libigl (reference)"},
    ),
    "tolerance": FieldHint(
        "Tolerance",
        "Settled once no splat moves by more than this share of the size.",
        low=1e-6,
        high=0.1,
        step=1e-4,
        decimals=6,
        only_for=("kind", ("converged",)),
    ),
    "iterations": FieldHint(
        "Iterations", "Steps from rest.", low=1, high=10_000, only_for=("kind", ("local-global", "libigl"))
    ),
    "smoothness": FieldHint(
        "Stiffness",
        "How much neighbouring splats want to turn together.",
        low=0.0,
        high=10.0,
        step=0.001,
        decimals=4,
        only_for=("kind", ("converged",)),
    ),
}


@dataclass(frozen=True)
class KernelOptions:
    """The part of an edit that says how splats follow the surface."""

    adaptation: str
    hops: int
    blending: str


KERNEL_HINTS = {
    "adaptation": FieldHint(
        "Splat shape",
        "How each ellipse follows the bent surface.",
        choices={"surface": "Follows the surface", "affine": "Stretches with it", "none": "Moves only"},
    ),
    "hops": FieldHint(
        "Neighbours",
        "Rings of neighbours that the stretch is taken from.",
        low=1,
        high=4,
        only_for=("adaptation", ("affine",)),
    ),
    "blending": FieldHint(
        "Blending", "How turns of several handles mix.", choices={"dual-quaternion": "Keeps volume", "linear": "Linear"}
    ),
}


class DeformerPanel(QWidget):
    """Edits method and options; says in plain words what the solver does."""

    radius_hovered = Signal(bool)
    """The pointer is over the free radius, or has left it: time to show it on screen."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._scene: Scene | None = None
        edit = Edit()
        self.state = QLabel(wordWrap=True)
        self.timing = QLabel()
        self.timing.setProperty("tone", "quiet")
        self.method = Choice()
        for name, words in METHODS.items():
            self.method.addItem(words, name)
        self.method.currentIndexChanged.connect(
            lambda index: self._change("Change method", method=self.method.itemData(index))
        )
        self.solver = OptionsForm(edit.solver, SOLVER_HINTS)
        self.solver.changed.connect(lambda solver: self._change("Change solver", solver=solver))
        self.kernels = OptionsForm(_kernel_options(edit), KERNEL_HINTS)
        self.kernels.changed.connect(
            lambda options: self._change(
                "Change splat shape",
                adaptation=options.adaptation,
                hops=options.hops,
                blending=options.blending,
            )
        )
        self.weights = WeightsForm(session)
        self.whole = QCheckBox(
            "Bend the whole object", toolTip="Otherwise only what lies within the free radius moves."
        )
        self.whole.clicked.connect(self._on_whole_clicked)
        self.free_radius = NumberField(0.0, 1e9, decimals=4, step=0.05)
        self.free_radius.setToolTip("Splats farther from every handle than this stay put, in the file's units.")
        self.free_radius.committed.connect(lambda radius: self._change("Change free radius", free_radius=radius))
        self._radius_label = form_label("Free radius", self.free_radius)
        self.free_radius.installEventFilter(self)
        reach = QGridLayout()
        reach.setHorizontalSpacing(2 * STEP)
        reach.setVerticalSpacing(STEP)
        reach.setColumnStretch(1, 1)
        reach.addWidget(self._radius_label, 0, 0)
        reach.addWidget(self.free_radius, 0, 1)
        reach.addWidget(self.whole, 1, 0, 1, 2)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        for part in (self.state, self.timing, self.method, self.solver):
            layout.addWidget(part)
        layout.addLayout(reach)
        layout.addWidget(self.kernels)
        layout.addWidget(self.weights)
        SceneFollower(session, self._on_scene_changed, edit_changed=self._show, pose_changed=self.show_state)
        session.state_changed.connect(self.show_state)
        self._show()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Tell when the free radius is looked at."""
        kind = event.type()
        if kind in (QEvent.Type.Enter, QEvent.Type.FocusIn):
            self.radius_hovered.emit(True)
        elif kind == QEvent.Type.FocusOut or (kind == QEvent.Type.Leave and not self.free_radius.hasFocus()):
            self.radius_hovered.emit(False)
        return False

    def show_timing(self, draw_ms: float) -> None:
        """Show how long the last frame took to draw."""
        self.timing.setText(f"A frame takes {draw_ms:.0f} ms")

    def show_state(self) -> None:
        """Say what the solver does."""
        words, tone = self._words()
        self.state.setText(words)
        set_tone(self.state, tone)

    def _words(self) -> tuple[str, str]:
        scene = self._scene
        deformation = scene.deformation if scene is not None else None
        residual = deformation.residual if deformation is not None else 0.0
        share = f": {100 * residual:.2g} % of the size to go" if np.isfinite(residual) and residual > 0 else ""
        return {
            "empty": ("Nothing is open.", "quiet"),
            "preparing": ("Preparing the surface; handles can be placed meanwhile.", ""),
            "ready": ("At rest: no handle is placed.", "quiet"),
            "binding": ("Getting ready to bend.", ""),
            "dragging": ("Following the drag.", ""),
            "settling": (f"Settling{share}.", ""),
            "settled": (f"Settled{self._steps(deformation)}.", ""),
            "halted": ("Stopped; the picture may lag behind the handles.", "warning"),
            "failed": ("This edit could not be computed; undo it or try again.", "danger"),
        }[self._session.state]

    @staticmethod
    def _steps(deformation) -> str:
        n = deformation.n_iterations if deformation is not None else 0
        return f" in {n} step{'s' if n != 1 else ''}" if n else ""

    def _on_scene_changed(self) -> None:
        self._scene = self._session.scene
        self._show()

    def _show(self) -> None:
        edit = self._scene.edit if self._scene is not None else Edit()
        self.setEnabled(self._scene is not None)
        self.method.blockSignals(True)
        self.method.setCurrentIndex(self.method.findData(edit.method))
        self.method.blockSignals(False)
        is_arap = edit.method == "arap"
        self.solver.setVisible(is_arap)
        self.solver.show_value(edit.solver)
        self.kernels.show_value(_kernel_options(edit))
        self.kernels.show_field("blending", not is_arap)
        self.weights.setVisible(not is_arap)
        self.whole.setVisible(is_arap)
        self.whole.setChecked(edit.free_radius is None)
        for part in (self.free_radius, self._radius_label):
            part.setVisible(is_arap)
            part.setEnabled(edit.free_radius is not None)
        size = self._scene.ellipses.scene_scale if self._scene is not None else 1.0
        radius = 0.5 * size if edit.free_radius is None or np.isnan(edit.free_radius) else edit.free_radius
        self.free_radius.setSingleStep(0.05 * size)
        self.free_radius.show_value(radius)
        self.show_state()

    def _on_whole_clicked(self, whole: bool) -> None:
        self._change("Change free radius", free_radius=None if whole else float("nan"))

    def _change(self, label: str, **values: object) -> None:
        if self._scene is not None:
            self._session.change_edit(replace(self._scene.edit, **values), label)


def _kernel_options(edit: Edit) -> KernelOptions:
    return KernelOptions(edit.adaptation, edit.hops, edit.blending)
