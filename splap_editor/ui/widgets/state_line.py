"""The right end of the status bar: hint of the tool, counts."""

from PySide6.QtWidgets import QHBoxLayout, QWidget

from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.tools.tool_manager import ToolManager
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.plain_text import PlainLabel


class StateLine(QWidget):
    """Says what pointer and keys do, and how many splats there are, selected and hidden."""

    def __init__(self, session: Session, tools: ToolManager, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._tools = tools
        self.hint = PlainLabel()
        self.hint.setProperty("tone", "quiet")
        self.counts = PlainLabel()
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * STEP, STEP, 3 * STEP, STEP)
        layout.setSpacing(6 * STEP)
        layout.addWidget(self.hint)
        layout.addWidget(self.counts)
        SceneFollower(
            session,
            self._show_counts,
            selection_changed=self._show_counts,
            hidden_changed=self._show_counts,
            removed_changed=self._show_counts,
        )
        tools.hint_changed.connect(self.show_hint)
        self.show_hint()

    def show_hint(self) -> None:
        """Say what pointer and keys do just now."""
        self.hint.setText(self._tools.hint)

    def _show_counts(self) -> None:
        scene = self._session.scene
        if scene is None:
            self.counts.setText("")
            return
        n_removed = scene.edit.removal.n_removed
        words = [f"{scene.splats.n_splats - n_removed:,} splats"]
        n_selected, n_hidden = int(scene.selection.sum()), int((scene.hidden & ~scene.removed).sum())
        if n_selected:
            words.insert(0, f"{n_selected:,} selected of")
        if n_hidden:
            words.append(f"· {n_hidden:,} hidden")
        if n_removed:
            words.append(f"· {n_removed:,} removed")
        self.counts.setText(" ".join(words))
