"""Which deformer bends the splats, its options, and how far it is."""

from dataclasses import replace
from typing import Any

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtWidgets import QCheckBox, QGridLayout, QVBoxLayout, QWidget

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.deformers import DEFORMERS, method_tips, method_titles
from splap_editor.core.options import options_of, world_length
from splap_editor.core.reach_options import ReachOptions
from splap_editor.engine.edit import Edit
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.weight_report import weight_figures, weight_lines
from splap_editor.ui.panels.details import Details
from splap_editor.ui.panels.weights_form import WeightsForm
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import NumberField, set_tone
from splap_editor.ui.widgets.options_form import OptionsForm, form_label
from splap_editor.ui.widgets.plain_text import PlainLabel

_REACH = options_of(ReachOptions)["free_radius"]


class DeformerPanel(QWidget):
    """Edits method and options; says in plain words what the solver does."""

    radius_hovered = Signal(bool)
    """The pointer is over the free radius, or has left it: time to show it on screen."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._scene: Scene | None = None
        edit = Edit()
        self.state = PlainLabel(wordWrap=True)
        self.timing = PlainLabel()
        self.timing.setProperty("tone", "quiet")
        self.figures = PlainLabel(wordWrap=True, textInteractionFlags=Qt.TextInteractionFlag.TextSelectableByMouse)
        self.figures.setProperty("tone", "quiet")
        self.details = Details(self.timing, self.figures)
        self.method = Choice()
        for name, words in method_titles().items():
            self.method.addItem(words, name)
            self.method.setItemData(self.method.count() - 1, method_tips()[name], Qt.ItemDataRole.ToolTipRole)
        self.method.currentIndexChanged.connect(
            lambda index: self._change("Change method", method=self.method.itemData(index))
        )
        self.forms = {group: self._form(group, edit) for group in dict.fromkeys(row.options for row in DEFORMERS)}
        self.kernels = self._form(AdaptationOptions, edit)
        self.weights = WeightsForm(session)
        self.whole = QCheckBox("Bend the whole object")
        self.whole.setToolTip("Otherwise only what lies within the free radius moves.")
        self.whole.clicked.connect(self._on_whole_clicked)
        self.free_radius = NumberField(0.0, 1e9, decimals=4, step=0.05)
        self.free_radius.setToolTip(_REACH.sentence)
        self.free_radius.committed.connect(lambda radius: self._take(ReachOptions(radius), _REACH.label))
        self._radius_label = form_label(_REACH.label, self.free_radius)
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
        for part in (self.state, self.method, *self.forms.values()):
            layout.addWidget(part)
        layout.addLayout(reach)
        layout.addWidget(self.kernels)
        layout.addWidget(self.weights)
        layout.addWidget(self.details)
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
        self.timing.setText(f"Drawing: {draw_ms:.0f} ms")

    def show_state(self) -> None:
        """Say what the solver does."""
        words, tone = self._words()
        self.state.setText(words)
        set_tone(self.state, tone)
        self.figures.setText("\n".join(self._figures()))
        self.figures.setVisible(bool(self.figures.text()))

    def _figures(self) -> list[str]:
        """What the words stand for, in numbers."""
        bound, scene = self._session.bound, self._scene
        if bound is None:
            return []
        if bound.weighted is not None:
            report = bound.weighted.report
            words = [text for text, tone in weight_lines(bound.edit, report) if tone == "quiet"]
            return words + weight_figures(bound.edit, report)
        deformation = scene.deformation if scene is not None else None
        if deformation is None or not deformation.n_iterations:
            return []
        residual = f", {100 * deformation.residual:.2g} % of the size to go" if deformation.residual > 0 else ""
        return [f"Solver: {deformation.n_iterations} iterations{residual}"]

    def _words(self) -> tuple[str, str]:
        return {
            "empty": ("Nothing is open.", "quiet"),
            "opening": ("Opening the file.", "quiet"),
            "preparing": ("Preparing: handles can be placed.", ""),
            "ready": ("At rest: no handle is placed.", "quiet"),
            "binding": ("Getting ready to bend.", ""),
            "dragging": ("Following; it settles at rest.", ""),
            "settling": ("Settling.", ""),
            "settled": ("Settled.", ""),
            "halted": ("Stopped; the picture may lag behind the handles.", "warning"),
            "failed": ("This edit could not be computed; undo it or try again.", "danger"),
        }[self._session.state]

    def _on_scene_changed(self) -> None:
        self._scene = self._session.scene
        self._show()

    def _show(self) -> None:
        edit = self._scene.edit if self._scene is not None else Edit()
        self.setEnabled(self._scene is not None)
        self.method.blockSignals(True)
        self.method.setCurrentIndex(self.method.findData(edit.method))
        self.method.blockSignals(False)
        self.method.setToolTip(method_tips()[edit.method])
        row, free = edit.deformer, edit.options[ReachOptions].free_radius
        size = self._scene.ellipses.scene_scale if self._scene is not None else 1.0
        for group, form in self.forms.items():
            form.setVisible(group is row.options)
            form.show_value(edit.options[group], size)
        self.kernels.show_value(edit.options[AdaptationOptions])
        self.weights.setVisible(row.has_weights)
        self.whole.setVisible(row.has_free_radius)
        self.whole.setChecked(free is None)
        for part in (self.free_radius, self._radius_label):
            part.setVisible(row.has_free_radius)
            part.setEnabled(free is not None)
        radius = world_length(_REACH.default if free is None else free, size)
        self.free_radius.setSingleStep(0.05 * size)
        self.free_radius.show_value(radius)
        self.show_state()

    def _form(self, group: type, edit: Edit) -> OptionsForm:
        form = OptionsForm(edit.options[group])
        form.changed.connect(lambda options: self._take(options, self._changed_label(options)))
        return form

    def _changed_label(self, group: Any) -> str:
        """What the one option is called in which a group differs from that of the edit."""
        before = self._scene.edit.options[type(group)] if self._scene is not None else group
        changed = (each for name, each in options_of(group).items() if getattr(group, name) != getattr(before, name))
        return next((each.label for each in changed), "")

    def _on_whole_clicked(self, whole: bool) -> None:
        self._take(ReachOptions(None if whole else _REACH.default), _REACH.label)

    def _take(self, group: object, what: str) -> None:
        if self._scene is not None:
            self._session.steps.change_edit(self._scene.edit.with_options(group), f"Change {what.lower()}")

    def _change(self, label: str, **values: Any) -> None:
        if self._scene is not None:
            self._session.steps.change_edit(replace(self._scene.edit, **values), label)
