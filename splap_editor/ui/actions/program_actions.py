"""What concerns the program as a whole: finding actions, preferences, help."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QMessageBox, QWidget

import splap_editor
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.dialogs.action_palette import ActionPalette
from splap_editor.ui.dialogs.help_sheet import HelpSheet
from splap_editor.ui.dialogs.preferences_dialog import PreferencesDialog
from splap_editor.ui.preferences import PreferenceStore
from splap_editor.ui.widgets.plain_text import PlainMessageBox


class ProgramActions:
    """Opens the palette, the preferences and the help.

    Parameters
    ----------
    window : QWidget
        Parent of what opens.
    store : PreferenceStore
    """

    def __init__(self, window: QWidget, store: PreferenceStore) -> None:
        self._window = window
        self.store = store
        self.actions: ActionSet
        """Set once they are made: they need this object first."""

    def palette(self) -> None:
        """Find an action by name."""
        ActionPalette(self.actions, self._window).open()

    def preferences(self) -> None:
        """Change what is kept between runs."""
        PreferencesDialog(self.store, self._window).open()

    def sheet(self) -> None:
        """Show every key and gesture."""
        HelpSheet(self.actions.specs, self._window).open()

    def about(self) -> None:
        """Say what this is."""
        box = PlainMessageBox(
            QMessageBox.Icon.NoIcon,
            "About SpLap Editor",
            f"SpLap Editor {splap_editor.__version__}",
            parent=self._window,
        )
        box.setInformativeText(
            "Bends, poses and reshapes captured Gaussian splats with surface-aware Laplacians, "
            "after “SpLap” (3DV 2026).\n\nFree software: GNU GPL 3 or later."
        )
        box.setIconPixmap(QIcon(self._window.windowIcon()).pixmap(64, 64))
        box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        box.open()
