"""The list of handles, and the pose of the chosen one in numbers."""

from dataclasses import replace

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QColorDialog,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from splap_editor.core.options import world_length
from splap_editor.core.pose import Pose
from splap_editor.engine.edit import Handle
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.panels.cage_form import CageForm
from splap_editor.ui.panels.pose_form import PoseForm
from splap_editor.ui.theme import STEP, icon
from splap_editor.ui.widgets.plain_text import PlainLabel


class HandlesPanel(QWidget):
    """Lists handles and pins, and follows every change of the edit."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._scene: Scene | None = None
        self._rows: dict[int, HandleRow] = {}
        self._empty = PlainLabel(
            "Pick the Handle tool and click the surface, or select splats and press H.", wordWrap=True
        )
        self._empty.setProperty("tone", "quiet")
        self._list = QVBoxLayout()
        self._list.setSpacing(0)
        self.pose_form = PoseForm()
        self.pose_form.changed.connect(self._on_pose_changed)
        self.pose_form.previewed.connect(lambda pose: self._preview(pose))
        self.cage_form = CageForm()
        self.cage_form.changed.connect(self._on_cage_changed)
        self._pins = PlainLabel()
        self._pins.setProperty("tone", "quiet")
        self._clear_pins = QPushButton("Clear")
        self._clear_pins.setFlat(True)
        self._clear_pins.clicked.connect(lambda: self._change("Clear pins", pins=()))
        pins = QHBoxLayout()
        pins.addWidget(self._pins, 1)
        pins.addWidget(self._clear_pins)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self._empty)
        layout.addLayout(self._list)
        layout.addWidget(self.pose_form)
        layout.addWidget(self.cage_form)
        layout.addLayout(pins)
        SceneFollower(
            session,
            self._on_scene_changed,
            edit_changed=self._show,
            preview_changed=self._show_pose,
            active_handles_changed=self._show_active,
        )
        self._show()

    def _on_scene_changed(self) -> None:
        self._scene = self._session.scene
        self._show()

    def _show(self) -> None:
        handles = self._scene.edit.handles if self._scene is not None else ()
        if [handle.handle_id for handle in handles] != list(self._rows):
            self._build_rows(handles)
        for handle in handles:
            self._rows[handle.handle_id].show_handle(handle)
        n_pins = len(self._scene.edit.pins) if self._scene is not None else 0
        self._pins.setText(f"{n_pins} pinned region{'s' if n_pins != 1 else ''}")
        self._pins.setVisible(n_pins > 0)
        self._clear_pins.setVisible(n_pins > 0)
        self._empty.setVisible(not handles)
        self._show_active()

    def _show_active(self) -> None:
        chosen = self._scene.active_handles if self._scene is not None else ()
        for handle_id, row in self._rows.items():
            row.show_active(handle_id in chosen)
        self._show_pose()

    def _show_pose(self) -> None:
        handle = self._chosen()
        self.pose_form.setVisible(handle is not None)
        if handle is not None:
            self.pose_form.show_pose(handle.pose, self._scene.ellipses.scene_scale)
        has_cage = handle is not None and self._scene.edit.deformer.has_weights
        self.cage_form.setVisible(has_cage)
        if has_cage:
            radius = world_length(handle.cage_radius, self._scene.ellipses.scene_scale)
            self.cage_form.show_radius(radius, self._scene.ellipses.scene_scale)

    def _chosen(self) -> Handle | None:
        # The active ones may for a moment name a handle that an undo has just taken away.
        chosen = self._scene.active_handles if self._scene is not None else ()
        handles = [handle for handle in self._scene.shown_edit.handles if handle.handle_id in chosen] if chosen else []
        return max(handles, key=lambda handle: chosen.index(handle.handle_id), default=None)

    def _build_rows(self, handles: tuple[Handle, ...]) -> None:
        for row in self._rows.values():
            self._list.removeWidget(row)
            row.hide()
            row.deleteLater()
        self._rows = {handle.handle_id: HandleRow(handle.handle_id, self) for handle in handles}
        for row in self._rows.values():
            self._list.addWidget(row)

    def choose(self, handle_id: int, *, add: bool) -> None:
        """Make a handle the active one, or add it to the active ones."""
        others = tuple(h for h in self._scene.active_handles if h != handle_id) if add else ()
        self._scene.set_active_handles((*others, handle_id))

    def change_handle(self, handle_id: int, label: str, **values: object) -> None:
        """Change fields of a handle as one undoable step."""
        handle = self._scene.edit.handle(handle_id)
        if any(getattr(handle, name) != value for name, value in values.items()):
            self._session.change_edit(self._scene.edit.with_handle(replace(handle, **values)), label)

    def delete_handle(self, handle_id: int) -> None:
        """Delete a handle as one undoable step."""
        self._session.change_edit(self._scene.edit.without_handles((handle_id,)), "Delete handle")

    def _change(self, label: str, **values: object) -> None:
        self._session.change_edit(replace(self._scene.edit, **values), label)

    def _preview(self, pose: Pose) -> None:
        self._session.preview_poses({self._scene.active_handles[-1]: pose})

    def _on_pose_changed(self, pose: Pose) -> None:
        handle = self._chosen()
        if handle is None:
            return
        if self._scene.preview is not None:
            self._preview(pose)
            self._session.commit_preview("Pose handle")
        else:
            self.change_handle(handle.handle_id, "Pose handle", pose=pose)

    def _on_cage_changed(self, radius: float | None) -> None:
        handle = self._chosen()
        if handle is not None:
            self.change_handle(handle.handle_id, "Change cage", cage_radius=radius)


class HandleRow(QFrame):
    """Swatch, name, switch, reset and delete of one handle; a click chooses it."""

    def __init__(self, handle_id: int, panel: HandlesPanel) -> None:
        super().__init__()
        self.setObjectName("handleRow")
        self._id = handle_id
        self._panel = panel
        self.swatch = QToolButton(toolTip="Colour", autoRaise=True)
        self.swatch.setFixedSize(20, 20)
        self.swatch.clicked.connect(self._on_swatch_clicked)
        self.name = QLineEdit(toolTip="Rename")
        self.name.setObjectName("nameField")
        self.name.editingFinished.connect(self._on_renamed)
        self.is_enabled = QCheckBox(toolTip="A switched-off handle neither moves nor holds anything")
        self.is_enabled.clicked.connect(lambda on: panel.change_handle(self._id, "Switch handle", enabled=on))
        self.reset = self._tool("reset", "Put it back to rest")
        self.reset.clicked.connect(lambda: panel.change_handle(self._id, "Reset pose", pose=Pose()))
        self.delete = self._tool("trash", "Delete")
        self.delete.clicked.connect(lambda: panel.delete_handle(self._id))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(STEP, 2, STEP, 2)
        layout.setSpacing(STEP)
        for part in (self.is_enabled, self.swatch):
            layout.addWidget(part)
        layout.addWidget(self.name, 1)
        layout.addWidget(self.reset)
        layout.addWidget(self.delete)

    def show_handle(self, handle: Handle) -> None:
        """Show a handle's name, colour and state."""
        self._color = handle.color
        self.swatch.setStyleSheet(
            f"QToolButton {{ background: {handle.color}; border-radius: 7px; margin: 3px; padding: 0; }}"
        )
        if not self.name.hasFocus():
            self.name.setText(handle.name)
        self.is_enabled.setChecked(handle.enabled)
        self.name.setEnabled(True)
        self.reset.setEnabled(not handle.pose.is_identity)

    def show_active(self, is_active: bool) -> None:
        """Mark the row of an active handle."""
        if self.property("active") != is_active:
            self.setProperty("active", is_active)
            self.style().unpolish(self)
            self.style().polish(self)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the handle; with Shift or Ctrl as well."""
        held = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier
        self._panel.choose(self._id, add=bool(event.modifiers() & held))

    def _on_renamed(self) -> None:
        self.name.clearFocus()
        self._panel.change_handle(self._id, "Rename handle", name=self.name.text().strip() or f"Handle {self._id}")

    def _on_swatch_clicked(self) -> None:
        dialog = QColorDialog(QColor(self._color), self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.colorSelected.connect(
            lambda color: self._panel.change_handle(self._id, "Colour handle", color=color.name())
        )
        dialog.open()

    def _tool(self, name: str, tip: str) -> QToolButton:
        return QToolButton(icon=icon(name), toolTip=tip, autoRaise=True, iconSize=QSize(16, 16))
