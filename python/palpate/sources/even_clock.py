"""Times of a board that prints them with few decimals: the even times that they came from."""

from palpate.importers.rounded_times import COARSE

_FEWEST = 8  # pairs that show the period
_USUAL_NS = 5 * 10**6  # a coarse step, as long as the period is unknown


class EvenClock:
    """Replaces rounded times by even ones, line by line.

    Each is a period after the one before, as near to it as half a step of the print allows.

    Attributes
    ----------
    is_smoothing : bool
        Whether the last time was replaced: the step is not small against the period.
    step_ns : int
        Step of the times; 0: unknown.
    """

    def __init__(self) -> None:
        self.is_smoothing = False
        self.step_ns = 0
        self._begun_ns = 0
        self._periods = 0  # since then
        self._rounded_ns = 0  # the last time
        self._even_ns = 0.0
        self._apart_ns = 0.0  # mean time from the hard to the soft channel
        self._pairs = 0

    def may_be_equal(self, step_ns: int) -> bool:
        """Return whether two times in a row may be equal; `step_ns`: size of the last digit."""
        if self._pairs < _FEWEST:
            return step_ns >= _USUAL_NS
        return 2 * step_ns > self._period_ns()

    def place(self, rounded_ns: int, apart_ns: int, step_ns: int) -> tuple[int, int]:
        """Return the time of the hard channel, ns, and the time from there to the soft channel."""
        if step_ns:
            self.step_ns = min(step_ns, self.step_ns or step_ns)
        if self._pairs == 0 or rounded_ns < self._rounded_ns:
            return self._begin(rounded_ns, apart_ns)
        self._pairs += 1
        self._apart_ns += (apart_ns - self._apart_ns) / self._pairs
        # Missing pairs: as few as the steps allow.
        half_ns = self.step_ns / 2
        period_ns = self._period_ns()
        periods = 1
        if period_ns:
            periods = max(1, round((rounded_ns - half_ns - self._even_ns) / period_ns))
        self._rounded_ns = rounded_ns
        self._periods += periods
        period_ns = (rounded_ns - self._begun_ns) / self._periods
        self.is_smoothing = self._pairs > _FEWEST and self.step_ns > COARSE * period_ns
        if not self.is_smoothing:
            self._even_ns = rounded_ns
            return rounded_ns, apart_ns
        even_ns = self._even_ns + periods * period_ns
        nearest_ns = min(max(even_ns, rounded_ns - half_ns), rounded_ns + half_ns)
        self._even_ns = max(nearest_ns, self._even_ns + 1)
        return round(self._even_ns), round(self._apart_ns)

    def _period_ns(self) -> float:
        if not self._periods:
            return 0.0
        return (self._rounded_ns - self._begun_ns) / self._periods

    def _begin(self, rounded_ns: int, apart_ns: int) -> tuple[int, int]:
        self.is_smoothing = False
        self._begun_ns = rounded_ns
        self._rounded_ns = rounded_ns
        self._even_ns = rounded_ns
        self._apart_ns = apart_ns
        self._periods = 0
        self._pairs = 1
        return rounded_ns, apart_ns
