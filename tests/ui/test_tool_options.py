"""The bar over the viewport: a tool's choices and numbers are its options, both ways."""

from dataclasses import dataclass

from PySide6.QtCore import Qt

from splap_editor.core.options import check_options, option
from splap_editor.tools.crop_tool import CropNumbers, CropOptions
from splap_editor.tools.select_tool import SelectOptions
from splap_editor.tools.tool import Held
from splap_editor.ui.widgets.tool_options import HeldForm, ToolOptionsBar


@dataclass(frozen=True)
class RingOptions:
    """Options of no tool there is: a whole number, and a share of something."""

    rings: int = option(2, "How many rings.", label="Rings", least=0, most=9)
    share: float = option(0.5, "How much.", label="Share", least=0.0, most=1.0, is_percent=True, step=0.01, decimals=2)

    def __post_init__(self) -> None:
        check_options(self)


def test_a_whole_number_stays_one(qtbot):
    held = Held(RingOptions())
    form = HeldForm(held)
    qtbot.addWidget(form)
    form.editors["rings"].setValue(5)
    form.editors["share"].setValue(20)
    assert held.value == RingOptions(5, 0.2) and type(held.value.rings) is int
    assert form.editors["rings"].text() == "5" and form.editors["rings"].decimals() == 0
    held.set(RingOptions(7))
    assert form.editors["rings"].value() == 7


def test_a_choice_sets_the_crop_shape_and_shows_another_one(driver):
    (bar,) = driver.window.findChildren(ToolOptionsBar)
    held = driver.window.tools.context.held(CropOptions)
    choice = bar.forms[CropOptions].editors["kind"]
    choice.activated.emit(choice.findData("ball"))
    assert held.value.kind == "ball"
    held.set(CropOptions("plane"))
    assert choice.currentData() == "plane"


def test_a_crop_from_the_keyboard_is_undone(driver):
    window = driver.window
    window.tools.choose("crop")
    tool = window.tools.chosen
    tool.begin()
    (bar,) = window.findChildren(ToolOptionsBar)
    width = bar.forms[CropNumbers].editors["width"]
    width.committed.emit(0.5 * width.value())
    goes = tool.goes()
    assert goes.any() and not goes.all()
    driver.key(Qt.Key.Key_Return)
    assert (driver.scene.removed == goes).all()
    driver.wait_idle()
    driver.session.history.undo()
    assert driver.scene.edit.removed is None
    driver.wait_idle()


def test_selecting_through_goes_by_one_name_and_is_one_switch(driver):
    (bar,) = driver.window.findChildren(ToolOptionsBar)
    switch, action = bar.forms[SelectOptions].editors["through"], driver.window.actions_["select.through"]
    for _ in range(2):
        action.trigger()
        assert switch.isChecked() == action.isChecked()
        assert switch.text() == action.text().replace("&", "")
    switch.click()
    assert action.isChecked() and switch.text() == action.text().replace("&", "")
