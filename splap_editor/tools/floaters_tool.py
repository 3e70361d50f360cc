"""Finding what floats about the subject: one strength, what goes tinted, Return takes it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from splap_editor.core.options import option
from splap_editor.core.progress import Progress
from splap_editor.session.floater_search import FloaterSearch, FoundFloaters, floater_search
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.tools.bindings import Binding
from splap_editor.tools.crop_tool import GOES_TINT
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext


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
    """Looks for floaters once it is in use; the strength changes what is tinted at once."""

    name = "floaters"
    # A handle's gizmo would take the clicks that look at a group.
    mutes_gizmo = True
    option_kinds: ClassVar[tuple[type, ...]] = (FloaterOptions,)

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.search: FloaterSearch | None = None
        self.found: FoundFloaters | None = None
        self._at = -1
        self._is_asked = False
        self._strength = context.held(FloaterOptions)
        self._strength.changed.connect(self._show)
        self._job = LatestJob(context.session.detail_worker, self.name, cancels=True, failed=self._on_failed)
        SceneFollower(context.session, self.drop, removed_changed=self.drop)

    def ask(self) -> None:
        """Look for floaters among what is left."""
        session = self.context.session
        scene = session.shown_scene
        splats, removal = scene.splats, scene.edit.removal
        self._is_asked = True
        self.context.hud.show(text="Looking for floaters …")

        def make(job: Job) -> FloaterSearch:
            def stages(stage: str) -> Progress:
                def progress(share: float) -> None:
                    job.report(share, stage)
                    job.deliver(lambda: self._tell(stage, share))

                return progress

            return floater_search(splats, removal, stages=stages)

        def take(search: FloaterSearch) -> None:
            if session.scene is scene and scene.edit.removal is removal and self._is_asked:
                self.search = search
                self._show()

        self._job.ask(make, take)

    def drop(self) -> None:
        """Show no floaters."""
        self._job.drop()
        had, self.search, self.found = self._is_asked, None, None
        self._is_asked = False
        if had:
            self.context.paint(None)
            self.context.hud.show()

    def cancel(self) -> None:
        """Show no floaters."""
        super().cancel()
        self.drop()

    def taken_up(self) -> None:
        """Begin to look, wherever the pointer is."""
        if self.context.session.scene is not None:
            self.ask()

    def hover(self, event: PointerEvent) -> bool:
        """Look among what has come since."""
        if not self._is_asked:
            self.ask()
        return False

    def frame(self, event: PointerEvent) -> bool:
        """Look at the group under the pointer."""
        hit = self.context.viewport.pick(*event.xy)
        label = None if self.found is None or hit is None else self.found.group_of(hit.row)
        if label is not None:
            self._look_at(label)
        return True

    def step(self, event: KeyEvent) -> bool:
        """Look at the group before, or the next one; the largest first."""
        found = self.found
        if found is None or not len(found.rows):
            return False
        groups = found.groups
        self._at += 1 if event.key == "BracketRight" else -1
        self._look_at(int(groups[self._at % len(groups)]))
        return True

    def take(self, event: KeyEvent) -> bool:
        """Remove them: one step of the history, kept as the strength and not as rows."""
        if self.search is None:
            return self._is_asked
        removal = self.search.removal(self._strength.value.strength)
        try:
            # Other splats removed: `drop` follows, and the next move looks among what is left.
            self.context.session.steps.change_removal(removal, "Remove floaters")
        except ValueError as error:
            self.context.hud.show(text=f"Nothing was removed: {error}")
        return True

    def _look_at(self, label: int) -> None:
        assert self.found is not None
        self.context.fly_to(self.context.viewport.frame(self.found.rows_of(label)))

    def _tell(self, stage: str, share: float) -> None:
        if self._is_asked:
            words = "weighing what is known of each" if stage == "floaters" else "seeing which splats make the picture"
            self.context.hud.show(text=f"Looking for floaters – {words}, {share:.0%}")

    def _on_failed(self, error: Exception) -> None:
        self.context.hud.show(text=str(error))

    def _show(self) -> None:
        if self.search is None:
            return
        self.found, self._at = self.search.found(self._strength.value.strength), -1
        tints = np.zeros((self.found.n_splats, 4), np.uint8)
        tints[self.found.rows] = GOES_TINT
        self.context.paint(tints)
        n, k = len(self.found.rows), len(self.found.groups)
        share = n / max(int(np.count_nonzero(~self.context.session.shown_scene.removed)), 1)
        groups = f"({share:.1%}) in {k:,} group{'' if k == 1 else 's'} · Return removes, [ ] look at each"
        self.context.hud.show(text=f"{n:,} splats float {groups}" if n else "Nothing floats at this strength")
        self.context.viewport.request_render()

    bindings = (
        Binding(("Click",), frame, "Look at the floaters under the pointer", "look at a group"),
        Binding(("[", "]"), step, "Look at the group of floaters before, or the next", "groups"),
        Binding(("Return", "Enter"), take, "Remove the floaters that are tinted", "remove"),
    )
