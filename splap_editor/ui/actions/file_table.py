"""The File menu."""

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.conditions import has_handles, has_scene
from splap_editor.ui.actions.document_actions import DocumentActions
from splap_editor.ui.actions.file_actions import FileActions

A = ActionSpec

FILE_TABLE: tuple[ActionSpec, ...] = (
    A(
        "file.open",
        FileActions.open,
        "&Open…",
        ("Ctrl+O",),
        icon="open",
        tip="Open a splat PLY or a session; it can also be dropped on the window.",
        menu="&File",
    ),
    A(
        "file.open_sample",
        FileActions.open_sample,
        "Open sa&mple",
        tip="Open the sample that comes with the program.",
        menu="&File",
    ),
    A(
        "document.save",
        DocumentActions.save,
        "&Save session",
        ("Ctrl+S",),
        tip="Save handles, pins, keys, view and selections in a file beside the PLY.",
        needs=has_scene,
        menu="&File",
        breaks=True,
    ),
    A(
        "document.save_as",
        DocumentActions.save_as,
        "Save session &as…",
        ("Ctrl+Shift+S",),
        tip="Save them in another file.",
        needs=has_scene,
        menu="&File",
    ),
    A(
        "file.export",
        FileActions.export,
        "&Export…",
        ("Ctrl+E",),
        icon="export",
        tip="Write what is on screen as a file of splats.",
        needs=has_scene,
        menu="&File",
        breaks=True,
    ),
    A(
        "file.open_edit",
        FileActions.open_edit,
        "Open e&dit…",
        ("Ctrl+Shift+O",),
        tip="Read handles, pins and options.",
        needs=has_scene,
        menu="&File",
        breaks=True,
    ),
    A(
        "file.export_edit",
        FileActions.export_edit,
        "Export ed&it…",
        tip="Write handles, pins and options, for another file or the terminal.",
        needs=has_handles,
        menu="&File",
    ),
    A(
        "file.picture",
        FileActions.picture,
        "Save &picture…",
        ("F12",),
        icon="picture",
        tip="Write the view as a PNG of any size.",
        needs=has_scene,
        menu="&File",
        breaks=True,
    ),
    A("file.quit", FileActions.quit, "&Quit", ("Ctrl+Q",), tip="Close the window.", menu="&File", breaks=True),
)
