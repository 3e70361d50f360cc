"""How many splats to leave out so that the picture keeps moving."""

from collections import deque

STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)


class Thinning:
    """Chooses one splat in ``k`` from measured frame times.

    Parameters
    ----------
    target_s : float
        Longest frame wanted while something moves.
    """

    def __init__(self, target_s: float = 0.05):
        self.target_s = target_s
        self.k = 1
        self._costs: deque[float] = deque(maxlen=3)

    def note(self, seconds: float, n_drawn: int) -> None:
        """Take in the time of one shown frame and the number of splats drawn in it."""
        if n_drawn > 0:
            self._costs.append(seconds / n_drawn)

    def choose(self, n_splats: int) -> int:
        """Least step ``k`` whose frame is expected to meet the target.

        The cheapest of the last three frames counts, since a first frame
        compiles shaders; and ``k`` falls only when the finer picture would
        leave a quarter of the time to spare, so that it does not flicker.
        """
        if not self._costs:
            return self.k
        full = min(self._costs) * n_splats
        if full / self.k > self.target_s:
            self.k = next((k for k in STEPS if full / k <= 0.9 * self.target_s), STEPS[-1])
        else:
            self.k = min(self.k, next((k for k in STEPS if full / k <= 0.75 * self.target_s), STEPS[-1]))
        return self.k
