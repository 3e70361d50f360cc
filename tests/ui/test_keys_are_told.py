"""What is told of keys is made from what they do."""

import importlib
import pkgutil

from PySide6.QtWidgets import QWidget

from splap_editor import ui
from splap_editor.ui.gestures import WIDGETS
from tests.keys_table import README, with_keys_table


def test_the_readme_tells_the_keys_there_are():
    text = README.read_text(encoding="utf-8")
    assert text == with_keys_table(text), "run python -m tests.keys_table"


def test_every_widget_that_follows_the_pointer_tells_its_gestures():
    modules = [importlib.import_module(each.name) for each in pkgutil.walk_packages(ui.__path__, "splap_editor.ui.")]
    kinds = {each for module in modules for each in vars(module).values() if isinstance(each, type)}
    own = {kind for kind in kinds if issubclass(kind, QWidget) and kind.__module__.startswith("splap_editor.")}
    following = {kind for kind in own if "mouseMoveEvent" in vars(kind)}
    telling = {kind for kind in own if "gestures" in vars(kind)}
    assert following <= telling == set(WIDGETS)
