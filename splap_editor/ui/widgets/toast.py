"""Short messages over the picture that never stop the work."""

from collections.abc import Callable, Mapping

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtWidgets import QFrame, QHBoxLayout, QPushButton, QToolButton, QWidget

from splap_editor.ui.theme import STEP, icon
from splap_editor.ui.widgets.plain_text import PlainLabel

SHOWN_MS = 5000


class Toast(QFrame):
    """One line at the top of the viewport; a failure stays until it is closed or followed by another message.

    Parameters
    ----------
    parent : QWidget
        The widget it floats over.
    """

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._over = parent
        self.setObjectName("toast")
        self._icon = PlainLabel()
        self._text = PlainLabel(wordWrap=True, textInteractionFlags=Qt.TextInteractionFlag.TextSelectableByMouse)
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(3 * STEP, 2 * STEP, 2 * STEP, 2 * STEP)
        self._layout.setSpacing(2 * STEP)
        self._layout.addWidget(self._icon)
        self._layout.addWidget(self._text, 1)
        self._buttons: list[QPushButton] = []
        self._close = QToolButton(autoRaise=True)
        self._close.setIcon(icon("close"))
        self._close.setToolTip("Close")
        self._close.clicked.connect(self.hide)
        self._layout.addWidget(self._close)
        self._timer = QTimer(self, singleShot=True)
        self._timer.timeout.connect(self.hide)
        parent.installEventFilter(self)
        self.hide()

    @property
    def text(self) -> str:
        """The message on screen; empty when there is none."""
        return self._text.text() if not self.isHidden() else ""

    def say(self, text: str, **buttons: Callable[[], object]) -> None:
        """Show a message for a few seconds; each keyword makes a button, ``Show_folder=...``."""
        self._show(text, "info", buttons, SHOWN_MS + 1500 * len(buttons))

    def fail(self, text: str, **buttons: Callable[[], object]) -> None:
        """Show what went wrong, until it is closed."""
        self._show(text, "failure", buttons, 0)

    def _show(self, text: str, tone: str, buttons: Mapping[str, Callable[[], object]], milliseconds: int) -> None:
        for button in self._buttons:
            button.hide()
            button.deleteLater()
        self._buttons = [self._button(name.replace("_", " "), call) for name, call in buttons.items()]
        self._text.setText(text)
        self._icon.setPixmap(icon("warning" if tone == "failure" else "info").pixmap(20, 20))
        self.setProperty("tone", tone)
        self.style().unpolish(self)
        self.style().polish(self)
        self._timer.stop()
        if milliseconds:
            self._timer.start(milliseconds)
        self.show()
        self.raise_()
        self._place()

    def _button(self, name: str, call: Callable[[], object]) -> QPushButton:
        button = QPushButton(name)
        button.setFlat(True)
        button.clicked.connect(self.hide)
        button.clicked.connect(lambda: call())
        self._layout.insertWidget(self._layout.count() - 1, button)
        return button

    def _place(self) -> None:
        room = self._over.width() - 8 * STEP
        self._text.setWordWrap(False)
        width = self.sizeHint().width()
        if width > min(room, 720):
            self._text.setWordWrap(True)
            width = min(room, 720)
        self.setFixedWidth(width)
        self.setFixedHeight(max(self.heightForWidth(width), self.sizeHint().height()) if width else 0)
        self.move((self._over.width() - width) // 2, 4 * STEP)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay centred when the viewport is resized."""
        if event.type() == QEvent.Type.Resize and not self.isHidden():
            self._place()
        return False
