"""Every action of the program as data: menus, toolbars, tooltips, shortcuts and the help sheet read this one table."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ActionSpec:
    """One thing a person can ask for.

    Parameters
    ----------
    action_id : str
        ``"file.open"``: the part before the dot names the object that carries it out, the part after it the method.
    text : str
        As in the menu; an ellipsis when a dialog follows.
    shortcuts : tuple of str
        As `QKeySequence` reads them; the first is shown.
    icon : str
        File name in ``resources/icons``, or empty.
    tip : str
        One sentence on what it does; the tooltip adds text and shortcut.
    needs : str
        Name of the condition under which it can be used; empty: always.
    menu : str
        Title of the menu; a slash names a submenu. Empty: in no menu.
    group : str
        Checkable actions of one group exclude each other.
    checkable : bool
        Shows a state, kept right by whoever changes it.
    breaks : bool
        A separator stands before it in the menu.
    """

    action_id: str
    text: str
    shortcuts: tuple[str, ...] = ()
    icon: str = ""
    tip: str = ""
    needs: str = ""
    menu: str = ""
    group: str = ""
    checkable: bool = False
    breaks: bool = False

    @property
    def label(self) -> str:
        """The text without mnemonic and ellipsis, for tooltips and the help sheet."""
        return self.text.replace("&", "").removesuffix("…")


A = ActionSpec

ACTIONS: tuple[ActionSpec, ...] = (
    A(
        "file.open",
        "&Open…",
        ("Ctrl+O",),
        "open",
        "Open a splat PLY or a session; it can also be dropped on the window.",
        menu="&File",
    ),
    A("file.open_sample", "Open sa&mple", (), "", "Open the sample that comes with the program.", menu="&File"),
    A(
        "document.save",
        "&Save session",
        ("Ctrl+S",),
        "",
        "Keep handles, keys, view and selections in a file beside the PLY.",
        "scene",
        "&File",
        breaks=True,
    ),
    A("document.save_as", "Save session &as…", ("Ctrl+Shift+S",), "", "Keep them in another file.", "scene", "&File"),
    A(
        "file.export",
        "&Export PLY…",
        ("Ctrl+E",),
        "export",
        "Write what is on screen as a PLY, row for row.",
        "scene",
        "&File",
        breaks=True,
    ),
    A(
        "file.open_edit",
        "Open e&dit…",
        ("Ctrl+Shift+O",),
        "",
        "Read handles, pins and options.",
        "scene",
        "&File",
        breaks=True,
    ),
    A(
        "file.save_edit",
        "Save ed&it…",
        (),
        "",
        "Write handles, pins and options as a recipe.",
        "handles",
        "&File",
    ),
    A(
        "file.picture",
        "Save &picture…",
        ("F12",),
        "picture",
        "Write the view as a PNG of any size.",
        "scene",
        "&File",
        breaks=True,
    ),
    A("file.quit", "&Quit", ("Ctrl+Q",), "", "Close the window.", menu="&File", breaks=True),
    A("edit.undo", "&Undo", ("Ctrl+Z",), "undo", "Take the last step back.", "undo", "&Edit"),
    A("edit.redo", "&Redo", ("Ctrl+Shift+Z", "Ctrl+Y"), "redo", "Repeat the step taken back.", "redo", "&Edit"),
    A(
        "edit.stop",
        "S&top background work",
        ("Ctrl+.",),
        "",
        "Cancel what is being computed.",
        "busy",
        "&Edit",
        breaks=True,
    ),
    A("edit.resume", "Resume bac&kground work", (), "", "Go on with what was stopped.", "halted", "&Edit"),
    A("select.all", "&All", ("A",), "", "Select every splat that is not hidden.", "scene", "&Select"),
    A("select.none", "&None", ("Alt+A", "Ctrl+Shift+A"), "", "Select nothing.", "selection", "&Select"),
    A("select.invert", "&Invert", ("Ctrl+I",), "", "Swap selected and unselected.", "scene", "&Select"),
    A(
        "select.grow",
        "&Grow",
        ("Ctrl++", "Ctrl+="),
        "",
        "Add the neighbours on the surface.",
        "surface_selection",
        "&Select",
        breaks=True,
    ),
    A("select.shrink", "S&hrink", ("Ctrl+-",), "", "Drop the rim of the selection.", "surface_selection", "&Select"),
    A(
        "select.connected",
        "&Connected",
        ("L",),
        "",
        "Select all that hangs together with it.",
        "surface_selection",
        "&Select",
    ),
    A(
        "select.hide",
        "Hi&de selected",
        ("Shift+H",),
        "eye-off",
        "Neither draw nor pick them; they still bend.",
        "selection",
        "&Select",
        breaks=True,
    ),
    A("select.isolate", "I&solate selected", ("Shift+I",), "", "Hide everything else.", "selection", "&Select"),
    A("select.show_all", "Show a&ll", ("Alt+H",), "eye", "Bring hidden splats back.", "hidden", "&Select"),
    A(
        "select.through",
        "Select &through",
        ("Alt+Z",),
        "through",
        "Also select what lies behind; otherwise only what is visible.",
        menu="&Select",
        checkable=True,
        breaks=True,
    ),
    A(
        "handle.from_selection",
        "&Handle from selection",
        ("H",),
        "handle",
        "Move the selected splats as one handle.",
        "selection",
        "&Handle",
    ),
    A(
        "handle.pin_selection",
        "&Pin selection",
        ("P",),
        "pin",
        "Hold the selected splats where they are.",
        "selection",
        "&Handle",
    ),
    A("handle.clear_pins", "&Clear pins", ("Alt+P",), "", "Let go of everything pinned.", "pins", "&Handle"),
    A(
        "handle.reset",
        "&Reset pose",
        ("Alt+G",),
        "reset",
        "Put the chosen handles back to rest.",
        "active_handles",
        "&Handle",
        breaks=True,
    ),
    A(
        "handle.reset_all",
        "Reset a&ll poses",
        ("Alt+Shift+G",),
        "",
        "Put every handle back to rest.",
        "handles",
        "&Handle",
    ),
    A(
        "handle.delete",
        "&Delete",
        ("Delete", "Backspace"),
        "trash",
        "Delete the chosen handles.",
        "active_handles",
        "&Handle",
    ),
    A(
        "handle.local",
        "&Local axes",
        (",",),
        "local",
        "Turn the gizmo with the handle.",
        menu="&Handle",
        checkable=True,
        breaks=True,
    ),
    A("timeline.play", "&Play", ("Space",), "play", "Show frame after frame.", "keys", "A&nimation", checkable=True),
    A(
        "timeline.set_key",
        "Set &key",
        ("Ctrl+K",),
        "key",
        "Keep the poses of all handles at this frame.",
        "handles",
        "A&nimation",
        breaks=True,
    ),
    A("timeline.delete_key", "&Delete key", ("Ctrl+Alt+K",), "", "Forget the key at this frame.", "key", "A&nimation"),
    A(
        "timeline.next_key",
        "&Next key",
        ("Ctrl+Shift+Right",),
        "",
        "Go to the next key.",
        "keys",
        "A&nimation",
        breaks=True,
    ),
    A(
        "timeline.previous_key",
        "P&revious key",
        ("Ctrl+Shift+Left",),
        "",
        "Go to the key before.",
        "keys",
        "A&nimation",
    ),
    A("timeline.next_frame", "Next &frame", ("Ctrl+Right",), "", "Go one frame on.", "scene", "A&nimation"),
    A("timeline.previous_frame", "Previous fra&me", ("Ctrl+Left",), "", "Go one frame back.", "scene", "A&nimation"),
    A(
        "timeline.smooth",
        "&Smooth between keys",
        (),
        "",
        "Move through the keys without corners; otherwise straight from one to the next.",
        "scene",
        "A&nimation",
        checkable=True,
        breaks=True,
    ),
    A(
        "timeline.auto_key",
        "&Automatic keys",
        (),
        "",
        "Once there is a key, posing a handle sets one.",
        "scene",
        "A&nimation",
        checkable=True,
    ),
    A(
        "timeline.export",
        "&Export frames…",
        ("Ctrl+Shift+E",),
        "",
        "Write a PLY or a picture for each frame, or pictures all round.",
        "scene",
        "A&nimation",
        breaks=True,
    ),
    A(
        "display.ellipses",
        "&Ellipses",
        ("1",),
        "ellipses",
        "Draw the exact occupied ellipses.",
        menu="&View",
        group="mode",
        checkable=True,
    ),
    A(
        "display.splats",
        "&Splats",
        ("2",),
        "splats",
        "Draw the true, blended Gaussians.",
        menu="&View",
        group="mode",
        checkable=True,
    ),
    A("display.points", "&Points", ("3",), "points", "Draw centres only.", menu="&View", group="mode", checkable=True),
    A(
        "display.deformed",
        "&Deformed",
        (),
        "",
        "Show the edit.",
        menu="&View/S&how",
        group="shown",
        checkable=True,
        breaks=True,
    ),
    A(
        "display.original",
        "&Original",
        (),
        "",
        "Show the file as it is.",
        menu="&View/S&how",
        group="shown",
        checkable=True,
    ),
    A(
        "display.both",
        "&Both",
        (),
        "",
        "Show the edit over a ghost of the original.",
        menu="&View/S&how",
        group="shown",
        checkable=True,
    ),
    A(
        "display.weights",
        "Show &weights",
        ("Shift+W",),
        "",
        "Show how much each splat follows the chosen handle (bounded biharmonic weights).",
        "weights",
        "&View",
        checkable=True,
    ),
    A(
        "view.frame_selection",
        "&Frame selection",
        ("F", "Num+."),
        "frame",
        "Fly to the selection, else to the chosen handles.",
        "scene",
        "&View",
        breaks=True,
    ),
    A("view.frame_all", "Frame &all", ("Home",), "", "Fly to where everything is in view.", "scene", "&View"),
    A("view.front", "F&ront", ("Alt+1", "Num+1"), "", "Look along +Y.", "scene", "&View/A&xis"),
    A("view.back", "&Back", ("Alt+Ctrl+1", "Ctrl+Num+1"), "", "Look along −Y.", "scene", "&View/A&xis"),
    A("view.right", "R&ight", ("Alt+3", "Num+3"), "", "Look along −X.", "scene", "&View/A&xis"),
    A("view.left", "&Left", ("Alt+Ctrl+3", "Ctrl+Num+3"), "", "Look along +X.", "scene", "&View/A&xis"),
    A("view.top", "&Top", ("Alt+7", "Num+7"), "", "Look down.", "scene", "&View/A&xis"),
    A("view.bottom", "Botto&m", ("Alt+Ctrl+7", "Ctrl+Num+7"), "", "Look up.", "scene", "&View/A&xis"),
    A(
        "view.orthographic",
        "Ortho&graphic",
        ("Alt+5", "Num+5"),
        "perspective",
        "No perspective.",
        menu="&View",
        checkable=True,
    ),
    A(
        "view.turntable",
        "&Turntable",
        (),
        "turntable",
        "Keep the horizon level while orbiting.",
        menu="&View",
        checkable=True,
    ),
    A("view.up_z", "&Z up", (), "", "Turn about Z.", "scene", "&View/&Up", group="up", checkable=True),
    A("view.up_y", "&Y up", (), "", "Turn about Y.", "scene", "&View/&Up", group="up", checkable=True),
    A("view.down_y", "Y &down", (), "", "Turn about Y, upside down.", "scene", "&View/&Up", group="up", checkable=True),
    A(
        "timeline.show",
        "Time&line",
        ("Ctrl+T",),
        "",
        "Show or hide the frames under the picture.",
        menu="&View",
        checkable=True,
        breaks=True,
    ),
    A("view.panels", "Panel&s", ("N",), "panel", "Show or hide the panels.", menu="&View", checkable=True),
    A("view.full_screen", "F&ull screen", ("F11",), "", "Fill the screen.", menu="&View", checkable=True),
    A(
        "tool.select",
        "&Select",
        ("Q",),
        "select",
        "Click splats or drag a rectangle.",
        menu="&Tools",
        group="tool",
        checkable=True,
    ),
    A(
        "tool.lasso",
        "&Lasso",
        ("K",),
        "lasso",
        "Draw round splats to select them.",
        menu="&Tools",
        group="tool",
        checkable=True,
    ),
    A(
        "tool.brush",
        "&Brush",
        ("C",),
        "brush",
        "Paint a selection; [ and ] change the size.",
        menu="&Tools",
        group="tool",
        checkable=True,
    ),
    A(
        "tool.handle",
        "&Handle",
        ("W",),
        "handle",
        "Click the surface to place a handle; the wheel with Ctrl, or [ and ], change its reach.",
        menu="&Tools",
        group="tool",
        checkable=True,
    ),
    A(
        "tool.pin",
        "&Pin",
        ("E",),
        "pin",
        "Click the surface to hold it in place.",
        menu="&Tools",
        group="tool",
        checkable=True,
    ),
    A(
        "tool.inspect",
        "&Inspect",
        ("I",),
        "inspect",
        "Click a splat to see its card and its neighbours, or the line between two.",
        menu="&Tools",
        group="tool",
        checkable=True,
    ),
    A("help.sheet", "&Keys and gestures", ("F1",), "help", "Everything the mouse and keyboard do.", menu="&Help"),
    A("help.about", "&About SpLap Editor", (), "", "Version, licence and the paper.", menu="&Help"),
)

MENUS = ("&File", "&Edit", "&Select", "&Handle", "A&nimation", "&Tools", "&View", "&Help")
