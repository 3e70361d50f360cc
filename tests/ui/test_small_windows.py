"""A window on a small screen: what has no room is put away whole and can be reached, nothing is cut or shrunk."""

from itertools import combinations, product

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QScrollArea, QToolBar, QToolButton, QWidget

from splap_editor.ui.timeline.strip import TimelineStrip

# Points of screens of 1280 x 800 and 1440 x 900 at twice the scale, less a task bar; the least; a common size.
SIZES = [(624, 352), (720, 420), (900, 600), (1440, 900)]
MORE = "qt_toolbar_ext_button"


def sized(driver, qtbot):
    """Give the window one size after the other."""
    window = driver.window
    window.setMinimumSize(1, 1)
    for size in SIZES:
        window.resize(*size)
        qtbot.waitUntil(lambda size=size: window.size() == QSize(*size))
        driver.wait_frame()
        yield size


def test_a_button_is_shown_at_its_size_or_stands_behind_one_that_is(driver, qtbot):
    for size in sized(driver, qtbot):
        for name, tool in product(("toolColumn", "headerButtons"), ("handle", "crop", "lasso")):
            driver.window.tools.choose(tool)
            bar = driver.window.findChild(QToolBar, name)
            driver.qtbot.waitUntil(lambda bar=bar: not bar.isHidden())
            driver.wait_frame()
            more = bar.findChild(QToolButton, MORE)
            qtbot.waitUntil(lambda bar=bar, more=more: more.isHidden() or bar.rect().contains(more.geometry()))
            buttons = [bar.widgetForAction(action) for action in bar.actions() if not action.isSeparator()]
            buttons = [button for button in buttons if isinstance(button, QToolButton)]
            shown = [button for button in buttons if button.isVisible()]
            for button in shown:
                assert button.width() >= button.iconSize().width() and button.height() >= button.iconSize().height()
                assert bar.rect().contains(button.geometry())
            assert more.isVisible() == (len(shown) < len(buttons)), tool
            if more.isVisible():
                assert min(more.width(), more.height()) >= 10
            assert shown or size[0] < 900


def test_nothing_of_panels_picture_and_timeline_is_cut_at_the_side(driver, qtbot):
    window = driver.window
    scroll = window.dock.widget()
    assert isinstance(scroll, QScrollArea)
    window.actions_["timeline.show"].trigger()
    strip = window.findChild(TimelineStrip)
    qtbot.waitUntil(strip.isVisible)
    for size in sized(driver, qtbot):
        assert window.rect().contains(window.dock.geometry()), size
        assert window.centralWidget().rect().contains(window.viewport.geometry()), size
        assert window.centralWidget().rect().contains(strip.geometry()), size
        shown = [child for child in strip.findChildren(QWidget) if child.isVisible() and child.parent() is strip]
        assert len(shown) == 9 and all(strip.rect().contains(child.geometry()) for child in shown), size
        boxes = [child.geometry() for child in shown]
        assert not any(a.intersects(b) for a, b in combinations(boxes, 2)), size
        for tool in ("crop", "lasso", "handle"):
            window.tools.choose(tool)
            driver.wait_frame()
            assert window.rect().contains(window.dock.geometry()), (size, tool)
        for index in range(window.deformer_panel.method.count()):
            window.deformer_panel.method.setCurrentIndex(index)
            driver.wait_idle()
            assert scroll.widget().width() <= scroll.viewport().width()
