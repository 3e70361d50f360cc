"""The preferences page."""

from PySide6.QtWidgets import QDialog, QDialogButtonBox, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from splap_editor.ui.preferences import MB, RANGES, PreferenceStore
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.options_form import FieldHint, OptionsForm
from splap_editor.ui.widgets.plain_text import PlainLabel

HINTS = {
    "navigation": FieldHint(
        "Left drag",
        "The middle button always orbits, with Shift it pans. Shift or Ctrl with a left drag always selects.",
        choices={"blender": "Selects, as in Blender", "left": "Orbits; with Shift or Ctrl selects"},
    ),
    "up": FieldHint(
        "Up in new scenes",
        "The View menu changes it for the open one.",
        choices={"auto": "Guessed from the file", "z": "Z", "y": "Y", "-y": "Y points down"},
    ),
    "undo_mb": FieldHint("Undo may keep", "The oldest steps go first.", "MB", *RANGES["undo_mb"], step=64),
    "n_threads": FieldHint(
        "Weights at a time",
        "Handles whose bounded biharmonic weights are found side by side.",
        "",
        *RANGES["n_threads"],
    ),
    "cache_gb": FieldHint(
        "Prepared scenes",
        "Room on disk, so that a file opens faster the second time.",
        "GB",
        *RANGES["cache_gb"],
        decimals=1,
    ),
}


class PreferencesDialog(QDialog):
    """Every change is in force at once."""

    def __init__(self, store: PreferenceStore, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Preferences")
        self._store = store
        self.form = OptionsForm(store.held, HINTS)
        self.form.changed.connect(store.set)
        self.cache = PlainLabel()
        self.cache.setProperty("tone", "quiet")
        self.clear = QPushButton("Clear", autoDefault=False)
        self.clear.clicked.connect(self._on_clear)
        row = QHBoxLayout()
        row.addWidget(self.cache, 1)
        row.addWidget(self.clear)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.RestoreDefaults | QDialogButtonBox.StandardButton.Close
        )
        buttons.rejected.connect(self.close)
        buttons.button(QDialogButtonBox.StandardButton.RestoreDefaults).clicked.connect(store.reset)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(5 * STEP, 5 * STEP, 5 * STEP, 4 * STEP)
        layout.setSpacing(4 * STEP)
        layout.addWidget(self.form)
        layout.addLayout(row)
        layout.addWidget(buttons)
        self.setMinimumWidth(420)
        store.changed.connect(self._show)
        self.finished.connect(lambda _: self._leave())
        self._show()

    def _show(self) -> None:
        self.form.show_value(self._store.held)
        held = self._store.cache_bytes
        self.cache.setText(f"Prepared scenes take {held / MB:,.1f} MB now." if held else "No prepared scenes are kept.")
        self.clear.setEnabled(held > 0)

    def _on_clear(self) -> None:
        self._store.clear_cache()
        self._show()

    def _leave(self) -> None:
        self._store.changed.disconnect(self._show)
        self.deleteLater()
