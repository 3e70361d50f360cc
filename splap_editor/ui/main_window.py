"""The window: viewport in the middle, tools at the left, panels at the right, one line of state below."""

from PySide6.QtCore import QEvent, QPoint, QRect, QSettings, QSize, Qt, Signal
from PySide6.QtGui import QCloseEvent, QKeyEvent
from PySide6.QtWidgets import (
    QApplication,
    QMainWindow,
    QMenu,
    QSizePolicy,
    QToolBar,
    QVBoxLayout,
    QWidget,
)

from splap_editor.session.autosave import Autosave
from splap_editor.session.documents import Documents
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.tools.floaters_tool import FloatersTool
from splap_editor.tools.handle_tool import HandleTool
from splap_editor.tools.place_tool import PlaceTool
from splap_editor.tools.select_tool import SelectOptions
from splap_editor.tools.tool import ToolContext
from splap_editor.tools.tool_manager import ToolManager
from splap_editor.tools.tool_table import TOOLS
from splap_editor.ui.actions.action_table import ACTIONS
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.actions.conditions import State
from splap_editor.ui.actions.display_actions import DisplayActions
from splap_editor.ui.actions.document_actions import DocumentActions
from splap_editor.ui.actions.edit_actions import EditActions
from splap_editor.ui.actions.file_actions import FileActions
from splap_editor.ui.actions.handle_actions import HandleActions
from splap_editor.ui.actions.menus import fill_menu_bar
from splap_editor.ui.actions.place_actions import PlaceActions
from splap_editor.ui.actions.pose_actions import PoseActions
from splap_editor.ui.actions.program_actions import ProgramActions
from splap_editor.ui.actions.removal_actions import RemovalActions
from splap_editor.ui.actions.select_actions import SelectActions
from splap_editor.ui.actions.selection_sets_menu import SelectionSetsMenu
from splap_editor.ui.actions.timeline_actions import TimelineActions
from splap_editor.ui.actions.tool_actions import ToolActions
from splap_editor.ui.actions.view_actions import ViewActions
from splap_editor.ui.display import Display
from splap_editor.ui.file_drop import FileDrop
from splap_editor.ui.inspection import Inspection
from splap_editor.ui.panels.deformer_panel import DeformerPanel
from splap_editor.ui.panels.display_panel import DisplayPanel
from splap_editor.ui.panels.floaters_panel import FloatersPanel
from splap_editor.ui.panels.grade_panel import GradePanel
from splap_editor.ui.panels.handles_panel import HandlesPanel
from splap_editor.ui.panels.panel_dock import PanelDock
from splap_editor.ui.panels.place_panel import PlacePanel
from splap_editor.ui.panels.scene_panel import ScenePanel
from splap_editor.ui.panels.section import bring_into_view
from splap_editor.ui.preferences import PreferenceStore
from splap_editor.ui.theme import show_more_button
from splap_editor.ui.timeline.strip import TimelineStrip
from splap_editor.ui.viewport_widget import ViewportWidget, is_typed_into
from splap_editor.ui.widgets.job_bar import JobBar
from splap_editor.ui.widgets.overlay import Overlay
from splap_editor.ui.widgets.recovery_bar import RecoveryBar
from splap_editor.ui.widgets.state_line import StateLine
from splap_editor.ui.widgets.toast import Toast
from splap_editor.ui.widgets.tool_options import ToolOptionsBar
from splap_editor.ui.widgets.weight_legend import WeightLegend
from splap_editor.viewport.scene_view import SceneView

HINT = ("Click the surface to place a handle.", "Drag the arrows.")
CONTEXT_MENU = (
    "handle.from_selection",
    "handle.pin_selection",
    "handle.pin_rest",
    "",
    "handle.reset",
    "handle.delete",
    "",
    "remove.selected",
    "remove.others",
    "",
    "select.hide",
    "select.isolate",
    "select.show_all",
    "",
    "view.frame_selection",
    "view.home",
)
LAYOUT_VERSION = 1
FRAME = QSize(16, 48)
"""Room for the frame and title that a window manager gives a window."""

