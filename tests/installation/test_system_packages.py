"""The one list of system packages holds what is needed, and everything that names packages names these."""

import re
import struct
import sys
from pathlib import Path

import pytest

from splap_editor.installation.system_packages import MANAGERS, install_line, missing, needs, package_manager

ROOT = Path(__file__).resolve().parents[2]
# Part of every system that runs Python at all.
BASE = ("libc.so", "libm.so", "libpthread.so", "libdl.so", "librt.so", "libgcc_s.so", "ld-linux")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the libraries are Linux's")
def test_every_listed_library_is_here_where_the_tests_run():
    assert [need.library for need in missing({need.use for need in needs()} - {"wayland"})] == []


def test_the_list_holds_every_library_that_qt_asks_for():
    import PySide6

    folder = Path(PySide6.__file__).parent
    parts = ["QtCore", "QtGui", "QtWidgets", "QtOpenGLWidgets"]
    files = [*(folder / f"{part}.abi3.so" for part in parts), *folder.glob("Qt/plugins/platforms/libqxcb.so")]
    files += [*folder.glob("Qt/plugins/xcbglintegrations/*.so"), *folder.glob("Qt/plugins/platforms/libqwayland.so")]
    bundled = {path.name for place in ("", "Qt/lib", "../shiboken6") for path in (folder / place).glob("*.so*")}
    asked, seen = set(), set()
    while files:
        path = files.pop()
        if path in seen or not path.exists():
            continue
        seen.add(path)
        for name in needed_libraries(path):
            if name in bundled:
                files.append(folder / "Qt" / "lib" / name)
            elif not name.startswith(BASE):
                asked.add(name)
    listed = {need.library for need in needs()}
    assert asked - listed == set()


def needed_libraries(path: Path) -> list[str]:
    """Read the NEEDED entries of a 64-bit little-endian ELF file; none of any other file."""
    data = path.read_bytes()
    if data[:6] != b"\x7fELF\x02\x01":
        return []
    start, size, count = *struct.unpack_from("<Q", data, 0x28), *struct.unpack_from("<HH", data, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, start + size * i) for i in range(count)]
    dynamic = next(section for section in sections if section[1] == 6)
    strings = sections[dynamic[6]][4]
    entries = (struct.unpack_from("<QQ", data, dynamic[4] + at) for at in range(0, dynamic[5], 16))
    names = [strings + value for tag, value in entries if tag == 1]
    return [data[name : data.index(b"\0", name)].decode() for name in names]


@pytest.mark.parametrize(
    ("text", "manager"),
    [
        ("ID=debian\n", "apt"),
        ('NAME="Linux Mint"\nID=linuxmint\nID_LIKE="ubuntu debian"\n', "apt"),
        ("ID=fedora\n", "dnf"),
        ('ID="rocky"\nID_LIKE="rhel centos fedora"\n', "dnf"),
        ("ID=manjaro\nID_LIKE=arch\n", "pacman"),
        ('ID="opensuse-tumbleweed"\nID_LIKE="opensuse suse"\n', "zypper"),
        ("ID=nixos\n", None),
    ],
)
def test_the_distribution_says_what_installs(text, manager, tmp_path):
    file = tmp_path / "os-release"
    file.write_text(text)
    assert package_manager(file) == manager


def test_a_system_that_says_nothing_has_no_known_manager(tmp_path):
    assert package_manager(tmp_path / "absent") is None


@pytest.mark.parametrize("manager", MANAGERS)
def test_every_need_of_the_window_has_a_package_everywhere(manager):
    wanted = [need for need in needs() if need.use != "test"]
    assert all(manager in need.packages for need in wanted)
    words = install_line(wanted, manager).split()
    assert len(set(words)) == len(words)
    assert {need.packages[manager] for need in wanted} <= set(words)


def test_the_readme_names_the_packages_of_the_list():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    line = re.search(r"^sudo apt-get install ((?:.*\\\n)*.*)$", readme, re.MULTILINE)[1]
    uses = ("picture", "window", "x11", "driver")
    assert line.replace("\\\n", " ").split() == list(
        dict.fromkeys(need.packages["apt"] for need in needs() if need.use in uses)
    )


def test_the_test_script_names_no_package_of_its_own():
    script = (ROOT / "tests" / "run").read_text(encoding="utf-8")
    assert "resources/system-packages.txt" in script
    words = set(re.findall(r"[a-z0-9.+-]+", re.sub(r"#.*", "", script)))
    assert {need.packages["apt"] for need in needs()} & words == {"python3-venv"}
