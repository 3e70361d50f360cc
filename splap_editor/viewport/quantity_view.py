"""A quantity shown in colours, worked out in the background and kept up with the pose."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask, FileRow
from splap_editor.engine.quantities import QUANTITIES, Quantity, Snapshot, missing, values_of
from splap_editor.session.bound_edit import snapshot_of
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.viewport.colormaps import TWO_SIDED, label_colors, mapped_colors, shares
from splap_editor.viewport.scene_view import SceneView

PAINT_SHARE = 235
"""How much of a splat's own colour the quantity's hides, of 255."""

N_BINS = 96


@dataclass(frozen=True)
class QuantityOptions:
    """How a quantity is shown.

    Parameters
    ----------
    name : str
        Key of `QUANTITIES`; empty: none is shown.
    colormap : str
        Key of `COLORMAPS`.
    is_log : bool
        Equal ratios take equal shares of the map.
    low, high : float, optional
        Ends of the map; None leaves them to the values, but for a hundredth at either end.
    """

    name: str = ""
    colormap: str = "viridis"
    is_log: bool = False
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, eq=False)
class ShownQuantity:
    """A quantity with everything that is drawn of it.

    Parameters
    ----------
    quantity : Quantity
    options : QuantityOptions
    values : (N,) float64
        NaN where undefined.
    low, high : float
        Ends of the colour map.
    edges : (B + 1,) float64
        Limits of the histogram's bins, ascending; equal ratios apart on a logarithmic scale.
    counts : (B,) int64
        Splats in each.
    tints : (N, 4) uint8
    """

    quantity: Quantity
    options: QuantityOptions
    values: NDArray[np.float64]
    low: float
    high: float
    edges: NDArray[np.float64]
    counts: NDArray[np.int64]
    tints: NDArray[np.uint8]

    @property
    def is_log(self) -> bool:
        """Whether the scale is logarithmic."""
        return self.options.is_log and not self.quantity.is_label

    def colors(self, values: NDArray[np.float64]) -> NDArray[np.uint8]:
        """(K, 3) uint8 colours of any values (K,)."""
        if self.quantity.is_label:
            return label_colors(values)
        return mapped_colors(shares(values, self.low, self.high, is_log=self.is_log), self.options.colormap)

    def within(self, low: float, high: float) -> FileMask:
        """(N,) which splats have a value from ``low`` to ``high``, both included."""
        return (self.values >= low) & (self.values <= high)


def shown_quantity(options: QuantityOptions, snapshot: Snapshot) -> ShownQuantity:
    """Work out a quantity, its range, histogram and colours; for the worker."""
    quantity = QUANTITIES[options.name]
    values = values_of(quantity, snapshot)
    known = values[np.isfinite(values)]
    is_log = options.is_log and not quantity.is_label
    counted = known[known > 0.0] if is_log else known
    low, high = _range(quantity, options, counted)
    edges = _bins(quantity, counted, is_log)
    counts = np.histogram(counted, edges)[0]
    shown = ShownQuantity(quantity, options, values, low, high, edges, counts, np.empty((0, 4), np.uint8))
    tints = np.column_stack([shown.colors(values), np.full(len(values), PAINT_SHARE, np.uint8)])
    return replace(shown, tints=tints)


def _range(quantity: Quantity, options: QuantityOptions, known: NDArray[np.float64]) -> tuple[float, float]:
    low, high = (float(v) for v in np.quantile(known, (0.01, 0.99))) if known.size else (0.0, 1.0)
    if not high > low and known.size:
        low, high = float(known.min()), float(known.max())
    if quantity.middle is not None and options.colormap == TWO_SIDED:
        half = max(high - quantity.middle, quantity.middle - low, 1e-6)
        low, high = quantity.middle - half, quantity.middle + half
        if options.is_log:
            low = quantity.middle**2 / high
    low = low if options.low is None else options.low
    high = high if options.high is None else options.high
    tiny = np.finfo(np.float64).tiny
    return (max(low, tiny), max(high, tiny)) if options.is_log else (low, high)


def _bins(quantity: Quantity, known: NDArray[np.float64], is_log: bool) -> NDArray[np.float64]:
    low, high = (float(known.min()), float(known.max())) if known.size else (1.0, 1.0)
    if quantity.is_whole and not is_log and high - low < N_BINS:
        return np.arange(low - 0.5, high + 1.0)
    if not high > low:
        low, high = (low / 1.01, low * 1.01) if is_log else (low - 0.5, low + 0.5)
    if is_log:
        edges = np.geomspace(low, high, N_BINS + 1)
    else:
        edges = np.linspace(low, high, N_BINS + 1)
    edges[0], edges[-1] = low, high
    return edges


class QuantityView:
    """Paints the chosen quantity over the splats.

    `changed` tells that another one, or none, or newer values are shown.

    Parameters
    ----------
    session : Session
        Followed: pose, surface, handles and the picked splat.
    view : SceneView
        What is painted.
    """

    def __init__(self, session: Session, view: SceneView) -> None:
        self.changed = Signal()
        self.options = QuantityOptions()
        self.shown: ShownQuantity | None = None
        self.lack = ""
        self._session = session
        self._view = view
        self._job = LatestJob(session.detail_worker, "quantity", failed=self._on_failed)
        SceneFollower(
            session,
            self._on_scene_changed,
            pose_changed=self._ask,
            surface_changed=self._ask,
            picked_changed=self._ask,
            active_handles_changed=self._ask,
        )
        session.state_changed.connect(self._on_state_changed)

    def set(self, **values: Any) -> None:
        """Change some options. Another quantity starts with a range of its own, and with the map that suits it."""
        before = self.options
        options = replace(before, **values)
        if options.name != before.name and options.name:
            is_two_sided = QUANTITIES[options.name].middle is not None
            if is_two_sided != (options.colormap == TWO_SIDED) and "colormap" not in values:
                options = replace(options, colormap=TWO_SIDED if is_two_sided else "viridis")
            options = replace(options, low=values.get("low"), high=values.get("high"))
        if options != before:
            self.options = options
            self._ask()

    def value_text(self, row: FileRow | None) -> str:
        """The quantity of a splat in words; empty when none is shown."""
        if self.shown is None or row is None:
            return ""
        return f"{self.shown.quantity.label}: {value_text(self.shown.quantity, float(self.shown.values[row]))}"

    def _on_scene_changed(self) -> None:
        self._take(None)
        self._ask()

    def _on_state_changed(self) -> None:
        if self.options.name and QUANTITIES[self.options.name].needs in ("handles", "weights"):
            self._ask()

    def _ask(self) -> None:
        scene, options = self._session.scene, self.options
        if scene is None:
            return
        snapshot = snapshot_of(scene, self._session.bound)
        lack = missing(QUANTITIES[options.name], snapshot) if options.name else ""
        if not options.name or lack:
            self._job.drop()
            self._take(None, lack)
            return

        def made(job: Job) -> ShownQuantity:
            return shown_quantity(options, snapshot)

        def done(shown: ShownQuantity) -> None:
            if self._session.scene is scene and self.options.name == options.name:
                self._take(shown)

        self._job.ask(made, done)

    def _take(self, shown: ShownQuantity | None, lack: str = "") -> None:
        if shown is not None or self.shown is not None:
            self._view.paint(None if shown is None else shown.tints, "quantity")
        self.shown, self.lack = shown, lack
        self.changed.emit()

    def _on_failed(self, error: Exception) -> None:
        self._take(None, str(error))


def value_text(quantity: Quantity, value: float) -> str:
    """Write a value with its unit."""
    if np.isnan(value):
        return "not defined"
    if quantity.labels:
        return quantity.labels[int(value)]
    if quantity.is_whole:
        return f"{value:,.0f}"
    unit = {"length": "", "°": "°", "×": " ×"}.get(quantity.unit, "")
    return f"{value:.4g}{unit}"
