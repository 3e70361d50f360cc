"""Colour grades of the selection or of everything, each by sliders that the picture follows."""

from dataclasses import replace

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.options import options_of
from splap_editor.engine.grading import LARGEST_STACK, Grading
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice, Slider
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import FieldHint, form_label, hints_of
from splap_editor.ui.widgets.plain_text import PlainLabel

TICKS = 1000
"""Places of a slider from end to end."""

_MOST_OF_FACTOR = 2.0
"""Where the slider of a factor ends; its field goes on to what the option allows."""


class _Row:
    """Slider and number of one option."""

    def __init__(self, name: str, hint: FieldHint) -> None:
        self.name, self.hint = name, hint
        is_factor = getattr(GradeOptions, name) == 1.0
        self.low, self.high = hint.low, hint.factor * _MOST_OF_FACTOR if is_factor else hint.high
        self.slider = Slider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, TICKS)
        self.slider.setToolTip(hint.tip)
        self.slider.setAccessibleName(hint.label)
        self.field = NumberField(hint.low, hint.high, decimals=hint.decimals, step=hint.step, unit=hint.unit)
        self.field.setFixedWidth(72)
        self.field.setToolTip(hint.tip)
        self.label = form_label(hint.label, self.field)
        for part in (self.slider, self.field):
            part.setObjectName(name)

    @property
    def slid(self) -> float:
        """Value that the slider is at, to as many digits as the field shows."""
        shown = self.low + (self.high - self.low) * self.slider.value() / TICKS
        return float(round(shown, self.hint.decimals) / self.hint.factor)

    def show(self, value: float) -> None:
        """Show a value without telling anyone; a slider that is held stays under the hand."""
        shown = self.hint.factor * value
        self.field.show_value(shown)
        if not self.slider.isSliderDown():
            self.slider.blockSignals(True)
            self.slider.setValue(round(TICKS * (shown - self.low) / (self.high - self.low)))
            self.slider.blockSignals(False)

    def set_visible(self, is_shown: bool) -> None:
        """Show or hide all of it."""
        for part in (self.label, self.slider, self.field):
            part.setVisible(is_shown)


