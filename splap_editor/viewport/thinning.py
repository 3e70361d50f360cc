"""How many splats to leave out so that the picture keeps moving."""

from collections import deque

STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
KEPT_COUNTS = 3
"""Frames of so many different counts are remembered: older ones were of another view."""


class Thinning:
    """Chooses one splat in ``k`` from measured frame times.

    A frame costs something per splat, and something for the pixels covered,
    which thinning does not change: what is left grows to cover the same. So
    both are told apart from frames of different ``k``, and splats that would
    buy no time stay in the picture.

    Parameters
    ----------
    target_s : float
        Longest frame wanted while something moves.
    least_drawn : int
        So many splats are always drawn; with fewer an object is not to be recognised.
    """

    def __init__(self, target_s: float = 0.05, least_drawn: int = 20_000):
        self.target_s = target_s
        self.least_drawn = least_drawn
        self.k = 1
        self._frames: dict[int, deque[float]] = {}

    def note(self, seconds: float, n_drawn: int) -> None:
        """Take in the time of one shown frame and the number of splats drawn in it."""
        if n_drawn > 0:
            frames = self._frames.pop(n_drawn, deque(maxlen=3))
            frames.append(seconds)
            self._frames[n_drawn] = frames  # the newest count comes last
            while len(self._frames) > KEPT_COUNTS:
                del self._frames[next(iter(self._frames))]

    def choose(self, n_splats: int) -> int:
        """Least step ``k`` whose frame is expected to meet the target, or beyond which little more is gained.

        The cheapest of the last three frames of each ``k`` counts, since a first frame compiles
        shaders; and ``k`` falls only when the finer picture would leave a
        quarter of the time to spare, so that it does not flicker.
        """
        if not self._frames:
            return self.k
        fixed, per_splat = self._costs()
        steps = [k for k in STEPS if k == 1 or n_splats >= k * self.least_drawn]

        def least(target_s: float) -> int:
            # Where the pixels alone take too long, a quarter more than they take is as good as it gets.
            limit = max(target_s - fixed, 0.25 * fixed)
            return next((k for k in steps if per_splat * n_splats / k <= limit), steps[-1])

        coarser, finer = least(0.9 * self.target_s), least(0.75 * self.target_s)
        meets = fixed + per_splat * n_splats / self.k <= self.target_s
        self.k = min(self.k, finer) if meets and self.k in steps else coarser
        return self.k

    def _costs(self) -> tuple[float, float]:
        """Seconds of a frame that do not and that do depend on the number of splats, the latter for each."""
        cheapest = {n: min(seconds) for n, seconds in self._frames.items()}
        few, many = min(cheapest), max(cheapest)
        if few == many:
            return 0.0, cheapest[many] / many
        per_splat = max((cheapest[many] - cheapest[few]) / (many - few), 0.0)
        return max(cheapest[few] - per_splat * few, 0.0), per_splat
