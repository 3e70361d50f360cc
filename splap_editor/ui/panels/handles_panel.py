"""The list of handles and pins, and the numbers of the chosen one."""

from dataclasses import replace
from typing import Any

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QFrame, QGridLayout, QScrollArea, QVBoxLayout, QWidget

from splap_editor.core.handle_nodes import region_nodes
from splap_editor.core.options import world_length
from splap_editor.core.place import Place, placed_pose, pose_in_file
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import CageOptions
from splap_editor.engine.edit import Handle, Pin
from splap_editor.session.pivot import Pivot
from splap_editor.session.placement import pin_with_reach
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.tools.transform_tool import toggled
from splap_editor.ui.panels.cage_form import CageForm
from splap_editor.ui.panels.handle_rows import HandleRow, ListRow, PinRow
from splap_editor.ui.panels.pose_form import PoseForm
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import form_label
from splap_editor.ui.widgets.plain_text import PlainLabel

LIST_PX = 156
"""Height of the list, whatever is in it: what stands below does not jump."""

PIVOTS = {
    Pivot.MEDIAN: "The middle of the chosen",
    Pivot.ACTIVE: "The active handle",
    Pivot.POINT: "A placed point",
}


class HandlesPanel(QWidget):
    """Lists handles and pins, and follows every change of the edit."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._scene: Scene | None = None
        self.handle_rows: dict[int, HandleRow] = {}
        self.pin_rows: dict[int, PinRow] = {}
        self._counted: dict[int, tuple[object, int]] = {}
        self.list = self._made_list()
        self.pose_form = PoseForm()
        self.pose_form.setToolTip("Along the axes in the corner, in the units of the placed object.")
        self.pose_form.changed.connect(lambda pose: self._on_pose_changed(self._in_file(pose)))
        self.pose_form.previewed.connect(lambda pose: self._preview(self._in_file(pose)))
        self.cage_form = CageForm()
        self.cage_form.changed.connect(self._on_cage_changed)
        self.pivot = Choice(toolTip="What several handles turn and scale about; Shift + right click places the point.")
        for pivot, words in PIVOTS.items():
            self.pivot.addItem(words, pivot)
        self.pivot.activated.connect(self._on_pivot_chosen)
        self.pin_reach = NumberField(1e-6, 1e9, decimals=4, step=0.01)
        self.pin_reach.setToolTip("Radius on the surface of what the chosen pin holds.")
        self.pin_reach.committed.connect(self._on_reach_changed)
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        for row, (text, field) in enumerate((("Turn about", self.pivot), ("Pin's reach", self.pin_reach))):
            grid.addWidget(form_label(text, field), row, 0)
            grid.addWidget(field, row, 1)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self.list)
        layout.addWidget(self.pose_form)
        layout.addLayout(grid)
        layout.addWidget(self.cage_form)
        SceneFollower(
            session,
            self._on_scene_changed,
            edit_changed=self._show,
            preview_changed=self._show_pose,
            active_handles_changed=self._show_active,
            pivot_changed=self._show_pivot,
        )
        self._show()

    def _made_list(self) -> QScrollArea:
        self._empty = PlainLabel(
            "Click the surface with the Handle tool to move a place, with the Pin tool to hold one; or select splats "
            "and press H or P.",
            wordWrap=True,
        )
        self._empty.setProperty("tone", "quiet")
        page = QWidget()
        self._lines = QVBoxLayout(page)
        self._lines.setContentsMargins(0, 0, 0, 0)
        self._lines.setSpacing(0)
        self._lines.addWidget(self._empty)
        self._lines.addStretch(1)
        scroll = QScrollArea(widgetResizable=True)
        scroll.setObjectName("handleList")
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setFixedHeight(LIST_PX)
        scroll.setWidget(page)
        return scroll

    # ------------------------------------------------------------------ showing

    def _on_scene_changed(self) -> None:
        self._scene = self._session.scene
        self._counted = {}
        self._show()
        self._show_pivot()

    def _show(self) -> None:
        edit = self._scene.edit if self._scene is not None else None
        handles, pins = (edit.handles, edit.pins) if edit is not None else ((), ())
        ids = [handle.handle_id for handle in handles], [pin.pin_id for pin in pins]
        if ids != (list(self.handle_rows), list(self.pin_rows)):
            self._build_rows(*ids)
        for handle in handles:
            self.handle_rows[handle.handle_id].show_handle(handle)
        for pin in pins:
            self.pin_rows[pin.pin_id].show_pin(pin, self._n_splats(pin))
        self._empty.setVisible(not handles and not pins)
        self._show_active()

    def _n_splats(self, pin: Pin) -> int:
        """Count what a pin holds, once for each region it has."""
        region, n = self._counted.get(pin.pin_id, (None, 0))
        if region is not pin.region:
            n = len(region_nodes(pin.region, self._session.shown_scene.ellipses))
            self._counted[pin.pin_id] = (pin.region, n)
        return n

    def _show_active(self) -> None:
        scene = self._scene
        for rows, chosen in (
            (self.handle_rows, scene.active_handles if scene is not None else ()),
            (self.pin_rows, scene.active_pins if scene is not None else ()),
        ):
            for each_id, row in rows.items():
                row.show_active(each_id in chosen, bool(chosen) and each_id == chosen[-1])
        self._show_pose()
        pin = self._chosen_pin()
        self.pin_reach.setEnabled(pin is not None and pin.reach is not None)
        if scene is not None:
            self.pin_reach.setSingleStep(0.005 * scene.ellipses.scene_scale)
        if pin is not None and pin.reach is not None:
            self.pin_reach.show_value(pin.reach)

    def _show_pose(self) -> None:
        handle, scene = self._chosen(), self._scene
        unit = scene.ellipses.scene_scale if scene is not None else 1.0
        self.pose_form.setEnabled(handle is not None)
        place = scene.shown_edit.place if scene is not None else Place()
        pose = placed_pose(handle.pose, place) if handle is not None else Pose()
        self.pose_form.show_pose(pose, place.scale * unit)
        self.cage_form.setVisible(scene is not None and scene.edit.deformer.has_weights)
        self.cage_form.setEnabled(handle is not None)
        if handle is not None:
            self.cage_form.show_radius(world_length(handle.cage_radius, unit), unit)
        else:
            self.cage_form.show_radius(world_length(CageOptions.cage_radius, unit), unit)

    def _show_pivot(self) -> None:
        self.pivot.setCurrentIndex(list(PIVOTS).index(self._session.shown_scene.pivot))

    def _on_pivot_chosen(self, index: int) -> None:
        if self._scene is not None:
            self._scene.set_pivot(self.pivot.itemData(index))

    def _chosen(self) -> Handle | None:
        # The active ones may for a moment name a handle that an undo has just taken away.
        wanted = self._scene.active_handle if self._scene is not None else None
        handles = self._scene.shown_edit.handles if self._scene is not None else ()
        return next((handle for handle in handles if handle.handle_id == wanted), None)

    def _chosen_pin(self) -> Pin | None:
        scene = self._scene
        if scene is None or not scene.active_pins:
            return None
        return next((pin for pin in scene.edit.pins if pin.pin_id == scene.active_pins[-1]), None)

    def _build_rows(self, handle_ids: list[int], pin_ids: list[int]) -> None:
        known = {*self.handle_rows}, {*self.pin_rows}
        gone: list[ListRow] = [*self.handle_rows.values(), *self.pin_rows.values()]
        for row in gone:
            self._lines.removeWidget(row)
            row.hide()
            row.deleteLater()
        self.handle_rows = {handle_id: HandleRow(handle_id, self) for handle_id in handle_ids}
        self.pin_rows = {pin_id: PinRow(pin_id, self) for pin_id in pin_ids}
        made: list[ListRow] = [*self.handle_rows.values(), *self.pin_rows.values()]
        for place, row in enumerate(made):
            self._lines.insertWidget(place, row)
        new: list[ListRow] = [self.handle_rows[each] for each in handle_ids if each not in known[0]]
        new += [self.pin_rows[each] for each in pin_ids if each not in known[1]]
        if len(new) == 1:
            # Once it has its place.
            QTimer.singleShot(0, new[0], lambda: self.list.ensureWidgetVisible(new[0], 0, 0))

    # ------------------------------------------------------------------ changing

    def choose_handle(self, handle_id: int, *, add: bool) -> None:
        """Make a handle the active one, or one more of the chosen, or one less."""
        scene = self._session.shown_scene
        if add:
            scene.set_active_handles(toggled(scene.active_handles, handle_id), scene.active_pins)
        else:
            scene.set_active_handles((handle_id,))

    def choose_pin(self, pin_id: int, *, add: bool) -> None:
        """Choose a pin alone, or as one more, or one less."""
        scene = self._session.shown_scene
        if add:
            scene.set_active_handles(scene.active_handles, toggled(scene.active_pins, pin_id))
        else:
            scene.set_active_handles((), (pin_id,))

    def change_handle(self, handle_id: int, label: str, **values: Any) -> None:
        """Change fields of a handle as one undoable step."""
        edit = self._session.shown_scene.edit
        handle = edit.handle(handle_id)
        if any(getattr(handle, name) != value for name, value in values.items()):
            self._session.steps.change_edit(edit.with_handle(replace(handle, **values)), label)

    def change_pin(self, pin_id: int, label: str, **values: Any) -> None:
        """Change fields of a pin as one undoable step."""
        edit = self._session.shown_scene.edit
        pin = edit.pin(pin_id)
        if any(getattr(pin, name) != value for name, value in values.items()):
            self._session.steps.change_edit(edit.with_pin(replace(pin, **values)), label)

    def delete_handle(self, handle_id: int) -> None:
        """Delete a handle as one undoable step."""
        self._session.steps.change_edit(self._session.shown_scene.edit.without_handles((handle_id,)), "Delete handle")

    def delete_pin(self, pin_id: int) -> None:
        """Delete a pin as one undoable step."""
        self._session.steps.change_edit(self._session.shown_scene.edit.without_pins((pin_id,)), "Delete pin")

    def _in_file(self, pose: Pose) -> Pose:
        """Pose that is shown so."""
        return pose_in_file(pose, self._session.shown_scene.edit.place)

    def _preview(self, pose: Pose) -> None:
        self._session.drag.preview({self._session.shown_scene.active_handles[-1]: pose})

    def _on_pose_changed(self, pose: Pose) -> None:
        handle = self._chosen()
        if handle is None:
            return
        if self._session.shown_scene.preview is not None:
            self._preview(pose)
            self._session.drag.commit("Pose handle")
        else:
            self.change_handle(handle.handle_id, "Pose handle", pose=pose)

    def _on_cage_changed(self, radius: float | None) -> None:
        handle = self._chosen()
        if handle is not None:
            self.change_handle(handle.handle_id, "Change cage", cage_radius=radius)

    def _on_reach_changed(self, reach: float) -> None:
        pin = self._chosen_pin()
        if pin is not None and pin.reach is not None and reach != pin.reach:
            scene = self._session.shown_scene
            edit = scene.edit.with_pin(pin_with_reach(scene, pin, reach))
            self._session.steps.change_edit(edit, "Change reach of pin")
