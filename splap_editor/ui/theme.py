"""How the window looks: one palette, one style sheet, our own icons."""

from functools import cache

from PySide6.QtCore import QByteArray, QRectF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QIcon, QImage, QPainter, QPalette, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QApplication, QStyleFactory, QToolBar, QToolButton

from splap_editor.resources import resource

GROUND = "#1b1c1e"
PANEL = "#242528"
RAISED = "#2e2f33"
FIELD = "#1a1b1d"
LINE = "#36373c"
TEXT = "#dcdde0"
QUIET = "#9fa1a8"
FAINT = "#6c6e76"
ACCENT = "#f2a93b"
ON_ACCENT = "#1b1407"
DANGER = "#ff7a6b"

STEP = 4
"""Rhythm of the layout in logical pixels: every margin and gap is a multiple."""

ICON_SIZES = (16, 20, 24, 32)


def apply_theme(app: QApplication) -> None:
    """Give the application its dark neutral look; the font stays the system's."""
    app.setStyle(QStyleFactory.create("Fusion"))
    app.setPalette(palette())
    app.setStyleSheet(style_sheet())
    app.setWindowIcon(QIcon(str(resource("icons", "splap-editor.svg"))))


def palette() -> QPalette:
    """Colours for everything the style sheet does not name."""
    result = QPalette()
    roles = {
        QPalette.ColorRole.Window: PANEL,
        QPalette.ColorRole.WindowText: TEXT,
        QPalette.ColorRole.Base: FIELD,
        QPalette.ColorRole.AlternateBase: PANEL,
        QPalette.ColorRole.Text: TEXT,
        QPalette.ColorRole.Button: RAISED,
        QPalette.ColorRole.ButtonText: TEXT,
        QPalette.ColorRole.BrightText: "#ffffff",
        QPalette.ColorRole.ToolTipBase: "#111214",
        QPalette.ColorRole.ToolTipText: TEXT,
        QPalette.ColorRole.PlaceholderText: FAINT,
        QPalette.ColorRole.Highlight: ACCENT,
        QPalette.ColorRole.HighlightedText: ON_ACCENT,
        QPalette.ColorRole.Link: ACCENT,
        QPalette.ColorRole.Mid: LINE,
        QPalette.ColorRole.Dark: GROUND,
        QPalette.ColorRole.Shadow: "#000000",
    }
    for role, color in roles.items():
        result.setColor(role, QColor(color))
    for role in (QPalette.ColorRole.WindowText, QPalette.ColorRole.Text, QPalette.ColorRole.ButtonText):
        result.setColor(QPalette.ColorGroup.Disabled, role, QColor(FAINT))
    return result


@cache
def icon(name: str) -> QIcon:
    """Icon of ``resources/icons/<name>.svg``; it follows text colours, and the accent when checked."""
    source = resource("icons", f"{name}.svg").read_bytes()
    result = QIcon()
    states = (
        (QIcon.Mode.Normal, QIcon.State.Off, TEXT),
        (QIcon.Mode.Active, QIcon.State.Off, "#ffffff"),
        (QIcon.Mode.Disabled, QIcon.State.Off, FAINT),
        (QIcon.Mode.Normal, QIcon.State.On, ACCENT),
        (QIcon.Mode.Active, QIcon.State.On, ACCENT),
        (QIcon.Mode.Disabled, QIcon.State.On, FAINT),
    )
    app = QGuiApplication.instance()
    assert isinstance(app, QGuiApplication)
    ratios = {1.0, 2.0, app.devicePixelRatio()}
    for mode, state, color in states:
        renderer = QSvgRenderer(QByteArray(source.replace(b"currentColor", color.encode())))
        for size in ICON_SIZES:
            for ratio in ratios:
                result.addPixmap(_pixmap(renderer, size, ratio), mode, state)
    return result


