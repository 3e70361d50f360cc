"""Which quantity colours the splats, by which map, and its histogram."""

from PySide6.QtWidgets import QCheckBox, QComboBox, QGridLayout, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from splap_editor.core.index_spaces import FileMask
from splap_editor.engine.quantities import QUANTITIES
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.selection import SelectionMode, combined_selection
from splap_editor.session.session import Session
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.histogram import Histogram
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import form_label
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.viewport.colormaps import COLORMAPS
from splap_editor.viewport.quantity_view import QuantityView


class QuantityPanel(QWidget):
    """Edits the options of a `QuantityView`; selects splats by their values."""

    def __init__(self, session: Session, view: QuantityView, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._view = view
        self._before: FileMask | None = None
        self.choice = Choice(toolTip="Colour the splats by this number")
        self.choice.addItem("Own colours", "")
        for name, quantity in QUANTITIES.items():
            self.choice.addItem(quantity.label, name)
        self.choice.currentIndexChanged.connect(lambda index: view.set(name=self.choice.itemData(index)))
        self.colormap = Choice(toolTip="Colour map; all can be told apart by colour-blind eyes")
        for name in COLORMAPS:
            self.colormap.addItem(name.replace("-", " – ").capitalize(), name)
        self.colormap.currentIndexChanged.connect(lambda index: view.set(colormap=self.colormap.itemData(index)))
        self.log = QCheckBox("Log")
        self.log.setToolTip("Equal ratios take equal shares of the colours")
        self.log.toggled.connect(lambda on: view.set(is_log=on, low=None, high=None))
        self.lack = PlainLabel(wordWrap=True)
        self.lack.setProperty("tone", "quiet")
        self.histogram = Histogram()
        self.histogram.picking.connect(self._preview)
        self.histogram.picked.connect(self._select)
        self.histogram.dropped.connect(self._drop)
        self.histogram.range_changed.connect(lambda low, high: view.set(low=low, high=high))
        self.histogram.range_reset.connect(self.reset_range)
        self.low, self.high = self._end("Lowest colour"), self._end("Highest colour")
        self.low.committed.connect(lambda value: view.set(low=value))
        self.high.committed.connect(lambda value: view.set(high=value))
        self.reset = QPushButton("Auto")
        self.reset.setToolTip("Leave the ends of the colours to the values")
        self.reset.setFlat(True)
        self.reset.clicked.connect(self.reset_range)
        for combo in (self.choice, self.colormap):
            combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self._add_parts()
        view.changed.connect(self._show)
        SceneFollower(session, lambda: self.setEnabled(session.scene is not None))
        self.setEnabled(session.scene is not None)
        self._show()

    def reset_range(self) -> None:
        """Leave the ends of the colours to the values."""
        self._view.set(low=None, high=None)

    def _add_parts(self) -> None:
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        grid.addWidget(form_label("Colour by", self.choice), 0, 0)
        grid.addWidget(self.choice, 0, 1, 1, 2)
        self._map_label = form_label("Colours", self.colormap)
        grid.addWidget(self._map_label, 1, 0)
        grid.addWidget(self.colormap, 1, 1)
        grid.addWidget(self.log, 1, 2)
        self._ends = QWidget()
        ends = QHBoxLayout(self._ends)
        ends.setContentsMargins(0, 0, 0, 0)
        for part in (self.low, self.reset, self.high):
            ends.addWidget(part, 0 if part is self.reset else 1)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        layout.addLayout(grid)
        for below in (self.lack, self.histogram, self._ends):
            layout.addWidget(below)

    @staticmethod
    def _end(tip: str) -> NumberField:
        field = NumberField(-1e12, 1e12, decimals=6)
        field.setToolTip(tip)
        return field

    def _show(self) -> None:
        options, shown = self._view.options, self._view.shown
        for combo, data in ((self.choice, options.name), (self.colormap, options.colormap)):
            combo.blockSignals(True)
            combo.setCurrentIndex(combo.findData(data))
            combo.blockSignals(False)
        self.log.blockSignals(True)
        self.log.setChecked(options.is_log)
        self.log.blockSignals(False)
        self.lack.setText(f"Needs {self._view.lack}." if self._view.lack else "")
        self.lack.setVisible(bool(self._view.lack))
        is_scale = bool(options.name) and not QUANTITIES[options.name].is_label
        for part in (self._map_label, self.colormap, self.log):
            part.setVisible(is_scale)
        self._ends.setVisible(is_scale and shown is not None)
        self.histogram.setVisible(shown is not None)
        self.histogram.show_quantity(shown)
        if shown is not None:
            self.low.show_value(shown.low)
            self.high.show_value(shown.high)
            for field in (self.low, self.high):
                field.setSingleStep(max((shown.high - shown.low) / 50.0, 1e-6))

    # Selecting by value -------------------------------------------------------------------------------------------

    def _preview(self, low: float, high: float, mode: SelectionMode) -> None:
        scene = self._session.shown_scene
        if self._before is None:
            self._before = scene.selection
        scene.set_selection(self._combined(self._before, low, high, mode))

    def _select(self, low: float, high: float, mode: SelectionMode) -> None:
        before = self._session.shown_scene.selection if self._before is None else self._before
        selection = self._combined(before, low, high, mode)
        self._drop()
        self._session.steps.change_mask("selection", selection, "Select by value")

    def _drop(self) -> None:
        if self._before is not None:
            self._session.shown_scene.set_selection(self._before)
            self._before = None

    def _combined(self, before: FileMask, low: float, high: float, mode: SelectionMode) -> FileMask:
        shown = self._view.shown
        assert shown is not None  # who picks sees its bars
        return combined_selection(before, shown.within(low, high) & ~self._session.shown_scene.unseen, mode)
