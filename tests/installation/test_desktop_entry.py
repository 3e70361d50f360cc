import configparser
import os
import re
import shlex
import shutil
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from splap_editor.cli import main
from splap_editor.installation.desktop_entry import SESSION_TYPE, TYPES, integrate, remove
from splap_editor.io.formats.table import FORMATS
from splap_editor.io.session_file import SUFFIX

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="desktop entries are Linux's")
MIME = "{http://www.freedesktop.org/standards/shared-mime-info}"


def test_integrate_writes_what_a_desktop_reads_and_remove_takes_all_of_it_away(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    other = tmp_path / "applications" / "other.desktop"
    other.parent.mkdir()
    other.write_text("[Desktop Entry]\n")
    assert main(["integrate"]) == 0
    entry = configparser.RawConfigParser()
    entry.optionxform = str
    entry.read(tmp_path / "applications" / "splap-editor.desktop")
    fields = entry["Desktop Entry"]
    assert fields["MimeType"].split(";") == [*(each.name for each in TYPES), ""]
    program, *_, last = shlex.split(fields["Exec"])
    assert os.access(program, os.X_OK) and last == "%f"
    assert list(tmp_path.rglob(f"icons/**/{fields['Icon']}.svg"))
    capsys.readouterr()
    assert main(["integrate", "--remove"]) == 0
    assert capsys.readouterr().out.count("removed") == 3
    assert other.exists()
    left = [path for path in tmp_path.rglob("*") if path.is_file() and "splap" in path.name + path.read_text("latin-1")]
    assert left == []
    assert main(["integrate", "--remove"]) == 0 and "nothing to remove" in capsys.readouterr().out


def test_the_session_type_is_ours_and_all_other_files_keep_theirs(tmp_path):
    types = ElementTree.parse(next(path for path in integrate(tmp_path) if path.suffix == ".xml")).getroot()
    globs = {kind.get("type"): kind.findall(f"{MIME}glob") for kind in types.iter(f"{MIME}mime-type")}
    session = globs.pop(SESSION_TYPE)
    assert [(each.get("pattern"), each.get("weight")) for each in session] == [(f"*{SUFFIX}", "60")]
    # 50 is what every other type has: that of another program wins.
    assert all(int(each.get("weight")) < 50 for held in globs.values() for each in held)
    # Nothing says that this program is anybody's default.
    assert not list(tmp_path.rglob("mimeapps.list"))
    remove(tmp_path)


def test_every_file_that_opens_by_itself_is_of_a_type_of_the_entry():
    opened = {suffix for row in FORMATS.values() for suffix in row.opened_suffixes} - {"meta.json"} | {SUFFIX}
    endings = [ending for each in TYPES for ending in each.endings]
    assert all(any(suffix.endswith(ending) for ending in endings) for suffix in opened)
    assert len({each.name for each in TYPES}) == len(TYPES) and len(set(endings)) == len(endings)
    assert set(endings) <= opened


@pytest.mark.skipif(shutil.which("update-mime-database") is None, reason="shared-mime-info is not installed")
def test_a_desktop_takes_the_types_and_forgets_them(tmp_path):
    integrate(tmp_path)
    globs = (tmp_path / "mime" / "globs2").read_text()
    for each in TYPES:
        assert all(f"{each.weight}:{each.name}:*{ending}\n" in globs for ending in each.endings if each.comment)
    remove(tmp_path)
    left = tmp_path / "mime" / "globs2"
    assert not left.exists() or not any(each.name in left.read_text() for each in TYPES if each.comment)


def test_a_path_with_marks_of_the_format_comes_through(monkeypatch, tmp_path):
    python = Path('/opt/my "tools" 100%/$x/bin/python')
    monkeypatch.setattr(sys, "executable", str(python))
    starter = integrate(tmp_path)[0].read_text(encoding="utf-8")
    command = re.search("^Exec=(.*) %f$", starter, re.MULTILINE)[1]
    # A reader takes off the file's escapes, then the quotes with theirs and the doubled per cent.
    quoted = re.match(r'"((?:[^"\\]|\\.)*)"', command.replace("\\\\", "\\"))[1]
    assert re.sub(r"\\(.)", r"\1", quoted).replace("%%", "%") == str(python)


def test_integrate_elsewhere_says_what_to_do(monkeypatch, capsys):
    monkeypatch.setattr(sys, "platform", "win32")
    assert main(["integrate"]) == 2
    assert "pin the running program" in capsys.readouterr().err
