"""Files that travel with the program: shaders, icons, samples."""

from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


@cache
def resource_folder() -> Path:
    """Folder of the bundled files: inside an installed wheel, else at the top of the source tree."""
    installed = _PACKAGE / "_resources"
    return installed if installed.is_dir() else _PACKAGE.parent / "resources"


def resource(*parts: str) -> Path:
    """Path of one bundled file.

    Parameters
    ----------
    *parts : str
        Folder and file names below the resource folder, ``"icons", "pin.svg"``.

    Raises
    ------
    FileNotFoundError
        The installation is incomplete.
    """
    path = resource_folder().joinpath(*parts)
    if not path.exists():
        raise FileNotFoundError(f"{path} is missing: the installation is incomplete, install SpLap Editor again")
    return path


@cache
def shader(name: str) -> str:
    """GLSL source of ``shaders/<name>.glsl``; a line ``#include "other"`` is replaced by that file's text."""
    lines = resource("shaders", f"{name}.glsl").read_text(encoding="utf-8").splitlines()
    prefix = "#include "
    return "\n".join(
        shader(line[len(prefix) :].strip().strip('"')) if line.startswith(prefix) else line for line in lines
    )
