"""The program among the applications of a Linux desktop: starter, icon and file types, for one user."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from splap_editor.resources import resource

APP_ID = "splap-editor"
SESSION_TYPE = "application/x-splap"


@dataclass(frozen=True)
class FileType:
    """A kind of file as a desktop knows it.

    Parameters
    ----------
    name : str
    comment : str
        What people call it; empty for a type that every desktop brings.
    endings : tuple of str
    weight : int
        Of its endings, where 50 is what other programs' types have. A light one leaves them to whichever type the
        system knows them by, if any.
    more : str
        Elements of its description.
    """

    name: str
    comment: str
    endings: tuple[str, ...]
    weight: int = 10
    more: str = ""

    def described(self) -> str:
        """Its element of a package of types."""
        globs = "".join(f'<glob pattern="*{ending}" weight="{self.weight}"/>' for ending in self.endings)
        return f'  <mime-type type="{self.name}"><comment>{self.comment}</comment>{self.more}{globs}</mime-type>\n'


_SESSION_MORE = f'<sub-class-of type="application/json"/><icon name="{APP_ID}"/>'

TYPES = (
    FileType(SESSION_TYPE, "SpLap Editor session", (".splap",), 60, _SESSION_MORE),
    FileType("model/x-ply", "PLY point cloud or splats", (".ply",)),
    FileType("model/x-spz", "SPZ splats", (".spz",)),
    FileType("model/x-sog", "SOG splats", (".sog",)),
    FileType("model/x-splat", "Splats", (".splat",)),
    FileType("model/x-ksplat", "KSPLAT splats", (".ksplat",)),
    FileType("model/gltf-binary", "", (".glb",)),
    FileType("model/gltf+json", "", (".gltf",)),
    FileType("model/vnd.usd", "OpenUSD scene", (".usdc", ".usda", ".usd")),
    FileType("model/vnd.usdz+zip", "OpenUSD package", (".usdz",)),
)
"""Of all files that the program opens by themselves. A SOG's ``meta.json`` is JSON like any other."""

# No default is set for any but sessions: whoever shows a file keeps it, and this program is among "Open with".
_ENTRY = """[Desktop Entry]
Type=Application
Version=1.0
Name=SpLap Editor
GenericName=Gaussian splat editor
Comment=Bend, pose and reshape captured Gaussian splats
Exec={command} %f
Icon={app_id}
Terminal=false
Categories=Graphics;3DGraphics;
Keywords=gaussian;splat;3dgs;2dgs;ply;spz;sog;deform;
MimeType={types};
StartupWMClass={app_id}
StartupNotify=true
InitialPreference=1
"""

_PACKAGE = """<?xml version="1.0" encoding="UTF-8"?>
<mime-info xmlns="http://www.freedesktop.org/standards/shared-mime-info">
{types}</mime-info>
"""


def integrate(data_home: Path | None = None) -> list[Path]:
    """Put starter, icon and file types where the user's desktop finds them.

    Parameters
    ----------
    data_home : Path, optional
        ``$XDG_DATA_HOME``, or ``~/.local/share``.

    Returns
    -------
    list of Path
        The files written; `remove` deletes the same.

    Raises
    ------
    ValueError
        This is no Linux desktop.
    """
    home = _data_home(data_home)
    texts = [
        _ENTRY.format(command=_command(), app_id=APP_ID, types=";".join(each.name for each in TYPES)),
        resource("icons", f"{APP_ID}.svg").read_text(encoding="utf-8"),
        _PACKAGE.format(types="".join(each.described() for each in TYPES if each.comment)),
    ]
    files = _files(home)
    for path, text in zip(files, texts, strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    _tell_desktop(home)
    return files


def remove(data_home: Path | None = None) -> list[Path]:
    """Take away what `integrate` put there; gives the files deleted."""
    home = _data_home(data_home)
    files = [path for path in _files(home) if path.exists()]
    for path in files:
        path.unlink()
    if files:
        _tell_desktop(home)
    return files


def _data_home(given: Path | None) -> Path:
    if not sys.platform.startswith("linux"):
        raise ValueError(
            "integrate is for Linux desktops; elsewhere pin the running program to the Dock or the taskbar"
        )
    named = os.environ.get("XDG_DATA_HOME", "")
    return given or (Path(named) if os.path.isabs(named) else Path.home() / ".local" / "share")


def _files(home: Path) -> list[Path]:
    return [
        home / "applications" / f"{APP_ID}.desktop",
        home / "icons" / "hicolor" / "scalable" / "apps" / f"{APP_ID}.svg",
        home / "mime" / "packages" / f"{APP_ID}.xml",
    ]


def _command() -> str:
    """The command of this very installation, quoted as the Desktop Entry Specification wants it."""
    script = Path(sys.executable).with_name(APP_ID)
    words = [str(script)] if script.exists() else [sys.executable, "-m", "splap_editor"]
    return " ".join(_quoted(word) for word in words)


def _quoted(word: str) -> str:
    for mark in '\\"`$':
        word = word.replace(mark, f"\\{mark}")
    # The file's own escapes come off first, and % begins a field code.
    return '"' + word.replace("\\", "\\\\").replace("%", "%%") + '"'


def _tell_desktop(home: Path) -> None:
    """Refresh the desktop's lists; where a tool is missing the desktop does without such a list."""
    icons = home / "icons" / "hicolor"
    commands = [
        ["update-mime-database", str(home / "mime")],
        ["update-desktop-database", str(home / "applications")],
    ]
    if (icons / "icon-theme.cache").exists():
        commands.append(["gtk-update-icon-cache", "--quiet", "--force", "--ignore-theme-index", str(icons)])
    for command in commands:
        if shutil.which(command[0]):
            subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
