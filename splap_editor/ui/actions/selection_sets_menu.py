"""Selections kept by name, in a menu."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QInputDialog, QMenu, QWidget

from splap_editor.session.commands import ChangeSelectionSets
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.selection import SelectionMode, combined_selection
from splap_editor.session.session import Session

COMBINED = (
    ("&Add to selection", SelectionMode.ADD),
    ("&Subtract from selection", SelectionMode.REMOVE),
    ("&Intersect with selection", SelectionMode.INTERSECT),
)
"""Submenus of what was kept, and how it meets the selection there."""


class SelectionSetsMenu(QMenu):
    """Selects what was kept, or lets it meet the selection; its last entry forgets one.

    Parameters
    ----------
    session : Session
    parent : QWidget
    """

    def __init__(self, session: Session, parent: QWidget) -> None:
        super().__init__("Select ke&pt", parent)
        self._session = session
        self._forget_menu = QMenu("&Forget", self)
        self._combined = [(QMenu(text, self), mode) for text, mode in COMBINED]
        SceneFollower(session, self._fill, selection_sets_changed=self._fill)
        self.setEnabled(False)

    def keep(self) -> None:
        """Ask for a name, and keep the selection under it."""
        dialog = QInputDialog(self.parentWidget())
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setWindowTitle("Keep selection")
        dialog.setLabelText("Name")
        dialog.setTextValue(f"Selection {len(self._session.shown_scene.selection_sets) + 1}")
        dialog.textValueSelected.connect(self.keep_as)
        dialog.open()

    def keep_as(self, name: str) -> None:
        """Keep the selection under a name, over the one that had it."""
        name = name.strip()
        if name:
            scene = self._session.shown_scene
            self._change({**scene.selection_sets, name: scene.selection}, "Keep selection")

    def select(self, name: str, mode: SelectionMode = SelectionMode.REPLACE) -> None:
        """Select what was kept under a name, or let it meet what is selected."""
        scene = self._session.shown_scene
        mask = combined_selection(scene.selection, scene.selection_sets[name], mode)
        self._session.steps.change_mask("selection", mask, f"Select {name}")

    def forget(self, name: str) -> None:
        """Keep it no longer."""
        kept = self._session.shown_scene.selection_sets
        self._change({other: mask for other, mask in kept.items() if other != name}, "Forget selection")

    def _change(self, sets: dict, label: str) -> None:
        self._session.history.push(ChangeSelectionSets(self._session.shown_scene, sets, label))

    def _fill(self) -> None:
        names = list(self._session.shown_scene.selection_sets)
        self.clear()
        self._forget_menu.clear()
        for menu, _ in self._combined:
            menu.clear()
        for name in names:
            text = name.replace("&", "&&")
            self.addAction(text).triggered.connect(lambda checked=False, name=name: self.select(name))
            for menu, mode in self._combined:
                menu.addAction(text).triggered.connect(
                    lambda checked=False, name=name, mode=mode: self.select(name, mode)
                )
            self._forget_menu.addAction(text).triggered.connect(lambda checked=False, name=name: self.forget(name))
        if names:
            self.addSeparator()
            for menu, _ in self._combined:
                self.addMenu(menu)
            self.addMenu(self._forget_menu)
        self.setEnabled(bool(names))
