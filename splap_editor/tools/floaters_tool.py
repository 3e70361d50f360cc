"""Finding what floats about the subject: one strength, what goes tinted by groups, Return takes it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from splap_editor.core.index_spaces import FileRows
from splap_editor.core.options import option
from splap_editor.session.floater_preview import FloaterPreview
from splap_editor.session.floater_search import FoundFloaters
from splap_editor.session.signals import Signal
from splap_editor.tools.bindings import Binding
from splap_editor.tools.crop_tool import GOES_TINT
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext
from splap_editor.viewport.overlays import circle

_LIT_TINT = (255, 214, 64, 235)
"""Of the group that is looked at."""

_NEAR_PX = 12.0
"""A click looks for floaters no farther away than so many logical pixels."""

_LIT_COLOR = (1.0, 0.84, 0.25)
_RING = "floaters"

_ROOM = 0.08
"""So much of the scene's extent is seen about a group: a speck alone would fill the picture, and nobody knew where."""


@dataclass(frozen=True)
class FloaterOptions:
    """How readily something counts as floating.

    Parameters
    ----------
    strength : float
        In [0, 1).
    """

    strength: float = option(
        0.5,
        "How readily a splat counts as floating; 0: none does.",
        label="Strength",
        least=0.0,
        most=0.99,
        is_percent=True,
        step=0.01,
        decimals=2,
    )


