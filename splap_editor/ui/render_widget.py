"""A VTK render window inside a Qt widget.

VTK draws into framebuffers of its own in the widget's OpenGL context, and
each paint copies the picture into the framebuffer that Qt composes. The
rules below are those of VTK's C++ ``QVTKOpenGLNativeWidget``; they are
followed here rather than taken from pyvistaqt, which loads PyVista and
Matplotlib (as long as everything else together), renders twice for each
frame shown, and holds Python's lock meanwhile.
"""

import ctypes
from time import perf_counter

from PySide6.QtCore import Signal
from PySide6.QtGui import QGuiApplication, QOpenGLContext, QSurfaceFormat
from PySide6.QtOpenGLWidgets import QOpenGLWidget
from PySide6.QtWidgets import QWidget
from vtkmodules.vtkRenderingOpenGL2 import vtkGenericOpenGLRenderWindow

GL_LEQUAL = 0x0203
GL_DEPTH_TEST = 0x0B71
GL_SCISSOR_TEST = 0x0C11
GL_COLOR_BUFFER_BIT = 0x4000
GL_LINEAR = 0x2601
GL_DRAW_FRAMEBUFFER = 0x8CA9


def surface_format() -> QSurfaceFormat:
    """What the window asks of OpenGL; the application's default has to be set to it before any window is made."""
    wanted = QSurfaceFormat()
    # On Wayland Qt may otherwise give a GLES context, which refuses VTK's shaders.
    wanted.setRenderableType(QSurfaceFormat.RenderableType.OpenGL)
    wanted.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
    wanted.setVersion(3, 2)
    wanted.setSwapBehavior(QSurfaceFormat.SwapBehavior.DoubleBuffer)
    wanted.setAlphaBufferSize(8)
    wanted.setDepthBufferSize(8)
    wanted.setSamples(0)
    return wanted


class RenderWidget(QOpenGLWidget):
    """Shows `render_window`; one render for each paint, with Python's lock let go.

    To draw anew, call ``update``: Qt makes one paint of any number of calls.
    """

    frame_drawn = Signal(float)
    """A frame is on its way to the screen; the milliseconds it took."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setUpdateBehavior(QOpenGLWidget.UpdateBehavior.NoPartialUpdate)
        self.n_renders = 0
        self._context: QOpenGLContext | None = None
        self.render_window = window = vtkGenericOpenGLRenderWindow()
        window.SetReadyForRendering(False)
        window.SetFrameBlitModeToNoBlit()
        window.SetMultiSamples(0)
        self._observed = [
            window.AddObserver("WindowMakeCurrentEvent", self._on_make_current),
            window.AddObserver("WindowIsCurrentEvent", self._on_is_current),
        ]

    def initializeGL(self) -> None:
        """Hand the new context to VTK."""
        self._context = self.context()
        self._surface = self._context.surface()
        self._context.aboutToBeDestroyed.connect(self.release)
        window = self.render_window
        _set_symbol_loader(window)
        window.OpenGLInitContext()
        window.OpenGLInit()
        state = window.GetState()
        state.Reset()
        state.vtkglDepthFunc(GL_LEQUAL)
        state.vtkglEnable(GL_DEPTH_TEST)
        window.SetForceMaximumHardwareLineWidth(1)
        window.SetReadyForRendering(True)
        window.SetOwnContext(0)

    def resizeGL(self, width: int, height: int) -> None:
        """Give VTK the size in device pixels."""
        self.render_window.SetSize(*self._device_size())
        self.render_window.SetDPI(round(72 * self.devicePixelRatioF()))

    def paintGL(self) -> None:
        """Render once, and copy the picture to where Qt composes it."""
        window = self.render_window
        if self._context is None or not window.GetReadyForRendering():
            return
        start = perf_counter()
        state = window.GetState()
        # Qt has touched GL since VTK last did.
        state.Reset()
        state.Push()
        state.vtkglDepthFunc(GL_LEQUAL)
        self.n_renders += 1
        window.Render()
        self.makeCurrent()
        self._blit()
        state.Pop()
        self.frame_drawn.emit(1000.0 * (perf_counter() - start))

    def release(self) -> None:
        """Free VTK's GL objects while the context lives; nothing is drawn afterwards."""
        window = self.render_window
        if self._context is not None:
            self._context.makeCurrent(self._surface)
            window.Finalize()
            window.SetReadyForRendering(False)
            self._context = None
        for tag in self._observed:
            window.RemoveObserver(tag)
        self._observed = []

    def _device_size(self) -> tuple[int, int]:
        ratio = self.devicePixelRatioF()
        return max(1, round(self.width() * ratio)), max(1, round(self.height() * ratio))

    def _blit(self) -> None:
        window, gl = self.render_window, self._context.functions()
        width, height = self._device_size()
        gl.glBindFramebuffer(GL_DRAW_FRAMEBUFFER, self.defaultFramebufferObject())
        gl.glDisable(GL_SCISSOR_TEST)
        window.BlitDisplayFramebuffer(0, 0, 0, *window.GetSize(), 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_LINEAR)
        # Compositors would blend a picture whose alpha is below 1 with what is behind the window.
        gl.glColorMask(False, False, False, True)
        gl.glClearColor(0.0, 0.0, 0.0, 1.0)
        gl.glViewport(0, 0, width, height)
        gl.glClear(GL_COLOR_BUFFER_BIT)
        gl.glColorMask(True, True, True, True)

    def _on_make_current(self, *_: object) -> None:
        # Not QOpenGLWidget.makeCurrent, which binds the widget's framebuffer in the middle of VTK's work.
        if self._context is not None:
            self._context.makeCurrent(self._surface)

    def _on_is_current(self, *_: object) -> None:
        is_current = self._context is not None and QOpenGLContext.currentContext() is self._context
        self.render_window.SetIsCurrent(is_current)


def _set_symbol_loader(window: vtkGenericOpenGLRenderWindow) -> None:
    """Tell VTK where Qt's platform finds OpenGL functions; elsewhere VTK's own way is right."""
    platform = QGuiApplication.platformName()
    if platform.startswith("wayland"):
        loader = ctypes.CDLL("libEGL.so.1").eglGetProcAddress
    elif platform == "xcb":
        loader = ctypes.CDLL("libGL.so.1").glXGetProcAddressARB
    else:
        return
    window.SetOpenGLSymbolLoader2(ctypes.cast(loader, ctypes.c_void_p).value, 0)
