"""What concerns the program as a whole: finding actions, preferences."""

from PySide6.QtWidgets import QWidget

from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.dialogs.command_palette import CommandPalette
from splap_editor.ui.dialogs.preferences_dialog import PreferencesDialog
from splap_editor.ui.preferences import PreferenceStore


class ProgramCommands:
    """Opens the palette and the preferences.

    Parameters
    ----------
    window : QWidget
        Parent of what opens.
    store : PreferenceStore
    """

    def __init__(self, window: QWidget, store: PreferenceStore) -> None:
        self._window = window
        self.store = store
        self.actions: ActionSet | None = None
        """Set once they are made: they need this object first."""

    def palette(self) -> None:
        """Find an action by name."""
        CommandPalette(self.actions, self._window).open()

    def preferences(self) -> None:
        """Change what is kept between runs."""
        PreferencesDialog(self.store, self._window).open()
