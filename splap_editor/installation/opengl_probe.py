"""Asks the display for an OpenGL 3.2 core context without Qt, and says what answers.

It runs in a process of its own, by its path: a driver may crash, and loading one takes a moment that the program spends
importing. It prints one JSON object, ``{"renderer": …, "version": …}`` or ``{"refused": reason}``.
"""

import ctypes
import json
import sys
from collections.abc import Callable
from ctypes import CDLL, CFUNCTYPE, POINTER, byref, c_char_p, c_int, c_uint, c_ulong, c_void_p

WANTED = (3, 2)
_STRINGS = {"vendor": 0x1F00, "renderer": 0x1F01, "version": 0x1F02}


def glx_context() -> dict[str, str]:
    """Make a context current on the X display, as Qt does there."""
    x11, gl = CDLL("libX11.so.6"), CDLL("libGL.so.1")
    x11.XOpenDisplay.restype = c_void_p
    display = c_void_p(x11.XOpenDisplay(None))
    if not display:
        return {"refused": "display"}
    # The default handler would end the process where the server does not know the version.
    handler = CFUNCTYPE(c_int, c_void_p, c_void_p)(lambda *_: 0)
    x11.XSetErrorHandler(handler)
    gl.glXChooseFBConfig.restype = POINTER(c_void_p)
    gl.glXGetProcAddressARB.restype = c_void_p
    gl.glXCreatePbuffer.restype = c_ulong
    count = c_int()
    # GLX_DRAWABLE_TYPE is GLX_PBUFFER_BIT, GLX_RENDER_TYPE is GLX_RGBA_BIT.
    wanted = _attributes(0x8010, 4, 0x8011, 1)
    configs = gl.glXChooseFBConfig(display, x11.XDefaultScreen(display), wanted, byref(count))
    address = gl.glXGetProcAddressARB(b"glXCreateContextAttribsARB")
    if not count.value or not address:
        return {"refused": "version"}
    config = c_void_p(configs[0])
    create = CFUNCTYPE(c_void_p, c_void_p, c_void_p, c_void_p, c_int, POINTER(c_int))(address)
    # GLX_CONTEXT_MAJOR_VERSION, MINOR_VERSION, PROFILE_MASK: core.
    context = create(display, config, None, 1, _attributes(0x2091, WANTED[0], 0x2092, WANTED[1], 0x9126, 1))
    surface = c_ulong(gl.glXCreatePbuffer(display, config, _attributes(0x8041, 1, 0x8040, 1)))
    if not context or not gl.glXMakeContextCurrent(display, surface, surface, c_void_p(context)):
        return {"refused": "version"}
    gl.glGetString.restype = c_char_p
    return _strings(gl.glGetString)


def egl_context() -> dict[str, str]:
    """Make a context current on the default EGL display, as Qt does on Wayland."""
    egl = CDLL("libEGL.so.1")
    egl.eglGetDisplay.restype = egl.eglCreateContext.restype = egl.eglGetProcAddress.restype = c_void_p
    display = c_void_p(egl.eglGetDisplay(None))
    if not display or not egl.eglInitialize(display, None, None):
        return {"refused": "display"}
    config, count = c_void_p(), c_int()
    # EGL_RENDERABLE_TYPE is EGL_OPENGL_BIT, EGL_SURFACE_TYPE anything.
    wanted = _attributes(0x3040, 8, 0x3033, 0, end=0x3038)
    egl.eglBindAPI(c_uint(0x30A2))
    if not egl.eglChooseConfig(display, wanted, byref(config), 1, byref(count)) or not count.value:
        return {"refused": "version"}
    # EGL_CONTEXT_MAJOR_VERSION, MINOR_VERSION, OPENGL_PROFILE_MASK: core.
    versions = _attributes(0x3098, WANTED[0], 0x30FB, WANTED[1], 0x30FD, 1, end=0x3038)
    context = c_void_p(egl.eglCreateContext(display, config, None, versions))
    if not context or not egl.eglMakeCurrent(display, None, None, context):
        return {"refused": "version"}
    address = egl.eglGetProcAddress(b"glGetString")
    return _strings(CFUNCTYPE(c_char_p, c_uint)(address))


def _attributes(*pairs: int, end: int = 0) -> ctypes.Array:
    return (c_int * (len(pairs) + 1))(*pairs, end)


def _strings(get_string: Callable[[c_uint], bytes | None]) -> dict[str, str]:
    answers = {name: get_string(c_uint(number)) for name, number in _STRINGS.items()}
    return {name: answer.decode(errors="replace") for name, answer in answers.items() if answer}


if __name__ == "__main__":
    try:
        answer = glx_context() if sys.argv[1] == "x11" else egl_context()
    except (OSError, AttributeError) as error:
        answer = {"refused": str(error)}
    print(json.dumps(answer))