class GradePanel(QWidget):
    """Which grades there are, and what the chosen one does; a slider that is held is a preview, let go it is a step.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.add_selection = _button("Grade selection", "A new grade of the selected splats, over the others")
        self.add_everything = _button("Grade everything", "A new grade of all splats, over the others")
        self.add_selection.clicked.connect(lambda: self._add(of_selection=True))
        self.add_everything.clicked.connect(lambda: self._add(of_selection=False))
        self.chosen = Choice(toolTip="Grades in the order in which they are applied")
        self.chosen.currentIndexChanged.connect(lambda index: self._show())
        self.delete = _button("Delete", "Take the chosen grade away")
        self.delete.clicked.connect(self._delete)
        self.note = PlainLabel("Colours are as in the file.", wordWrap=True)
        self.note.setProperty("tone", "quiet")
        self.rows = {name: _Row(name, hint) for name, hint in hints_of(GradeOptions).items()}
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        for number, row in enumerate(self.rows.values()):
            for column, part in enumerate((row.label, row.slider, row.field)):
                grid.addWidget(part, number, column)
            self._connect(row)
        head, adding = QHBoxLayout(), QHBoxLayout()
        head.addWidget(self.chosen, 1)
        head.addWidget(self.delete)
        adding.addWidget(self.add_selection)
        adding.addWidget(self.add_everything)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self.note)
        layout.addLayout(head)
        layout.addLayout(grid)
        layout.addLayout(adding)
        SceneFollower(
            session,
            self._show_all,
            edit_changed=self._show_all,
            preview_changed=self._show,
            selection_changed=self._show_buttons,
        )
        self._show_all()

    @property
    def index(self) -> int:
        """Place of the chosen grade in the edit; -1 without any."""
        return self.chosen.currentIndex()

    def _connect(self, row: _Row) -> None:
        def slid() -> None:
            if row.slider.isSliderDown():
                self._session.drag.preview_grading(self._changed(row, row.slid))
            else:
                self._take(row, row.slid)

        def released() -> None:
            # Without a move there is nothing to take: a value typed finer than the slider's places stays.
            if self._session.shown_scene.preview is not None:
                self._take(row, row.slid)

        row.slider.valueChanged.connect(slid)
        row.slider.sliderReleased.connect(released)
        row.field.committed.connect(lambda value: self._take(row, float(f"{value / row.hint.factor:.12g}")))

    def _changed(self, row: _Row, value: float) -> Grading:
        """The grades with one option of the chosen one changed."""
        grading = self._session.shown_scene.edit.grading
        return grading.with_options(self.index, replace(grading.steps[self.index].options, **{row.name: value}))

    def _take(self, row: _Row, value: float) -> None:
        scene = self._session.scene
        if scene is None or self.index < 0:
            return
        if getattr(scene.edit.grading.steps[self.index].options, row.name) != value:
            self._put(self._changed(row, value), f"Change {row.hint.label.lower()}")
        elif scene.preview is not None:
            self._session.drag.cancel()

    def _put(self, grading: Grading, label: str) -> None:
        scene = self._session.shown_scene
        self._session.steps.change_edit(replace(scene.edit, grading=grading), label)

    def _add(self, *, of_selection: bool) -> None:
        scene = self._session.shown_scene
        self._put(scene.edit.grading.with_grade(scene.selection.copy() if of_selection else None), "Grade splats")
        self.chosen.setCurrentIndex(self.chosen.count() - 1)

    def _delete(self) -> None:
        self._put(self._session.shown_scene.edit.grading.without(self.index), "Delete grade")

    def _show_all(self) -> None:
        """Show which grades there are, the one chosen before as far as it is still there."""
        scene = self._session.scene
        grading = scene.edit.grading if scene is not None else Grading()
        index = self.index
        self.chosen.blockSignals(True)
        self.chosen.clear()
        for number, mask in enumerate(grading.masks, start=1):
            n = 0 if mask is None else int(mask.sum())
            what = "everything" if mask is None else f"{n:,} splat{'' if n == 1 else 's'}"
            self.chosen.addItem(f"{number} · {what}")
        self.chosen.setCurrentIndex(min(max(index, 0), self.chosen.count() - 1))
        self.chosen.blockSignals(False)
        self._show()

    def _show(self) -> None:
        scene = self._session.scene
        self.setEnabled(scene is not None)
        has_grade = scene is not None and self.index >= 0
        self.note.setVisible(not has_grade)
        self.chosen.setVisible(has_grade)
        self.delete.setVisible(has_grade)
        if scene is not None and has_grade:
            self._show_values(scene)
        else:
            for row in self.rows.values():
                row.set_visible(False)
        self._show_buttons()

    def _show_values(self, scene: Scene) -> None:
        grading = scene.shown_edit.grading
        options, mask = grading.steps[self.index].options, grading.masks[self.index]
        falloff = self.rows["falloff"]
        falloff.high = scene.ellipses.scene_scale
        falloff.field.setSingleStep(0.01 * falloff.high)
        for name in options_of(GradeOptions):
            row = self.rows[name]
            # What is of everything has nothing to fade into.
            row.set_visible(name != "falloff" or mask is not None)
            row.show(getattr(options, name))

    def _show_buttons(self) -> None:
        scene = self._session.scene
        has_room = scene is not None and len(scene.edit.grading.steps) < LARGEST_STACK
        self.add_everything.setEnabled(has_room)
        self.add_selection.setEnabled(has_room and scene is not None and bool(scene.selection.any()))


def _button(text: str, tip: str) -> QPushButton:
    button = QPushButton(text)
    button.setToolTip(tip)
    return button
