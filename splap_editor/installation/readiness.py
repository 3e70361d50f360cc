"""Whether the window can be opened here; if not, one sentence with the one line that mends it."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from getpass import getuser

from splap_editor.installation import opengl_probe
from splap_editor.installation.system_packages import MANAGERS, Need, install_line, missing, needs, package_manager

_N_NAMED = 3
_PROBE_SECONDS = 20.0
_SOFTWARE = {"LIBGL_ALWAYS_SOFTWARE": "1"}


class NotReadyError(ValueError):
    """The system lacks something; the message is a sentence that says what to type."""


def platform(environ: Mapping[str, str] = os.environ) -> str | None:
    """Which of Qt's ways to a display will be taken: ``"x11"``, ``"wayland"``, another by its name, None for none."""
    asked = environ.get("QT_QPA_PLATFORM", "").split(";")[0].split(":")[0]
    if asked and asked != "xcb":
        return "wayland" if asked.startswith("wayland") else asked
    has_wayland = bool(environ.get("WAYLAND_DISPLAY")) and not asked
    if has_wayland and (environ.get("XDG_SESSION_TYPE") == "wayland" or not environ.get("DISPLAY")):
        return "wayland"
    return "x11" if environ.get("DISPLAY") else None


def check_picture() -> None:
    """Refuse to draw pictures without a window where a library for it is missing."""
    if sys.platform.startswith("linux"):
        _refuse_missing(missing(["picture"]), "drawing")


class WindowCheck:
    """The check before the window: libraries and display at once, OpenGL while the program is being imported.

    Raises
    ------
    NotReadyError
        A library or the display is missing.
    """

    def __init__(self) -> None:
        self.platform = platform()
        self._probe: subprocess.Popen | None = None
        if not sys.platform.startswith("linux"):
            return
        uses = ["picture", "window", *([self.platform] if self.platform in ("x11", "wayland") else [])]
        _refuse_missing(missing([*uses, "x11"] if self.platform is None else uses), "the window")
        if self.platform is None:
            raise NotReadyError(
                "there is no display to open the window on, neither DISPLAY nor WAYLAND_DISPLAY is set; start it in a "
                "desktop session, or from afar with: ssh -X HOST splap-editor (deform, render and info need no display)"
            )
        if self.platform in ("x11", "wayland"):
            self._probe = _started_probe(self.platform)

    def finish(self) -> None:
        """Wait for the answer of OpenGL.

        Raises
        ------
        NotReadyError
            The display does not answer, or has no OpenGL 3.2.
        """
        if self._probe is None or self.platform is None:
            return
        answer = probed(self._probe)
        reason = answer.get("refused")
        if reason == "display":
            name = os.environ.get("DISPLAY" if self.platform == "x11" else "WAYLAND_DISPLAY", "")
            raise NotReadyError(
                f"the display {name} does not answer; start it in a desktop session, or let this one in with: "
                f"xhost +si:localuser:{getuser()}"
            )
        if reason is not None:
            raise NotReadyError(_opengl_sentence(self.platform))


def _opengl_sentence(platform: str) -> str:
    version = ".".join(map(str, opengl_probe.WANTED))
    lacks = f"the window needs OpenGL {version}, which this display does not offer"
    if "refused" not in probed(_started_probe(platform, _SOFTWARE)):
        return f"{lacks}; update the graphics driver, or draw without it: LIBGL_ALWAYS_SOFTWARE=1 splap-editor"
    return f"{lacks}; {_install([need for need in needs() if need.use == 'driver'], 'install a driver')}"


def opengl(where: str) -> dict[str, str]:
    """What answers on a platform: ``vendor``, ``renderer`` and ``version``, or why not in ``refused``."""
    return probed(_started_probe(where))


def _started_probe(where: str, more: Mapping[str, str] | None = None) -> subprocess.Popen:
    command = [sys.executable, "-S", "-E", opengl_probe.__file__, where]
    quiet = subprocess.DEVNULL
    environ = {**os.environ, **(more or {})}
    return subprocess.Popen(command, stdin=quiet, stdout=subprocess.PIPE, stderr=quiet, text=True, env=environ)


def probed(probe: subprocess.Popen) -> dict[str, str]:
    """Wait for a probe's answer; a driver that gives none within its time, or crashes, is left for Qt to judge."""
    try:
        out, _ = probe.communicate(timeout=_PROBE_SECONDS)
        return dict(json.loads(out))
    except subprocess.TimeoutExpired:
        probe.kill()
        probe.communicate()
    except ValueError:
        pass
    return {}


def _refuse_missing(lacking: list[Need], what_for: str) -> None:
    if lacking:
        raise NotReadyError(missing_sentence(lacking, what_for))


def missing_sentence(lacking: list[Need], what_for: str) -> str:
    """Say which libraries are missing and how they are installed."""
    names = [need.library for need in lacking]
    more = f" and {len(names) - _N_NAMED} more" if len(names) > _N_NAMED else ""
    named = f"{', '.join(names[:_N_NAMED])}{more}"
    return f"{what_for} needs system libraries that are not here ({named}); {_install(lacking, 'install them')}"


def _install(wanted: list[Need], what_to_do: str) -> str:
    manager = package_manager()
    if manager is not None:
        return f"{what_to_do} with: {install_line(wanted, manager)}"
    names = dict.fromkeys(need.packages["apt"] for need in wanted)
    return f"{what_to_do} with this system's package manager ({next(iter(MANAGERS))} calls them {' '.join(names)})"