def _pixmap(renderer: QSvgRenderer, size: int, ratio: float) -> QPixmap:
    image = QImage(round(size * ratio), round(size * ratio), QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    renderer.render(painter, QRectF(0, 0, image.width(), image.height()))
    painter.end()
    pixmap = QPixmap.fromImage(image)
    pixmap.setDevicePixelRatio(ratio)
    return pixmap


def icon_path(name: str) -> str:
    """Path of an icon for the style sheet, with forward slashes on every system."""
    return resource("icons", f"{name}.svg").as_posix()


def style_sheet() -> str:
    """Style sheet of the whole application."""
    return "".join((_ground(), _bars(), _input(), _measures(), _own()))


def _ground() -> str:
    """Windows and tool tips."""
    return f"""
    QWidget {{ color: {TEXT}; }}
    QMainWindow, QDialog {{ background: {PANEL}; }}
    QMainWindow::separator {{ background: {GROUND}; width: 4px; height: 4px; }}
    QMainWindow::separator:hover {{ background: {LINE}; }}
    QToolTip {{ background: #111214; color: {TEXT}; border: 1px solid {LINE}; padding: 4px 8px; }}
    """


def _bars() -> str:
    """Menus and tool bars."""
    return f"""
    QMenuBar {{ background: {PANEL}; padding: 0 4px; }}
    QMenuBar::item {{ padding: 6px 10px; background: transparent; border-radius: 4px; }}
    QMenuBar::item:selected {{ background: {RAISED}; }}
    QMenu {{ background: {PANEL}; border: 1px solid {LINE}; padding: 4px; }}
    QMenu::item {{ padding: 5px 28px 5px 8px; border-radius: 3px; }}
    QMenu::icon {{ padding-left: 6px; }}
    QMenu::item:selected {{ background: #3b3c41; color: #ffffff; }}
    QMenu::item:disabled {{ color: {FAINT}; background: transparent; }}
    QMenu::separator {{ height: 1px; background: {LINE}; margin: 4px 8px; }}

    QToolBar {{ background: {PANEL}; border: 0; padding: 4px; spacing: 4px; }}
    QToolBar::separator {{ background: {LINE}; }}
    QToolBar::separator:horizontal {{ width: 1px; margin: 4px; }}
    QToolBar::separator:vertical {{ height: 1px; margin: 4px; }}
    QToolButton {{ border: 0; border-radius: 4px; padding: 4px; background: transparent; }}
    QToolButton:hover {{ background: {RAISED}; }}
    QToolButton:pressed {{ background: {LINE}; }}
    QToolButton:checked {{ background: #3b3120; color: {ACCENT}; }}
    QToolButton:disabled {{ color: {FAINT}; }}
    QToolButton:focus {{ outline: none; }}
    #toolColumn QToolButton {{ padding: 6px; }}
    #headerBar {{ background: {PANEL}; }}
    #headerBar QToolButton {{ padding: 4px 8px; }}
    #headerButtons {{ padding: 0; spacing: 2px; }}
    #headerButtons #qt_toolbar_ext_button, #toolColumn #qt_toolbar_ext_button {{ padding: 0; background: {RAISED}; }}
    """


def _input() -> str:
    """Buttons, fields and what message boxes do with them."""
    return f"""
    QPushButton {{ background: {RAISED}; border: 1px solid {LINE}; border-radius: 4px;
        padding: 5px 14px; min-height: 16px; }}
    QPushButton:hover {{ background: #38393e; }}
    QPushButton:pressed {{ background: {FIELD}; }}
    QPushButton:default {{ background: {ACCENT}; border-color: {ACCENT}; color: {ON_ACCENT}; font-weight: 600; }}
    QPushButton:default:hover {{ background: #ffbb55; }}
    QPushButton:disabled {{ color: {FAINT}; background: {PANEL}; }}
    QPushButton:focus {{ border-color: {ACCENT}; }}
    QPushButton[flat="true"] {{ background: transparent; border: 0; color: {ACCENT}; padding: 2px 8px; }}
    QPushButton[flat="true"]:hover {{ background: {RAISED}; }}

    QLineEdit, QAbstractSpinBox, QComboBox, QPlainTextEdit {{
        background: {FIELD}; border: 1px solid {LINE}; border-radius: 4px; padding: 3px 6px; min-height: 16px;
        selection-background-color: {ACCENT}; selection-color: {ON_ACCENT};
    }}
    QAbstractSpinBox::up-button, QAbstractSpinBox::down-button {{ width: 0; border: 0; }}
    QAbstractSpinBox {{ padding: 3px 0; }}
    QAbstractSpinBox QLineEdit {{ background: transparent; border: 0; padding: 0 6px; min-height: 0; }}
    QLineEdit:hover, QAbstractSpinBox:hover, QComboBox:hover {{ border-color: {FAINT}; }}
    QLineEdit:focus, QAbstractSpinBox:focus, QComboBox:focus {{ border-color: {ACCENT}; }}
    QLineEdit:disabled, QAbstractSpinBox:disabled, QComboBox:disabled {{ color: {FAINT}; background: {PANEL}; }}
    QComboBox::drop-down {{ border: 0; width: 20px; }}
    QComboBox::down-arrow {{ image: url({icon_path("chevron-down")}); width: 12px; height: 12px; }}
    QComboBox QAbstractItemView {{ background: {PANEL}; border: 1px solid {LINE}; outline: 0; padding: 4px; }}

    QDialogButtonBox {{ dialogbuttonbox-buttons-have-icons: 0; }}
    QMessageBox {{ messagebox-text-interaction-flags: 0; }}
    """


def _measures() -> str:
    """Boxes to tick, sliders, progress and scroll bars."""
    return f"""
    QCheckBox {{ spacing: 8px; }}
    QCheckBox::indicator {{ width: 14px; height: 14px;
        border: 1px solid {FAINT}; border-radius: 3px; background: {FIELD}; }}
    QCheckBox::indicator:hover {{ border-color: {QUIET}; }}
    QCheckBox::indicator:checked {{ image: url({icon_path("check")}); border-color: {ACCENT}; background: #3b3120; }}
    QCheckBox:disabled {{ color: {FAINT}; }}

    QSlider::groove:horizontal {{ height: 4px; background: {FIELD}; border-radius: 2px; }}
    QSlider::sub-page:horizontal {{ background: {FAINT}; border-radius: 2px; }}
    QSlider::handle:horizontal {{ background: {TEXT}; width: 12px; height: 12px; margin: -4px 0; border-radius: 6px; }}
    QSlider::handle:horizontal:hover {{ background: {ACCENT}; }}

    QProgressBar {{ background: {FIELD}; border: 0; border-radius: 3px; }}
    QProgressBar::chunk {{ background: {ACCENT}; border-radius: 3px; }}

    QScrollArea {{ border: 0; background: transparent; }}
    QScrollBar:vertical {{ background: transparent; width: 10px; margin: 0; }}
    QScrollBar::handle:vertical {{ background: #44464c; border-radius: 3px; min-height: 24px; margin: 2px; }}
    QScrollBar::handle:vertical:hover {{ background: {FAINT}; }}
    QScrollBar:horizontal {{ background: transparent; height: 10px; margin: 0; }}
    QScrollBar::handle:horizontal {{ background: #44464c; border-radius: 3px; min-width: 24px; margin: 2px; }}
    QScrollBar::add-line, QScrollBar::sub-line, QScrollBar::add-page, QScrollBar::sub-page {{
        background: none; border: 0; width: 0; height: 0;
    }}
    """


def _own() -> str:
    """Status bar, docks and widgets of our own."""
    return f"""
    QStatusBar {{ background: {PANEL}; border-top: 1px solid {GROUND}; }}
    QStatusBar::item {{ border: 0; }}
    QDockWidget {{ titlebar-close-icon: none; titlebar-normal-icon: none; }}

    #panelSection {{ border-bottom: 1px solid {GROUND}; }}
    #sectionHeader {{ text-align: left; padding: 8px; font-weight: 600; border-radius: 0; }}
    #sectionHeader, #sectionHeader:checked {{ background: {PANEL}; color: {TEXT}; }}
    #sectionHeader:hover, #sectionHeader:checked:hover {{ background: {RAISED}; }}
    #detailsHeader, #detailsHeader:checked {{ background: transparent; color: {QUIET}; padding: 2px; }}
    #handleRow {{ border-radius: 4px; border-left: 2px solid transparent; }}
    #handleRow[chosen="yes"] {{ background: {RAISED}; }}
    #handleRow[chosen="last"] {{ background: {RAISED}; border-left: 2px solid {ACCENT}; }}
    #handleList, #handleList > QWidget > QWidget {{ background: transparent; }}
    QLabel[tone="quiet"] {{ color: {QUIET}; }}
    QLabel[tone="warning"] {{ color: {ACCENT}; }}
    QLabel[tone="danger"] {{ color: {DANGER}; }}
    QLabel[tone="title"] {{ font-size: 15px; font-weight: 600; }}
    #nameField {{ background: transparent; border-color: transparent; padding: 2px 4px; }}
    #nameField:hover {{ border-color: {LINE}; }}
    #nameField:focus {{ background: {FIELD}; border-color: {ACCENT}; }}
    #toast {{ background: #2b2c30; border: 1px solid #4a4b52; border-radius: 6px; }}
    #toast[tone="failure"] {{ border-color: {DANGER}; }}
    #keyCap {{ background: {FIELD}; border: 1px solid {LINE}; border-radius: 3px; padding: 1px 6px; color: {TEXT}; }}
    """


def show_more_button(bar: QToolBar) -> None:
    """Have the button for what a tool bar has no room for look like the others; Qt's own is dark on dark."""
    more = bar.findChild(QToolButton, "qt_toolbar_ext_button")
    assert isinstance(more, QToolButton)
    more.setIcon(icon("chevron-down" if bar.orientation() == Qt.Orientation.Vertical else "chevron-right"))
    more.setToolTip("More")
