"""The Help menu, and what concerns the program as a whole."""

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.program_actions import ProgramActions

A = ActionSpec

HELP_TABLE: tuple[ActionSpec, ...] = (
    A(
        "program.palette",
        ProgramActions.palette,
        "&Find an action…",
        ("Ctrl+Shift+P",),
        tip="Type a few letters of what you want to do.",
        menu="He&lp",
    ),
    A(
        "help.sheet",
        ProgramActions.sheet,
        "&Keys and gestures",
        ("F1",),
        icon="help",
        tip="Everything the mouse and keyboard do.",
        menu="He&lp",
    ),
    A("help.about", ProgramActions.about, "&About SpLap Editor", tip="Version, licence and the paper.", menu="He&lp"),
)
