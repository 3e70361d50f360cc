"""The Qt widget around the viewport: one VTK render per shown frame, pointer and key events for the tools."""

import os
import sys
from collections.abc import Callable
from math import log
from time import perf_counter
from typing import Any, TypeVar

os.environ.setdefault("QT_API", "pyside6")

from PySide6.QtCore import QCoreApplication, QEvent, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QKeyEvent,
    QMouseEvent,
    QNativeGestureEvent,
    QSinglePointEvent,
    QSurfaceFormat,
    QWheelEvent,
)
from PySide6.QtWidgets import QAbstractSpinBox, QApplication, QLineEdit, QWidget
from pyvistaqt import QtInteractor

from splap_editor.tools.tool import KeyEvent, PointerEvent
from splap_editor.ui.widgets.widget_gestures import WidgetGestures

BUTTONS = {
    Qt.MouseButton.LeftButton: "left",
    Qt.MouseButton.MiddleButton: "middle",
    Qt.MouseButton.RightButton: "right",
}
NOTCH = 120.0
PINCH_NOTCH = log(1.15)
COMPARE_KEY = "O"
LEAST_PX = QSize(200, 120)
"""Of the picture: beside tools and panels there is no more on a small screen at twice the scale."""


PointerTaker = Callable[[PointerEvent], bool]
KeyTaker = Callable[[KeyEvent], bool]
Told = TypeVar("Told", PointerEvent, KeyEvent)


