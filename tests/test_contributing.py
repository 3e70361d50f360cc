"""The map for contributors names what is there."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")
PLACES = sorted(set(re.findall(r"`([a-z_/]+\.py)(?::([A-Za-z_.]+))?", PAGE)))


def test_every_place_that_the_page_names_is_there():
    assert len(PLACES) > 20
    for path, name in PLACES:
        file = ROOT / "splap_editor" / path
        assert file.is_file(), path
        source = file.read_text(encoding="utf-8")
        for part in filter(None, name.split(".")):
            assert re.search(rf"^\s*(def|class) {part}\b|^{part}\b", source, re.MULTILINE), f"{path} has no {part}"


def test_every_room_of_the_house_is_on_the_page():
    rooms = {path.parent.name for path in (ROOT / "splap_editor").glob("*/__init__.py")}
    rooms |= {path.parent.name for path in (ROOT / "splap_editor" / "core").glob("*/__init__.py")}
    assert {room for room in rooms if not re.search(rf"\b{room}\b", PAGE)} == set()