class FloatersTool(Tool):
    """Looks for floaters once it is taken up; the strength changes what is tinted at once.

    `changed` tells of other groups, of others that stay, of another one that is looked at, and how far the search is.
    """

    name = "floaters"
    # A handle's gizmo would take the clicks that look at a group.
    mutes_gizmo = True
    option_kinds: ClassVar[tuple[type, ...]] = (FloaterOptions,)

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.changed = Signal()
        self.preview = FloaterPreview(context.session)
        self.looked_at: int | None = None
        self.doing = ""
        self._is_in_use = self._is_dismissed = False
        self._strength = context.held(FloaterOptions)
        self._strength.changed.connect(self._on_strength)
        self.preview.changed.connect(self._show)
        self.preview.told.connect(self._tell)
        self.preview.failed.connect(lambda error: self._say(str(error)))

    @property
    def found(self) -> FoundFloaters | None:
        """What floats, once it is known."""
        return self.preview.found

    def taken_up(self) -> None:
        """Begin to look."""
        if self.context.session.scene is not None:
            self.begin()

    def begin(self) -> None:
        """Look for floaters among what is left."""
        self._is_in_use, self._is_dismissed = True, False
        if not self.preview.is_shown:
            self.preview.show(self._strength.value.strength)
            self._say("Looking for floaters …")

    def cancel(self) -> None:
        """Show no floaters."""
        super().cancel()
        self._hide()
        self._is_in_use = self._is_dismissed = False

    def hover(self, event: PointerEvent) -> bool:
        """Begin to look, as after others were removed."""
        if not self._is_dismissed:
            self.begin()
        return False

    def frame(self, event: PointerEvent) -> bool:
        """Look at the group under the pointer."""
        if self._is_dismissed:
            self.begin()
            return True
        group = self._group_under(event.xy)
        if group is not None:
            self.look_at(group)
        return True

    def _group_under(self, xy: tuple[float, float]) -> int | None:
        """Group of the splat under a pixel, or of the floater nearest to it: haze lets what is behind it be picked."""
        found, viewport = self.found, self.context.viewport
        if found is None or not found.n_groups:
            return None
        hit = viewport.pick(*xy)
        group = None if hit is None else found.group_of(hit.row)
        if group is None:
            ways = np.linalg.norm(viewport.screen_points()[found.rows, :2] - xy, axis=1)
            # Hidden ones are nowhere.
            if np.fmin.reduce(ways) <= _NEAR_PX * viewport.quality.scale:
                group = int(found.labels[np.nanargmin(ways)])
        return group

    def step(self, event: KeyEvent) -> bool:
        """Look at the group before, or the next one; the largest first."""
        found = self.found
        if found is None or not found.n_groups:
            return False
        step = 1 if event.key == "BracketRight" else -1
        first = 0 if step > 0 else found.n_groups - 1
        self.look_at(first if self.looked_at is None else (self.looked_at + step) % found.n_groups)
        return True

    def take(self, event: KeyEvent | None = None) -> bool:
        """Remove them: one step of the history, kept as the strength and not as rows."""
        if self.found is None:
            return self.preview.is_shown
        try:
            # Other splats removed: the preview is dropped, and the next move looks among what is left.
            self.context.session.steps.change_removal(self.preview.removal, "Remove floaters")
        except ValueError as error:
            self.context.hud.show(text=f"Nothing was removed: {error}")
        return True

    def let_go(self, event: KeyEvent | None = None) -> bool:
        """Leave everything as it is, until the next click."""
        was_shown = self.preview.is_shown
        self._hide()
        self._is_dismissed = True
        return was_shown

    def look_at(self, group: int) -> None:
        """Frame a group, and set it off from the others."""
        assert self.found is not None
        self.looked_at = group
        self._show()
        self.context.fly_to(self.context.viewport.frame(self.found.rows_of(group), room=_ROOM))

    def _ring_round(self, rows: FileRows | None) -> None:
        """Ring round a group, which may be too faint or too small for its tint to be seen; None: round none."""
        rings = self.context.viewport.rings
        if rows is None:
            rings.hide(_RING)
            return
        scene = self.context.session.shown_scene
        points = np.asarray(scene.positions[rows], np.float64)
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        radius = np.linalg.norm(points - middle, axis=1).max() + 0.015 * scene.ellipses.scene_scale
        rings.show(_RING, [circle(middle, axis, radius) for axis in np.eye(3)], _LIT_COLOR, width_px=1.6)

    def _hide(self) -> None:
        if self.preview.is_shown:
            self.preview.hide()

    def _on_strength(self) -> None:
        if self.preview.is_shown:
            self.looked_at = None
            self.preview.show(self._strength.value.strength)

    def _tell(self, stage: str, share: float) -> None:
        words = {"contributions": "seeing which splats make the picture", "occupancy": "measuring splats"}
        told = words.get(stage, "weighing what is known of each")
        self._say(f"Looking for floaters – {told}, {share:.0%}")

    def _say(self, doing: str) -> None:
        """Say what is awaited, in the picture and to who listens."""
        self.doing = doing
        self.context.hud.show(text=doing)
        self.changed.emit()

    def _show(self) -> None:
        found = self.found
        if found is None:
            self.looked_at = None
            self._ring_round(None)
            if self._is_in_use and not self.preview.is_shown:
                self.context.paint(None)
                self.context.hud.show()
        else:
            goes = self.preview.goes
            tints = np.zeros((found.n_splats, 4), np.uint8)
            tints[goes] = GOES_TINT
            if self.looked_at is not None:
                tints[found.rows_of(self.looked_at)] = _LIT_TINT
            self._ring_round(None if self.looked_at is None else found.rows_of(self.looked_at))
            self.context.paint(tints)
            self.context.hud.show(text=self.words(int(np.count_nonzero(goes))))
        self.changed.emit()
        self.context.viewport.request_render()

    def words(self, n: int) -> str:
        """How many splats go, for people."""
        assert self.found is not None
        if not self.found.n_groups:
            return "Nothing floats at this strength"
        k = self.found.n_groups
        share = n / max(int(np.count_nonzero(~self.context.session.shown_scene.removed)), 1)
        groups = f"({share:.1%}), {k:,} group{'' if k == 1 else 's'} found"
        return f"{n:,} splats float {groups} · Return removes, [ ] look at each, Esc leaves"

    bindings = (
        Binding(("Click",), frame, "Look at the floaters under the pointer", "look at a group"),
        Binding(("[", "]"), step, "Look at the group of floaters before, or the next", "groups"),
        Binding(("Return", "Enter"), take, "Remove the floaters that are tinted", "remove"),
        Binding(("Esc",), let_go, "Leave the floaters", "leave"),
    )
