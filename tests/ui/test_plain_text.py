"""Text of a file, a path or an exception is shown letter by letter, wherever it is shown."""

import re
from pathlib import Path

from PySide6.QtGui import QAction, Qt
from PySide6.QtWidgets import QApplication, QLabel, QListWidget, QMessageBox

import splap_editor
from splap_editor.core.handle_nodes import Region
from splap_editor.resources import resource

MADE_ELSEWHERE = r"\b(QLabel|QMessageBox)\(|QMessageBox\.(about|critical|warning|question)\b|QToolTip\."
HOSTILE = "<img src='x'><b>bold"


def rich_texts(window) -> list[str]:
    """Texts that Qt would take for documents, of every widget and action there is."""
    found = []
    for widget in QApplication.allWidgets():
        if isinstance(widget, QLabel) and widget.textFormat() != Qt.TextFormat.PlainText:
            found.append(f"label {widget.text()!r} of {type(widget.parent()).__name__}")
        if isinstance(widget, QMessageBox) and widget.textFormat() != Qt.TextFormat.PlainText:
            found.append(f"box {widget.text()!r}")
        tips = [widget.toolTip(), widget.statusTip(), widget.whatsThis()]
        if isinstance(widget, QListWidget):
            tips += [widget.item(row).toolTip() for row in range(widget.count())]
        found += [f"tip {tip!r} of {type(widget).__name__}" for tip in tips if HOSTILE in tip]
    for action in window.findChildren(QAction):
        found += [f"action tip {tip!r}" for tip in (action.toolTip(), action.statusTip()) if HOSTILE in tip]
    return found


def test_no_widget_takes_a_hostile_name_for_a_document(driver, tmp_path):
    path = tmp_path / f"{HOSTILE}.ply"
    path.write_bytes(resource("samples", "tube.ply").read_bytes())
    driver.open(path)
    driver.wait_idle()
    window = driver.window
    window.session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1), name=HOSTILE)
    window.toast.fail(f"{HOSTILE} cannot be read.")
    window.session.failed.emit(HOSTILE, ValueError(HOSTILE))
    QApplication.processEvents()
    assert rich_texts(window) == []
    assert HOSTILE in window.toast.text


def test_no_label_shows_tags(driver):
    window = driver.window
    driver.key(Qt.Key.Key_I)
    driver.click(driver.surface_pixel())
    window.inspection.inspected.set(kind="graph", other="euclidean")
    window.inspection.graph_view.set(shown="all")
    row = driver.scene.picked
    node = driver.scene.ellipses.node_of_row[row]
    graph = driver.scene.surface.graph
    other = int(driver.scene.ellipses.rows[graph.indices[graph.indptr[node]]])
    window.inspection.inspected.pick_edge((row, other))
    texts = [label.text() for label in window.findChildren(QLabel)]
    assert any("by both" in text for text in texts) and any(text.startswith("Edge ") for text in texts)
    assert [text for text in texts if re.search("<[a-z/]", text)] == []


def test_labels_and_boxes_are_made_by_one_constructor():
    package = Path(splap_editor.__file__).parent
    assert re.search(MADE_ELSEWHERE, "label = QLabel(text)") and len(list(package.rglob("*.py"))) > 100
    assert [path for path in package.rglob("*.py") if re.search(MADE_ELSEWHERE, path.read_text())] == []
