"""The full check of an installation, for a person and for a bug report."""

import os
import platform as system
import shutil
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import splap_editor
from splap_editor.installation.readiness import NotReadyError, WindowCheck, opengl, platform
from splap_editor.installation.system_packages import missing

PACKAGES = ("numpy", "scipy", "numba", "libigl", "piqp", "robust_laplacian", "PySide6-Essentials", "vtk", "pyvista")
_VARIABLES = (
    "DISPLAY",
    "WAYLAND_DISPLAY",
    "XDG_SESSION_TYPE",
    "QT_QPA_PLATFORM",
    "LIBGL_ALWAYS_SOFTWARE",
    "SPLAP_CACHE_DIR",
    "SPLAP_STATE_DIR",
)


def examination() -> dict[str, Any]:
    """Look at everything that the program depends on.

    Returns
    -------
    dict
        JSON values. ``problem`` is the sentence that a start would end with, None where the window can be opened.
    """
    where = platform()
    is_linux = sys.platform.startswith("linux")
    uses = ["picture", "window", where if where in ("x11", "wayland") else "x11"]
    folders = _folders()
    return {
        "program": splap_editor.__version__,
        "python": f"{system.python_version()} at {sys.executable}",
        "system": _system(),
        "cores": os.cpu_count(),
        "packages": {name: _version(name) for name in PACKAGES},
        "display": where or "none",
        "environment": {name: os.environ[name] for name in _VARIABLES if name in os.environ},
        "opengl": opengl(where) if is_linux and where in ("x11", "wayland") else {},
        "missing_libraries": [need.library for need in missing(uses)] if is_linux else [],
        "folders": folders,
        "problem": _problem(folders),
    }


def _problem(folders: dict[str, dict[str, Any]]) -> str | None:
    try:
        WindowCheck().finish()
    except NotReadyError as error:
        return str(error)
    absent = [name for name in PACKAGES if _version(name) is None]
    if absent:
        line = f"{sys.executable} -m pip install --force-reinstall splap-editor"
        return f"the installation is incomplete ({', '.join(absent)}); install it again with: {line}"
    for name, variable in (("cache", "SPLAP_CACHE_DIR"), ("state", "SPLAP_STATE_DIR")):
        if not folders[name]["is_writable"]:
            path = folders[name]["path"]
            return f"the {name} folder {path} cannot be written to; name another one with: export {variable}=FOLDER"
    return None


def _folders() -> dict[str, dict[str, Any]]:
    from splap_editor.engine.cache import default_cache_folder
    from splap_editor.session.recovery import recovery_folder

    return {"cache": _folder(default_cache_folder()), "state": _folder(recovery_folder())}


def _folder(path: Path) -> dict[str, Any]:
    there = next(folder for folder in (path, *path.parents) if folder.is_dir())
    sizes = [file.stat().st_size for file in path.rglob("*") if file.is_file()]
    return {
        "path": str(path),
        "is_writable": os.access(there, os.W_OK),
        "used_mb": round(sum(sizes) / 1e6, 1),
        "free_gb": round(shutil.disk_usage(there).free / 1e9, 1),
    }


def _system() -> str:
    if sys.platform.startswith("linux"):
        try:
            return f"{system.freedesktop_os_release().get('PRETTY_NAME', 'Linux')}, {system.machine()}"
        except OSError:
            pass
    return system.platform()


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