UPS = {(0.0, 0.0, 1.0): "view.up_z", (0.0, 1.0, 0.0): "view.up_y", (0.0, -1.0, 0.0): "view.down_y"}

GUESSED_UP = (0.0, -1.0, 0.0)
"""What structure from motion mostly makes of up: true of most captures, and no more."""


class MainWindow(FileDrop, QMainWindow):
    """Puts the parts together; what they do is in the actions, what is true in the session.

    Parameters
    ----------
    session : Session
    documents : Documents
    autosave : Autosave
    viewport : ViewportWidget
    view : SceneView
        What ``viewport`` shows.
    context : ToolContext
    tools : ToolManager
    display : Display
    """

    closing = Signal()
    """Nothing keeps the window open any more: what goes on for it elsewhere ends."""

    def __init__(
        self,
        session: Session,
        documents: Documents,
        autosave: Autosave,
        viewport: ViewportWidget,
        view: SceneView,
        context: ToolContext,
        tools: ToolManager,
        display: Display,
    ) -> None:
        super().__init__()
        self.setObjectName("main")
        self.setMinimumSize(900, 600)
        self.setAcceptDrops(True)
        self.session, self.viewport, self.view, self.tools, self.display = session, viewport, view, tools, display
        self.documents, self.autosave = documents, autosave
        self._may_close = False
        self._keeps_edit = False
        self._has_hinted = bool(QSettings().value("hint/done", False, type=bool))
        self.overlay = Overlay(context.hud, viewport)
        self.weight_legend = WeightLegend(view.weights, viewport)
        self.toast = Toast(viewport)
        self.inspection = Inspection(
            session,
            view,
            context,
            tools,
            viewport,
            say=self.toast.say,
            fly_to=lambda end: self.view_actions.fly_to(end),
        )
        self.dock = PanelDock()
        self.actions_ = self._actions()
        self.program.actions = self.actions_
        self.inspection.set_actions(self.actions_)
        menus = fill_menu_bar(self.menuBar(), self.actions_)
        menus["&Select"].insertMenu(self.actions_["select.through"], self.selection_sets)
        menus["&File"].insertMenu(self.actions_["file.open_sample"], self.document_actions.recent)
        self._add_tool_column()
        self._add_centre()
        self._add_panels()
        self.job_bar = JobBar(session)
        self.state_line = StateLine(session, tools)
        self.statusBar().setSizeGripEnabled(False)
        self.statusBar().addWidget(self.job_bar, 1)
        self.statusBar().addPermanentWidget(self.inspection.read_out)
        self.statusBar().addPermanentWidget(self.state_line)
        # In a narrow window there is room for one of the two.
        self.job_bar.shown.connect(lambda on: self.state_line.hint.setVisible(not on))
        self._follow()
        self._show_tool()
        self._show_display()
        self._restore()
        self._refresh()
        viewport.setFocus()

    # ---------------------------------------------------------------- parts

    def _follow(self) -> None:
        """Show what changes anywhere, and pass on what the parts ask for."""
        session, viewport, view, display = self.session, self.viewport, self.view, self.display
        viewport.setCursor(Qt.CursorShape.CrossCursor)
        viewport.resized.connect(self._on_viewport_resized)
        viewport.compare_held.connect(display.hold_original)
        viewport.menu_wanted.connect(self._on_menu_wanted)
        viewport.frame_drawn.connect(self.deformer_panel.show_timing)
        SceneFollower(
            session,
            self._on_scene_changed,
            selection_changed=self._refresh,
            hidden_changed=self._refresh,
            removed_changed=self._on_removed_changed,
            active_handles_changed=self._refresh,
            pivot_changed=self._show_pivot,
            up_changed=self._show_up,
            surface_changed=self._refresh,
            edit_changed=self._on_edit_changed,
        )
        session.history.changed.connect(self._refresh)
        session.state_changed.connect(self._on_state_changed)
        session.exported.connect(lambda report: self._refresh())
        self.documents.changed.connect(self._refresh)
        self.inspection.changed.connect(self._refresh)
        session.told_job.changed.connect(lambda job: self._refresh())
        session.failed.connect(self._on_failed)
        self.deformer_panel.radius_hovered.connect(view.show_free_ring)
        self.deformer_panel.weights.set_action(self.actions_["display.weights"])
        self.handles_panel.cage_form.previewed.connect(view.weights.preview_cage)
        self.tools.chosen_changed.connect(self._show_tool)
        self.tools.chosen_changed.connect(self._show_first_steps)
        display.changed.connect(self._show_display)

    def _actions(self) -> ActionSet:
        session, view, tools = self.session, self.view, self.tools
        handles = HandleActions(session, view.viewport)
        through = tools.context.held(SelectOptions)
        through.changed.connect(lambda: self.actions_.check("select.through", through.value.through))
        saving = DocumentActions(self, session, self.documents, self.autosave, view.viewport, self.display, self.toast)
        self.document_actions = saving
        self.files = FileActions(self, session, self.documents, view.viewport, self.toast, saving.save_then)
        self.selection_sets = SelectionSetsMenu(session, self)
        self.timeline_actions = TimelineActions(self, session, view.viewport, self.toast)
        self.recovery_bar = RecoveryBar(self.autosave, self.files.leave_edit)
        self.view_actions = ViewActions(session, view, self, self.dock)
        self.program = ProgramActions(self, PreferenceStore(session, view, tools.context))
        return ActionSet(
            self,
            ACTIONS,
            (
                self.program,
                self.files,
                saving,
                self.timeline_actions,
                PoseActions(session, self.toast),
                self.selection_sets,
                EditActions(session, tools),
                SelectActions(session, through, view.viewport),
                handles,
                RemovalActions(session, handles, self.toast),
                PlaceActions(session),
                DisplayActions(self.display),
                self.inspection.graph_actions,
                self.view_actions,
                ToolActions(tools),
            ),
            State(session, self.inspection.graph_actions),
        )

    def _add_tool_column(self) -> None:
        column = QToolBar("Tools")
        column.setObjectName("toolColumn")
        column.setMovable(False)
        column.setIconSize(QSize(22, 22))
        column.toggleViewAction().setVisible(False)
        for k, entry in enumerate(TOOLS):
            if k and TOOLS[k - 1].group != entry.group:
                column.addSeparator()
            column.addAction(self.actions_[f"tool.{entry.name}"])
        space = QWidget()
        space.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
        column.addWidget(space)
        for action_id in ("file.open", "file.export", "help.sheet"):
            column.addAction(self.actions_[action_id])
        self.addToolBar(Qt.ToolBarArea.LeftToolBarArea, column)
        show_more_button(column)

    def _add_centre(self) -> None:
        centre = QWidget()
        layout = QVBoxLayout(centre)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(ToolOptionsBar(self.tools, self.actions_))
        layout.addWidget(self.recovery_bar)
        layout.addWidget(self.viewport, 1)
        layout.addWidget(TimelineStrip(self.session, self.timeline_actions, self.actions_))
        self.timeline_actions.shown_changed.connect(lambda on: self.actions_.check("timeline.show", on))
        self.setCentralWidget(centre)

    def _add_panels(self) -> None:
        self.handles_panel = HandlesPanel(self.session)
        self.deformer_panel = DeformerPanel(self.session)
        self.place_panel = PlacePanel(self.session, self.actions_)
        self.grade_panel = GradePanel(self.session)
        floaters = self.tools.tools[FloatersTool.name]
        assert isinstance(floaters, FloatersTool)
        self.floaters_panel = FloatersPanel(floaters)
        self.display_panel = DisplayPanel(self.display, self.actions_)
        self.scene_panel = ScenePanel(self.session)
        self.scene_panel.reread.connect(self.files.reread)
        panels = {
            "Handles": self.handles_panel,
            "Deformer": self.deformer_panel,
            "Place": self.place_panel,
            "Grade": self.grade_panel,
            "Floaters": self.floaters_panel,
            "Display": self.display_panel,
            **dict(self.inspection.panels),
            "Scene": self.scene_panel,
        }
        self.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, self.dock)
        self.floaters_section = self.dock.filled(panels, hidden=("Floaters",))["Floaters"]
        self.resizeDocks([self.dock], [304], Qt.Orientation.Horizontal)

    # ---------------------------------------------------------------- state

    def _refresh(self) -> None:
        history = self.session.history
        for name in ("undo", "redo"):
            label = getattr(history, f"{name}_label")
            self.actions_[f"edit.{name}"].setText(f"&{name.title()} {label.lower()}".rstrip())
        self.actions_.refresh()
        scene = self.session.scene
        path = self.documents.path or (scene.file.path if scene is not None else None)
        self.setWindowTitle(f"{path.name}[*] – SpLap Editor" if path is not None else "SpLap Editor")
        self.setWindowModified(self.documents.would_lose)

    def _show_tool(self) -> None:
        self.actions_.check(f"tool.{self.tools.chosen.name}")
        name = self.tools.chosen.name
        # It has something to say only while there are groups to choose from.
        self.floaters_section.setVisible(name == FloatersTool.name)
        if name in (PlaceTool.name, FloatersTool.name):
            bring_into_view(self.place_panel if name == PlaceTool.name else self.floaters_panel)

    def _show_display(self) -> None:
        options = self.display.options
        self.actions_.check(f"display.{options.mode}")
        self.actions_.check(f"display.{options.shown}")
        self.actions_.check("display.weights", options.weights)
        self.display.apply(self.view)

    def _show_pivot(self) -> None:
        self.actions_.check(f"handle.pivot_{self.session.shown_scene.pivot.value}")

    def _show_up(self) -> None:
        """Check the axis that is up; along another one the last of the three stays."""
        action = UPS.get(self.session.shown_scene.up)
        if action is not None:
            self.actions_.check(action)

    def _on_scene_changed(self) -> None:
        self._show_pivot()
        self._show_up()
        self.actions_.check("remove.show", False)
        self.display.apply(self.view)
        self._show_first_steps()
        self._tell_up()
        self._refresh()

    def _tell_up(self) -> None:
        """Say once, ever, that which way is up was guessed, and where that is put right."""
        scene, settings = self.session.shown_scene, QSettings()
        is_guess = self.view.preferred_up is None and scene.up == GUESSED_UP and scene.edit.place.is_identity
        if is_guess and not settings.value("up/told", False, type=bool):
            settings.setValue("up/told", True)
            self.toast.say("Such a file does not say which way is up. If it lies on its side: View ▸ Up.")

    def _on_state_changed(self) -> None:
        if self.session.state == "opening":
            self.overlay.show_hint("Opening the file …")
        self._refresh()

    def _on_failed(self, title: str, error: Exception) -> None:
        if self.session.scene is None:
            self.overlay.show_hint("Drop a splat PLY here, or press Ctrl+O.")

    def _on_removed_changed(self) -> None:
        self.actions_.check("remove.show", self.session.shown_scene.shows_removed)
        self._refresh()

    def _on_edit_changed(self) -> None:
        self._show_first_steps()
        self._refresh()

    def _show_first_steps(self) -> None:
        """Say how to place and drag a first handle, as long as nobody did and the tool for it is in use."""
        if self.session.scene is None:
            return
        edit = self.session.scene.edit
        self._has_hinted |= bool(edit.handles) and not edit.is_identity
        if self._has_hinted or self.tools.chosen.name != HandleTool.name:
            self.overlay.show_hint()
        else:
            self.overlay.show_hint(*(HINT[1:] if edit.handles else HINT))

    def _on_viewport_resized(self) -> None:
        self.overlay.setGeometry(self.viewport.rect())
        self.view.viewport.set_scale(self.viewport.devicePixelRatioF())

    def _on_menu_wanted(self, position: QPoint) -> None:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        for action_id in CONTEXT_MENU:
            if not action_id:
                menu.addSeparator()
            elif self.actions_[action_id].isEnabled():
                menu.addAction(self.actions_[action_id])
        menu.popup(position)

    # ---------------------------------------------------------------- keyboard

    def event(self, event: QEvent) -> bool:
        """Let tools have a key that no text field wants, wherever the focus is."""
        is_override = event.type() == QEvent.Type.ShortcutOverride
        is_free = not (self.viewport.hasFocus() or is_typed_into(QApplication.focusWidget()))
        if is_override and is_free and isinstance(event, QKeyEvent) and self.viewport.take_before_shortcuts(event):
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take a key that the focused widget did not want; Return and Escape bring the keyboard back to the picture.

        Where something was typed they do no more than that: what the tool does on Return is the next one's.
        """
        if self.viewport.hasFocus():
            return
        is_typed = is_typed_into(QApplication.focusWidget())
        is_leaving = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape)
        if not (is_leaving and is_typed):
            self.viewport.keyPressEvent(event)
        if is_leaving:
            self.viewport.setFocus()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Let go of a key that the viewport holds."""
        if not self.viewport.hasFocus():
            self.viewport.keyReleaseEvent(event)

    # ---------------------------------------------------------------- leaving

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask about an edit that would be lost; then stop the work and free the picture."""
        if not self._may_close and self.documents.would_lose:
            event.ignore()
            self.files.leave_edit(self.close_for_good)
            return
        settings = QSettings()
        settings.setValue("window/geometry", self.saveGeometry())
        settings.setValue("window/layout", self.saveState(LAYOUT_VERSION))
        settings.setValue("hint/done", self._has_hinted)
        self.display.save()
        self.timeline_actions.player.stop()
        self.tools.cancel()
        self.closing.emit()
        self.recovery_bar.release()
        self.autosave.close(keep=self._keeps_edit)
        self.documents.close()
        self.session.close()
        self.view.close()
        self.viewport.close()
        event.accept()

    def leave_at_once(self) -> None:
        """Close without asking, since nobody may be there to answer; its edit is kept for the next start."""
        self._keeps_edit = True
        self.close_for_good()

    def close_for_good(self) -> None:
        """Close without asking: whoever uses it has answered already."""
        self._may_close = True
        self.close()

    def _restore(self) -> None:
        settings = QSettings()
        geometry, layout = settings.value("window/geometry"), settings.value("window/layout")
        if geometry is None or not self.restoreGeometry(geometry):
            self.resize(1440, 900)
        self._fit_screen()
        if layout is not None:
            self.restoreState(layout, LAYOUT_VERSION)
        self.actions_.check("view.panels", not self.dock.isHidden())
        self.actions_.check("view.turntable", self.view.viewport.camera.is_turntable)

    def _fit_screen(self) -> None:
        """Fill the screen where there is no room for the window and its frame, which is not known before it is shown.

        The geometry may have been kept on a larger screen, or at a smaller scale. One that fits is left alone: moved
        before there is a frame, a window creeps by the frame's width at each start.
        """
        room = self.screen().availableGeometry()
        most = room.size() - FRAME
        self.setMinimumSize(self.minimumSize().boundedTo(most))
        if self.isMaximized() or self.isFullScreen():
            return
        if self.size() != self.size().boundedTo(most):
            self.setGeometry(QRect(room.topLeft() + QPoint(FRAME.width(), FRAME.height()), self.size().boundedTo(most)))
            self.setWindowState(self.windowState() | Qt.WindowState.WindowMaximized)
        elif not room.contains(self.geometry()):
            self.move(room.center() - self.rect().center())
