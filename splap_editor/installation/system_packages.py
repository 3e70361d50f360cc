"""The one list of system packages: which library each brings, and the line that installs them here."""

import ctypes
import os
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from splap_editor.resources import resource

MANAGERS = {
    "apt": "apt-get install",
    "dnf": "dnf install",
    "pacman": "pacman -S",
    "zypper": "zypper install",
}
"""Column of the list → what installs packages named there."""

_FAMILIES = {
    "apt": ("debian", "ubuntu"),
    "dnf": ("fedora", "rhel", "centos"),
    "pacman": ("arch",),
    "zypper": ("suse", "opensuse"),
}
_APT_LISTS = Path("/var/lib/apt/lists")


@dataclass(frozen=True)
class Need:
    """A library or program that is needed for some use, and the package that brings it.

    Parameters
    ----------
    use : str
        ``"picture"``, ``"window"``, ``"x11"``, ``"wayland"``, ``"driver"`` or ``"test"``.
    library : str
        What the loader calls it; empty where there is none to look for.
    packages : dict[str, str]
        Its package for each of `MANAGERS` that has one.
    """

    use: str
    library: str
    packages: dict[str, str]


@cache
def needs() -> tuple[Need, ...]:
    """Read the list."""
    rows = []
    for line in resource("system-packages.txt").read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            use, library, *names = line.split()
            packages = {manager: name for manager, name in zip(MANAGERS, names, strict=True) if name != "-"}
            rows.append(Need(use, "" if library == "-" else library, packages))
    return tuple(rows)


def missing(uses: Iterable[str]) -> list[Need]:
    """Those of some uses whose library the loader does not find."""
    uses = set(uses)
    return [need for need in needs() if need.use in uses and need.library and not loads(need.library)]


def loads(library: str) -> bool:
    """Whether the loader finds a library."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def package_manager(os_release: Path = Path("/etc/os-release")) -> str | None:
    """Which of `MANAGERS` this distribution, or the one it is made from, installs with; None for any other."""
    try:
        text = os_release.read_text(encoding="utf-8")
    except OSError:
        return None
    fields = dict(line.split("=", 1) for line in text.splitlines() if "=" in line)
    names = " ".join(fields.get(name, "").strip("'\"") for name in ("ID", "ID_LIKE")).split()
    for name in names:
        for manager, family in _FAMILIES.items():
            if any(name == member or name.startswith(f"{member}-") for member in family):
                return manager
    return None


def install_line(wanted: Iterable[Need], manager: str) -> str:
    """The line for a shell that installs what is needed, each package once, in the order of the list."""
    names = dict.fromkeys(need.packages[manager] for need in wanted if manager in need.packages)
    sudo = "" if _is_root() or shutil.which("sudo") is None else "sudo "
    line = f"{sudo}{MANAGERS[manager]} {' '.join(names)}"
    # A fresh container knows no packages yet.
    if manager == "apt" and not any(_APT_LISTS.glob("*_Packages*")):
        line = f"{sudo}apt-get update && {line}"
    return line


def _is_root() -> bool:
    return not hasattr(os, "geteuid") or os.geteuid() == 0
