"""When a conversion was, with bounds, from what the computer saw of it: pure functions of times, without a chip.

The computer knows times around its own calls only, and may be stopped for a while anywhere between them. So each
statement here is an interval that holds however long it was stopped, and nothing is assumed about the bus.
"""

from typing import NamedTuple

from palpate.errors import ProtocolError

# Duration of a conversion before one was seen, relative to the data sheet's, at least: the chip's clock is +-5 %.
_SHORTEST = 0.9
# If no poll found a conversion running, the polls may have begun too late: the next ones begin so much earlier.
_UNSEEN_NS = 500_000
# A conversion is overdue after this multiple of the data sheet's duration (about 2 with CAPCHOP) and this time.
_OVERDUE, _OVERDUE_NS = 2.5, 20_000_000
# Change of the chip's clock from one conversion to the next, relative, at most: 0.018 to 0.18 % a second.
_DRIFT = 2e-5


class Seen(NamedTuple):
    """What the computer saw of a conversion, ns: it began in [asked, begun], and ended in [busy, ended]."""

    asked: int
    begun: int
    busy: int
    ended: int


class Middle(NamedTuple):
    """Time of the middle of a conversion, ns, and how much earlier or later it may have been, ns, from 0."""

    t_ns: int
    early_ns: int = 0
    late_ns: int = 0

    @property
    def error_ns(self) -> int:
        """Largest possible error of the time, ns."""
        return max(self.early_ns, self.late_ns)


def difference_ns(first: Middle, second: Middle) -> int:
    """Return the largest possible error of the difference of two times, ns."""
    return max(first.early_ns + second.late_ns, first.late_ns + second.early_ns)


class Pace:
    """The duration of a conversion of this chip: an interval, which each conversion narrows."""

    # The chip's own clock paces it. A conversion lasted at least from its latest begin to its earliest end, and at most
    # from its earliest begin to its latest end; the duration is in the intersection of all these intervals.

    def __init__(self, nominal_s: float) -> None:
        self._nominal_ns = nominal_s * 1e9
        self.overdue_ns: int = round(_OVERDUE * self._nominal_ns) + _OVERDUE_NS  # after the begin: it must have ended
        self._forget()

    def _forget(self) -> None:
        """Know only the data sheet's duration, as before the first conversion."""
        self.shortest_ns: int = round(_SHORTEST * self._nominal_ns)
        self.longest_ns: int = self.overdue_ns

    def learn(self, seen: Seen) -> None:
        """Narrow the interval; ProtocolError: no duration fits, so it was another conversion, or those before it were."""
        drift = round(_DRIFT * self._nominal_ns)
        sooner = drift if seen.busy > seen.asked else _UNSEEN_NS
        shortest = max(self.shortest_ns - sooner, seen.busy - seen.begun)
        longest = min(self.longest_ns + drift, seen.ended - seen.asked)
        if shortest > longest:
            self._forget()
            took = f"{(seen.busy - seen.begun) / 1e6:.2f} to {(seen.ended - seen.asked) / 1e6:.2f} ms"
            before = f"{shortest / 1e6:.2f} to {longest / 1e6:.2f} ms"
            why = "another program uses the board, or the clock of the chip changed"
            raise ProtocolError(f"a conversion took {took}, those before it {before}: {why}")
        self.shortest_ns, self.longest_ns = shortest, longest

    def middle(self, seen: Seen) -> Middle:
        """Return the time of the middle of a conversion that was learned, with its bounds."""
        # With begin B, end E and duration D the middle is B + D/2 = E - D/2 = (B + E)/2: each form with the bounds of its
        # two terms is a bound of the middle, and the narrowest of the three is exact (linear programming: one of the
        # forms is the dual solution). A write normally returns as late after the begin as the shortest duration is too
        # short, in each case half of a transfer, or a little more: so the time is `begun` plus half of that, if the bounds
        # allow it.
        short, long = self.shortest_ns // 2, -(-self.longest_ns // 2)
        earliest = max(seen.asked + short, seen.busy - long, (seen.asked + seen.busy) // 2)
        latest = min(seen.begun + long, seen.ended - short, (seen.begun + seen.ended) // 2)
        t_ns = min(max(seen.begun + short, earliest), latest)
        return Middle(t_ns, t_ns - earliest, latest - t_ns)
