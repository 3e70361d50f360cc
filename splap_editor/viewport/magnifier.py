"""A renderer's picture drawn in few pixels and scaled up to all of them."""

from vtkmodules.vtkCommonCore import VTK_UNSIGNED_CHAR
from vtkmodules.vtkRenderingCore import vtkRenderer
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLRenderWindow, vtkTextureObject

_GL_DEPTH_TEST, _GL_BLEND = 0x0B71, 0x0BE2


class Magnifier:
    """Draws what a renderer shows into a corner of its own frame, and from there over all of it.

    Fragments are what a software renderer pays for, and a third of the width
    has a ninth of them. Renderers in layers above are not touched: what they
    draw stays as sharp as ever.

    Parameters
    ----------
    renderer : vtkRenderer
        It fills its window.
    """

    def __init__(self, renderer: vtkRenderer):
        self._renderer = renderer
        self._texture = vtkTextureObject()
        self._texture.SetMagnificationFilter(vtkTextureObject.Linear)
        self._texture.SetMinificationFilter(vtkTextureObject.Linear)
        self._texture.SetWrapS(vtkTextureObject.ClampToEdge)
        self._texture.SetWrapT(vtkTextureObject.ClampToEdge)
        self._texture_size = (0, 0)
        self._size: tuple[int, int] | None = None

    def begin(self, coarseness: int) -> tuple[int, int]:
        """Say how many pixels of the screen one is wide and high in the frame that begins; the size drawn."""
        window = self._renderer.GetRenderWindow()
        width, height = window.GetSize()
        if coarseness <= 1:
            return width, height
        self._size = -(-width // coarseness), -(-height // coarseness)
        # Half a pixel of room: VTK rounds the corners of viewports.
        self._renderer.SetViewport(0.0, 0.0, (self._size[0] + 0.01) / width, (self._size[1] + 0.01) / height)
        return self._size

    def end(self) -> None:
        """Scale up what has been drawn, once the renderer is done."""
        if self._size is None:
            return
        window, size, self._size = self._renderer.GetRenderWindow(), self._size, None
        self._renderer.SetViewport(0.0, 0.0, 1.0, 1.0)
        assert isinstance(window, vtkOpenGLRenderWindow)  # no other has textures
        width, height = window.GetSize()
        self._fit_texture(window, size)
        self._texture.CopyFromFrameBuffer(0, 0, 0, 0, *size)
        state = window.GetState()
        state.vtkglDisable(_GL_DEPTH_TEST)
        state.vtkglDisable(_GL_BLEND)
        state.vtkglScissor(0, 0, width, height)
        self._texture.Activate()
        part = (0, 0, size[0] - 1, size[1] - 1, 0, 0, width - 1, height - 1, width, height)
        # Without a program of ours VTK takes one that only copies; its stubs do not know that.
        self._texture.CopyToFrameBuffer(*part, None, None)  # type: ignore[call-overload]
        self._texture.Deactivate()
        state.vtkglEnable(_GL_BLEND)
        state.vtkglEnable(_GL_DEPTH_TEST)

    def close(self) -> None:
        """Free the texture."""
        self._texture.ReleaseGraphicsResources(self._renderer.GetRenderWindow())
        self._texture_size = (0, 0)

    def _fit_texture(self, window: vtkOpenGLRenderWindow, size: tuple[int, int]) -> None:
        if self._texture_size != size or not self._texture.GetHandle():
            self._texture.SetContext(window)
            self._texture.Create2D(*size, 4, VTK_UNSIGNED_CHAR, False)
            self._texture_size = size
