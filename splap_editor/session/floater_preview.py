"""Floaters of the scene on screen before they are removed: which groups there are, and which of them stay."""

import numpy as np

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Progress
from splap_editor.engine.removal import Removal
from splap_editor.session.floater_search import FloaterSearch, FoundFloaters, floater_search
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.side_by_side import side_by_side
from splap_editor.session.signals import Signal

AHEAD_SPLATS = 200_000
"""In a scene of so many splats or more they are looked for as soon as it is open: nobody waits for them then."""


class FloaterPreview:
    """Looks for floaters in the background, and puts them in groups there. It changes nothing of the edit.

    `changed` tells of other floaters or groups that stay, `told` (stage, share) how far the search is while it is
    awaited, `failed` (error) that it came to nothing.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        self.changed = Signal()
        self.told = Signal()
        self.failed = Signal()
        self.found: FoundFloaters | None = None
        self._session = session
        self._search: FloaterSearch | None = None
        self._strength: float | None = None
        self._kept: FileMask | None = None
        self._searches = LatestJob(session.search_worker, "floaters", cancels=True, failed=self.failed.emit)
        self._groups = LatestJob(session.search_worker, "floater groups", failed=self.failed.emit)
        SceneFollower(session, self._on_scene_changed, removed_changed=self._forget)

    @property
    def is_shown(self) -> bool:
        """Whether somebody wants to see them."""
        return self._strength is not None

    @property
    def is_looking(self) -> bool:
        """Whether a search is under way, wanted or not."""
        return self._searches.is_busy

    @property
    def search(self) -> FloaterSearch | None:
        """What was found of the scene as it is; None: it has not been looked through."""
        return self._search

    def show(self, strength: float) -> None:
        """Find what floats at a strength in what is left of the scene."""
        self._strength = strength
        if self._search is not None:
            self._group(self._search, strength)
        elif self._searches.wanted is not self._session.shown_scene.edit.removal:
            self._look()

    def hide(self) -> None:
        """Let go of groups, and of a search that is under way unless it was begun ahead."""
        self._strength = self.found = self._kept = None
        self._groups.drop()
        if not self._is_ahead:
            self._searches.drop()
        self.changed.emit()

    def keeps(self, group: int) -> bool:
        """Whether a group stays."""
        assert self.found is not None
        return self._kept is not None and bool(self._kept[self.found.rows_of(group)].all())

    def keep(self, group: int, on: bool) -> None:
        """Have a group stay, or go after all. Its splats stay at other strengths too."""
        assert self.found is not None
        kept = np.zeros(self.found.n_splats, bool) if self._kept is None else self._kept.copy()
        kept[self.found.rows_of(group)] = on
        self._kept = kept
        self.changed.emit()

    @property
    def goes(self) -> FileMask:
        """(N,) which splats are to be removed."""
        assert self.found is not None
        return self.found.mask if self._kept is None else self.found.mask & ~self._kept

    @property
    def removal(self) -> Removal:
        """The scene's removal once those that go are gone."""
        assert self._search is not None and self.found is not None
        return self._search.removal(self.found, self._kept)

    @property
    def _is_ahead(self) -> bool:
        scene = self._session.scene
        return scene is not None and scene.splats.n_splats >= AHEAD_SPLATS and scene.edit.removed is None

    def _on_scene_changed(self) -> None:
        self._forget()
        if self._is_ahead:
            self._look()

    def _forget(self) -> None:
        """Drop what was found: other splats are left, or it is another scene."""
        self._searches.drop()
        self._search = None
        self.hide()

    def _look(self) -> None:
        scene = self._session.shown_scene
        splats, removal, ellipses = scene.splats, scene.edit.removal, scene.visible

        def make(job: Job) -> FloaterSearch:
            def stages(stage: str) -> Progress:
                def progress(share: float) -> None:
                    job.report(share)
                    job.deliver(lambda: self._tell(stage, share))

                return progress

            return floater_search(splats, removal, ellipses, stages=stages, run=side_by_side(self._session.n_threads))

        self._searches.ask(make, lambda search: self._take(scene, search), wanted=removal)

    def _take(self, scene: Scene, search: FloaterSearch) -> None:
        if self._session.scene is scene and scene.edit.removal is search.before:
            self._search = search
            if self._strength is not None:
                self._group(search, self._strength)

    def _group(self, search: FloaterSearch, strength: float) -> None:
        def take(found: FoundFloaters) -> None:
            if search is self._search and self.is_shown:
                self.found = found
                self.changed.emit()

        self._groups.ask(lambda job: search.found(strength), take)

    def _tell(self, stage: str, share: float) -> None:
        if self.is_shown:
            self.told.emit(stage, share)