class ViewportWidget(QtInteractor):
    """Shows a VTK render window and tells what pointer and keys do over it.

    Hosting VTK in Qt is left to pyvistaqt, which the project is bound to, rather than done here.

    pyvistaqt renders twice for each frame shown and holds Python's lock
    meanwhile. Here every render request only asks Qt for a paint; the paint
    does the one render, by a call that lets other threads run. VTK's own
    mouse and key bindings never see an event.
    """

    gestures = WidgetGestures("Look around", ((f"Hold {COMPARE_KEY}", "Show the original"),))

    frame_drawn = Signal(float)
    """A frame is on its way to the screen; the milliseconds its render took."""
    resized = Signal()
    compare_held = Signal(bool)
    menu_wanted = Signal(object)
    """A right click that no tool wanted; the global position."""

    def __init__(self, parent: QWidget | None = None) -> None:
        self._is_ready = False
        super().__init__(parent, auto_update=False, multi_samples=0)
        self._pointer_taker: PointerTaker = lambda event: False
        self._key_taker: KeyTaker = lambda event: False
        self._taken_key: int | None = None
        self._hover: PointerEvent | None = None
        self._is_compare_held = False
        self.n_renders = 0
        self._later = QTimer(self, singleShot=True)
        self._later.timeout.connect(self.render)
        interactor = self.iren.interactor
        interactor.EnableRenderOff()
        self._render_tag = interactor.AddObserver("RenderEvent", self._on_render_event)
        self.reset_key_events()
        interactor.RemoveObservers("CharEvent")
        self.setAcceptDrops(False)
        self.setMinimumSize(LEAST_PX)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        # Of the positions that come in during a slow frame Qt would pass on the last only: a lasso would lose its
        # corners. Under X11 that is turned on when the application starts, so not before is it turned off.
        QCoreApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents, False)
        self._is_ready = True

    def connect_tools(self, pointer: PointerTaker, key: KeyTaker) -> None:
        """Say who takes pointer and key events; each returns True for an event it used."""
        self._pointer_taker = pointer
        self._key_taker = key

    # ---------------------------------------------------------------- frames

    def render(self, *_: object, **__: object) -> None:
        """Ask for a frame; any number of requests give one."""
        if self._is_ready:
            self.update()

    def render_in(self, seconds: float) -> None:
        """Ask for a frame later; asked again meanwhile, counted from then on."""
        self._later.start(round(1000.0 * seconds))

    def paintGL(self) -> None:
        """Draw one frame."""
        start = perf_counter()
        super().paintGL()
        self.frame_drawn.emit(1000.0 * (perf_counter() - start))

    def resizeGL(self, width: int, height: int) -> None:
        """Follow the widget's size."""
        super().resizeGL(width, height)
        self.resized.emit()

    def _on_render_event(self, *_: object) -> None:
        if self._in_paint:
            self.n_renders += 1
            # vtkRenderWindow.Render lets other threads run; vtkRenderWindowInteractor.Render does not.
            self._RenderWindow.Render()
        else:
            self.update()

    def close(self) -> None:  # type: ignore[override] # pyvistaqt gives nothing where Qt gives a bool
        """Free the GL objects; the widget shows nothing afterwards."""
        if self._is_ready:
            self._is_ready = False
            self._later.stop()
            self.iren.interactor.RemoveObserver(self._render_tag)
        super().close()

    # ---------------------------------------------------------------- pointer

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Pass a press; one with the right button that nobody wants asks for the menu."""
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        if not self._pass("press", event) and event.button() == Qt.MouseButton.RightButton:
            self.menu_wanted.emit(event.globalPosition().toPoint())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Pass a release."""
        self._pass("release", event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Pass a double click, and as a press where nobody wants it as such."""
        if not self._pass("double", event):
            self.mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Pass a move: all of a drag, of the others the last before something else happens."""
        if event.buttons():
            self._pass("move", event)
            return
        if self._hover is None:
            QTimer.singleShot(0, self, self._pass_hover)
        self._hover = self._pointer_event("move", event)

    def _pass_hover(self) -> None:
        hover, self._hover = self._hover, None
        if hover is not None:
            self._tell(self._pointer_taker, hover)

    def enterEvent(self, event: QEvent) -> None:
        """Take the keyboard, unless something is being typed."""
        if not is_typed_into(QApplication.focusWidget()):
            self.setFocus(Qt.FocusReason.MouseFocusReason)

    def leaveEvent(self, event: QEvent) -> None:
        """Tell that the pointer is gone."""
        self._hover = None
        self._tell(self._pointer_taker, PointerEvent("leave", (-1.0, -1.0)))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Pass a wheel turn, or the move of two fingers on a trackpad."""
        ratio = self.devicePixelRatioF()
        pixels, angle = event.pixelDelta(), event.angleDelta()
        is_trackpad = not pixels.isNull() and event.phase() != Qt.ScrollPhase.NoScrollPhase
        # Alt turns the wheel sideways on some platforms.
        notches = (angle.y() or angle.x()) / NOTCH
        pan = (pixels.x() * ratio, pixels.y() * ratio) if is_trackpad else (0.0, 0.0)
        self._pass("wheel", event, steps=notches, pan_px=pan)
        event.accept()

    def event(self, event: QEvent) -> bool:
        """Let tools have a key before the shortcuts do, and a pinch before Qt does."""
        kind = event.type()
        if kind == QEvent.Type.ShortcutOverride:
            if isinstance(event, QKeyEvent) and self.take_before_shortcuts(event):
                return True
        elif isinstance(event, QNativeGestureEvent):
            return self._on_native_gesture(event)
        return super().event(event)

    def take_before_shortcuts(self, event: QKeyEvent) -> bool:
        """Let tools have a key before the shortcuts do; True, and the event accepted, if they want it."""
        if not self._offer_key(event, pressed=True):
            return False
        self._taken_key = event.key()
        event.accept()
        return True

    def _on_native_gesture(self, event: QNativeGestureEvent) -> bool:
        if event.gestureType() != Qt.NativeGestureType.ZoomNativeGesture:
            return False
        steps = log(max(1.0 + event.value(), 0.05)) / PINCH_NOTCH
        return self._pass("pinch", event, steps=steps)

    def _pass(self, kind: str, event: QSinglePointEvent, **more: Any) -> bool:
        self._pass_hover()
        return self._tell(self._pointer_taker, self._pointer_event(kind, event, **more))

    def _pointer_event(self, kind: str, event: QSinglePointEvent, **more: Any) -> PointerEvent:
        ratio = self.devicePixelRatioF()
        held = event.modifiers()
        position = event.position()
        buttons = event.buttons() if hasattr(event, "buttons") else Qt.MouseButton.NoButton
        button = BUTTONS.get(event.button(), "") if kind in ("press", "release", "double") else ""
        return PointerEvent(
            kind,
            (position.x() * ratio, position.y() * ratio),
            button,
            frozenset(name for flag, name in BUTTONS.items() if buttons & flag),
            shift=bool(held & Qt.KeyboardModifier.ShiftModifier),
            ctrl=bool(held & Qt.KeyboardModifier.ControlModifier),
            alt=bool(held & Qt.KeyboardModifier.AltModifier),
            **more,
        )

    @staticmethod
    def _tell(taker: Callable[[Told], bool], event: Told) -> bool:
        """Pass an event on; what goes wrong there reaches the exception hook, which Qt would keep it from."""
        try:
            return taker(event)
        except Exception as error:
            sys.excepthook(type(error), error, error.__traceback__)
            return True

    # ---------------------------------------------------------------- keys

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Pass a key that no shortcut took; the one already taken while shortcuts were asked is not passed twice."""
        if self._taken_key == event.key():
            self._taken_key = None
            return
        key = _key_name(event)
        if key == COMPARE_KEY and not event.modifiers():
            if not event.isAutoRepeat():
                self._hold_compare(True)
        elif not self._offer_key(event, pressed=True):
            event.ignore()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Pass a key let go."""
        if event.isAutoRepeat():
            return
        if _key_name(event) == COMPARE_KEY:
            self._hold_compare(False)
        self._offer_key(event, pressed=False)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Let go of held keys: their release goes elsewhere."""
        self._hold_compare(False)
        super().focusOutEvent(event)

    def _hold_compare(self, is_held: bool) -> None:
        if is_held != self._is_compare_held:
            self._is_compare_held = is_held
            self.compare_held.emit(is_held)

    def _offer_key(self, event: QKeyEvent, *, pressed: bool) -> bool:
        self._pass_hover()
        held = event.modifiers()
        return self._tell(
            self._key_taker,
            KeyEvent(
                _key_name(event),
                event.text(),
                shift=bool(held & Qt.KeyboardModifier.ShiftModifier),
                ctrl=bool(held & Qt.KeyboardModifier.ControlModifier),
                alt=bool(held & Qt.KeyboardModifier.AltModifier),
                pressed=pressed,
            ),
        )


def is_typed_into(widget: QWidget | None) -> bool:
    """Whether a widget, if there is one, is a field that takes what is typed."""
    return isinstance(widget, (QLineEdit, QAbstractSpinBox))


def ask_of_qt() -> None:
    """Say what the window needs of OpenGL; to be called before the application is made."""
    QSurfaceFormat.setDefaultFormat(surface_format())


def surface_format() -> QSurfaceFormat:
    """What the window asks of OpenGL."""
    wanted = QSurfaceFormat()
    wanted.setRenderableType(QSurfaceFormat.RenderableType.OpenGL)
    wanted.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
    wanted.setVersion(3, 2)
    wanted.setSwapBehavior(QSurfaceFormat.SwapBehavior.DoubleBuffer)
    wanted.setAlphaBufferSize(8)
    wanted.setDepthBufferSize(8)
    wanted.setSamples(0)
    return wanted


def _key_name(event: QKeyEvent) -> str:
    try:
        return Qt.Key(event.key()).name.removeprefix("Key_")
    except ValueError:
        return ""
