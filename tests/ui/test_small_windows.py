"""A window on a small screen: what has no room is put away whole and can be reached, nothing is cut or shrunk."""

import pytest
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QScrollArea, QToolBar, QToolButton

# Points of a 1440 x 900 screen at twice the scale, less a task bar; the least by itself; and a common size.
SIZES = [(720, 420), (900, 600), (1440, 900)]
MORE = "qt_toolbar_ext_button"


@pytest.fixture(params=SIZES, ids="{0[0]}x{0[1]}".format)
def size(request, driver, qtbot):
    window = driver.window
    window.setMinimumSize(1, 1)
    window.resize(*request.param)
    qtbot.waitUntil(lambda: window.size() == QSize(*request.param))
    return request.param


@pytest.mark.parametrize("name", ["toolColumn", "headerButtons"])
def test_a_button_is_shown_at_its_size_or_stands_behind_one_that_is(driver, size, name):
    for tool in ("handle", "crop", "lasso"):
        driver.window.tools.choose(tool)
        bar = driver.window.findChild(QToolBar, name)
        driver.qtbot.waitUntil(lambda bar=bar: not bar.isHidden())
        driver.wait_frame()
        more = bar.findChild(QToolButton, MORE)
        buttons = [bar.widgetForAction(action) for action in bar.actions() if not action.isSeparator()]
        buttons = [button for button in buttons if isinstance(button, QToolButton)]
        shown = [button for button in buttons if button.isVisible()]
        for button in shown:
            assert button.width() >= button.iconSize().width() and button.height() >= button.iconSize().height()
            assert bar.rect().contains(button.geometry())
        assert more.isVisible() == (len(shown) < len(buttons)), tool
        if more.isVisible():
            assert bar.rect().contains(more.geometry()) and min(more.width(), more.height()) >= 10
        assert shown or size[0] < 900


def test_nothing_of_the_panels_is_cut_at_the_side(driver, size):
    scroll = driver.window.dock.widget()
    assert isinstance(scroll, QScrollArea)
    for index in range(driver.window.deformer_panel.method.count()):
        driver.window.deformer_panel.method.setCurrentIndex(index)
        driver.wait_idle()
        assert scroll.widget().width() <= scroll.viewport().width()
