"""The program among the applications of a Linux desktop: starter, icon and file types, for one user."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from splap_editor.resources import resource

APP_ID = "splap-editor"
SESSION_TYPE = "application/x-splap"
PLY_TYPE = "model/x-ply"

# No default is set for PLY files: whoever shows them keeps them, and this program is among "Open with".
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
Keywords=gaussian;splat;3dgs;2dgs;ply;deform;
MimeType={session_type};{ply_type};
StartupWMClass={app_id}
StartupNotify=true
InitialPreference=1
"""

# A light weight leaves *.ply to whichever type the system knows it by, if any.
_TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<mime-info xmlns="http://www.freedesktop.org/standards/shared-mime-info">
  <mime-type type="{session_type}">
    <comment>SpLap Editor session</comment>
    <sub-class-of type="application/json"/>
    <icon name="{app_id}"/>
    <glob pattern="*.splap" weight="60"/>
  </mime-type>
  <mime-type type="{ply_type}">
    <comment>PLY point cloud or splats</comment>
    <glob pattern="*.ply" weight="10"/>
  </mime-type>
</mime-info>
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
    names = {"app_id": APP_ID, "session_type": SESSION_TYPE, "ply_type": PLY_TYPE}
    texts = [
        _ENTRY.format(command=_command(), **names),
        resource("icons", f"{APP_ID}.svg").read_text(encoding="utf-8"),
        _TYPES.format(**names),
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
