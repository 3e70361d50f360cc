"""The graph as it would be with other options, made in the background."""

from splap_editor.core.graph.options import GraphOptions, edges_only
from splap_editor.core.graph.splat_graph import SplatGraph, mended_graph, splat_graph
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.engine.strokes import stroke_mends
from splap_editor.engine.surface_stages import unmended
from splap_editor.session.jobs import REPORT_SECONDS, Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.side_by_side import alone
from splap_editor.session.signals import Signal


class GraphPreview:
    """Makes one graph at a time; a newer request cancels the one that is being made.

    `changed` tells of a new graph, of progress, and that there is none.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        self.changed = Signal()
        self.wanted: GraphOptions | None = None
        self.graph: SplatGraph | None = None
        self.share = 0.0
        self.error = ""
        self._session = session
        self._job = LatestJob(session.detail_worker, "preview", cancels=True, failed=self._on_failed)
        self._ellipses: Ellipses | None = None
        SceneFollower(session, self.clear, surface_changed=self._on_surface_changed)

    @property
    def is_busy(self) -> bool:
        """Whether the graph that is wanted is not there yet."""
        return self.wanted is not None and self.graph is None and not self.error

    def ask(self, options: GraphOptions) -> None:
        """Want the graph with these options; those of what is made from it do not matter."""
        scene = self._session.scene
        options = edges_only(options)
        if scene is None or (options == self.wanted and not self.error):
            return
        self.wanted, self.graph, self.share, self.error = options, None, 0.0, ""
        surface, ellipses, deliver = scene.surface, scene.ellipses, self._take_share
        self._ellipses = ellipses
        if surface is not None and edges_only(surface.options) == options:
            self._job.drop()
            self._take(options, surface.graph)
            return

        def make(job: Job) -> SplatGraph:
            told = [0.0]

            def progress(share: float) -> None:
                job.report(share)
                if share - told[0] > REPORT_SECONDS:
                    told[0] = share
                    job.deliver(lambda: deliver(options, share))

            with alone(job.report):
                plain = splat_graph(ellipses, unmended(options), progress=progress)
                mends = stroke_mends(ellipses, plain, options)
                return mended_graph(ellipses, plain, mends) if mends.cut or mends.add else plain

        self._job.ask(make, lambda graph: self._take(options, graph))
        self.changed.emit()

    def clear(self) -> None:
        """Want no graph."""
        self._job.drop()
        self.wanted, self.graph, self.error = None, None, ""
        self.changed.emit()

    def _on_surface_changed(self) -> None:
        # Its nodes are those of the ellipses it was made of: other carriers are other nodes.
        scene = self._session.scene
        if self.wanted is not None and scene is not None and scene.ellipses is not self._ellipses:
            self.clear()

    def _take(self, options: GraphOptions, graph: SplatGraph) -> None:
        if options == self.wanted:
            self.graph = graph
            self.changed.emit()

    def _take_share(self, options: GraphOptions, share: float) -> None:
        if options == self.wanted:
            self.share = share
            self.changed.emit()

    def _on_failed(self, error: Exception) -> None:
        self.error = str(error)
        self.changed.emit()
