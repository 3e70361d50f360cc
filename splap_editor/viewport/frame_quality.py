"""How much of the picture is drawn so that it keeps moving: fewer pixels first, then fewer splats."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.viewport.contribution import Contribution

COARSENESSES = (1, 2, 3, 4, 6)
MOST_COARSE = 3
"""Logical pixels that are drawn as one at the most."""
SHARE_STEP = 2.0**-0.5
KEPT_QUALITIES = 6
"""Frames of so many different qualities are remembered: older ones were of another view."""

_PRIOR = np.array([0.2, 0.5, 1.0])


@dataclass(frozen=True)
class FrameQuality:
    """What one frame draws.

    Parameters
    ----------
    n_drawn : int
        Number of splats, those that give most.
    coarseness : int
        Width and height of a drawn pixel in pixels of the screen.
    """

    n_drawn: int
    coarseness: int = 1


class QualityChooser:
    """Chooses what a frame draws from measured frame times.

    A frame costs something at all, something per splat, and something per
    pixel covered, told apart by frames of different quality. The pixels are
    made larger first, up to a third of the screen's, then splats are left
    out, those first that give least, as long as that buys time; a machine
    that draws all in time never sees anything of this.

    Parameters
    ----------
    target_s : float
        Longest frame wanted while something moves.
    least_drawn : int
        So many splats are always drawn; with fewer an object is not to be recognised.
    scale : float
        Device pixels per logical pixel: of finer ones more may be drawn as one.
    """

    def __init__(self, target_s: float = 0.05, least_drawn: int = 20_000, *, scale: float = 1.0):
        self.target_s = target_s
        self.least_drawn = least_drawn
        self.scale = scale
        self._frames: dict[FrameQuality, deque[float]] = {}
        self._last: FrameQuality | None = None

    def note(self, seconds: float, drawn: FrameQuality) -> None:
        """Take in the time of one frame."""
        frames = self._frames.pop(drawn, deque(maxlen=3))
        frames.append(seconds)
        self._frames[drawn] = frames  # the newest quality comes last
        while len(self._frames) > KEPT_QUALITIES:
            del self._frames[next(iter(self._frames))]

    def forget(self) -> None:
        """Another scene or another look is drawn from here on."""
        self._frames.clear()
        self._last = None

    def choose(self, order: Contribution, patience: float = 1.0) -> FrameQuality:
        """Best quality whose frame is expected to take no longer than so many times the target.

        Frames in a row become finer by one step at a time, and only where
        that would leave a quarter of the time to spare, so that the picture
        does not flicker.
        """
        n = len(order.rows)
        if not self._frames:
            return FrameQuality(n)
        qualities = self._qualities(n)
        expected = self._expected(order)
        alone = expected(FrameQuality(0))
        # Where a frame takes too long whatever it draws, a quarter more is as good as it gets.
        budget = max(patience * self.target_s, 1.25 * alone)

        def best(share: float) -> int:
            limit = alone + share * (budget - alone)
            fits = (
                i for i, each in enumerate(qualities) if expected(each) <= limit or self._most(each) <= 0.95 * budget
            )
            return next(fits, len(qualities) - 1)

        if self._last not in qualities:
            chosen = best(1.0)
        else:
            chosen = qualities.index(self._last)
            if expected(self._last) > budget:
                chosen = best(0.9)
            else:
                finer = best(0.75)
                if self._most(qualities[finer]) > budget and patience == 1.0:
                    finer = max(finer, chosen - 2)
                chosen = min(chosen, finer)
        self._last = qualities[chosen]
        return self._last

    def _qualities(self, n: int) -> list[FrameQuality]:
        """What may be drawn, from the best to the coarsest."""
        coarsenesses = [each for each in COARSENESSES if each <= MOST_COARSE * max(self.scale, 1.0)]
        whole = [FrameQuality(n, coarseness) for coarseness in coarsenesses]
        fewer, share = [], SHARE_STEP
        while n * share >= self.least_drawn:
            fewer += [FrameQuality(round(n * share), coarseness) for coarseness in coarsenesses[1:]]
            share *= SHARE_STEP
        return whole + fewer

    def _expected(self, order: Contribution) -> Callable[[FrameQuality], float]:
        """Seconds that a frame of some quality is expected to take."""
        # A first frame compiles shaders and uploads what others find there.
        known = {quality: min(seconds) for quality, seconds in self._frames.items() if len(seconds) > 1}
        cheapest = {quality: min(seconds) for quality, seconds in self._frames.items()}
        costs = _costs(known if len(known) > 1 else cheapest, order)

        def expected(quality: FrameQuality) -> float:
            seconds = cheapest.get(quality)
            return min(float(costs @ _work(quality, order)) if seconds is None else seconds, self._most(quality))

        return expected

    def _most(self, quality: FrameQuality) -> float:
        """Seconds that a frame can take, by those measured: no part grows faster than splats times pixels.

        Frames much cheaper than expected show so that what was dear before no longer is.
        """
        return min(
            min(seconds)
            * max(quality.n_drawn / max(drawn.n_drawn, 1), 1.0)
            * max(drawn.coarseness / quality.coarseness, 1.0) ** 2
            for drawn, seconds in self._frames.items()
        )


def _work(quality: FrameQuality, order: Contribution) -> NDArray[np.float64]:
    """(3,) a frame at all, its splats, its covered pixels; the latter as shares of those of the full picture."""
    splats = quality.n_drawn / max(len(order.rows), 1)
    return np.array([1.0, splats, order.share(quality.n_drawn) / quality.coarseness**2])


def _costs(seconds: dict[FrameQuality, float], order: Contribution) -> NDArray[np.float64]:
    """(3,) seconds of a frame at all, of all its splats and of all its pixels, fitted to frames; none negative."""
    times = np.array(list(seconds.values()))
    # Relative errors count. What few frames cannot tell apart the shortest solution shares out, most of it to
    # pixels and hardly any to the frame as such.
    work = np.array([_work(quality, order) for quality in seconds]) / times[:, None] * _PRIOR
    costs = np.zeros(3)
    parts = np.arange(3)
    while len(parts):
        costs[parts] = np.linalg.lstsq(work[:, parts], np.ones(len(times)), rcond=None)[0]
        if (costs[parts] >= 0.0).all():
            break
        costs[parts[costs[parts] < 0.0]] = 0.0
        parts = np.flatnonzero(costs)
    return costs * _PRIOR
