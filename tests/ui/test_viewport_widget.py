"""One render per frame shown, and nothing of VTK's own input."""

import sys

from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtTest import QTest


def test_a_frame_shown_is_one_render(driver, qtbot):
    widget = driver.window.viewport
    widget.n_renders = 0
    frames = []
    widget.frame_drawn.connect(frames.append)
    for _ in range(5):
        driver.wait_frame()
    assert widget.n_renders == len(frames) >= 5


def test_many_requests_before_a_paint_give_one_render(driver, qtbot):
    widget = driver.window.viewport
    driver.wait_frame()
    widget.n_renders = 0
    with qtbot.waitSignal(widget.frame_drawn):
        for _ in range(20):
            widget.render()
            driver.window.view.viewport.request_render()
    assert widget.n_renders == 1


def test_a_hud_text_renders_nothing(driver, qtbot):
    widget, overlay = driver.window.viewport, driver.window.overlay
    driver.wait_frame()
    widget.n_renders = 0
    overlay.show_hint("Something else")
    QCoreApplication.processEvents()
    assert widget.n_renders == 0


def test_keys_of_vtk_do_nothing(driver):
    camera = driver.window.view.viewport.camera
    before = camera.view.position
    for key in (Qt.Key.Key_V, Qt.Key.Key_J, Qt.Key.Key_T, Qt.Key.Key_U):
        QTest.keyClick(driver.window.viewport, key)
    assert (camera.view.position == before).all()


def test_a_thousand_updates_do_not_take_references_from_none(driver):
    widget = driver.window.viewport
    before = sys.getrefcount(None)
    for _ in range(1000):
        widget.update()
    # Immortal from Python 3.12 on, where the count never changes.
    assert sys.getrefcount(None) > before - 500
