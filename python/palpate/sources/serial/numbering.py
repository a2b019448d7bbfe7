"""Numbers and times of the samples, from those that the device sends."""

from typing import NamedTuple

from palpate.errors import ProtocolError
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import TIMES, Values
from palpate.sources.serial.pace import Pace

_WRAPS = {"ms": 10**6 * 2**32, "us": 10**3 * 2**32}
"""ns after which a counter of 32 bits begins again."""
_AHEAD_NS = 2 * 10**9
"""The clock of a device that gets ahead of the host's by more was set anew."""
_APART_NS = 10**10
_RESTARTS = 20


class Place(NamedTuple):
    """Number and times of a pair, and why the baseline before it does not hold; empty: it does."""

    seq: int
    t_hard_ns: int
    t_soft_ns: int
    gap: str


class Numbering:
    """The numbers and the times of the samples.

    A number that does not grow, or a clock that goes back or jumps ahead, means that the board restarted. Then both go
    on from the last sample.

    Parameters
    ----------
    by_device : bool
        False: the times are those of the arrival.
    units : dict of str
        Unit of each column, by its role.

    Attributes
    ----------
    next : int
        The number of the next sample.
    lost : int
        Numbers that were left out.
    remark : str
        What to tell of the clock of the board, once; whoever has told it sets it to "".
    """

    def __init__(self, by_device: bool, units: dict[str, str]) -> None:
        self.next: int = 0
        self.lost: int = 0
        self.remark: str = ""
        of_times = [units[role] for role in TIMES if role in units]
        self._timed = by_device and bool(of_times)
        self._wrap = _WRAPS.get(of_times[0], 0) if of_times else 0
        self._pace = Pace(of_times[0] if of_times else "")
        self._ahead = False  # the clock was ahead at the last pair
        self._seq: int | None = None  # as the device counts
        self._clock_ns: int | None = None  # as the device counts
        self._arrived_ns = self._last_ns = 0
        self._capdacs: tuple[int | None, ...] | None = None
        self._restarts = 0

    def place(self, values: Values, arrived_ns: tuple[int, int], away: int = 0, why: str = "") -> Place:
        """Return number and times of a pair.

        Parameters
        ----------
        values : dict
            Of the lines of the pair.
        arrived_ns : (int, int)
            Arrival of the hard and of the soft channel.
        away : int
            Pairs that did not come while the port was away, as estimated by their rate.
        why : str
            Why the baseline does not hold, if the port knows it.

        Raises
        ------
        Refused
            Its time is that of the pair before, or the channels are more than 10 s apart.
        ProtocolError
            The board restarts with each line, or its times are not in their unit.
        """
        times, late = self._times(values, arrived_ns)
        early = self._count(values.get("seq"), away)
        self._restarts = self._restarts + 1 if late or early else 0
        if self._restarts >= _RESTARTS:
            raise ProtocolError(f"the board restarts with each line, or does not count up: {early or late}")
        gap = "; ".join(filter(None, [why, early or late, self._moved(values)]))
        self._arrived_ns, self._last_ns, self.next = arrived_ns[0], times[0], self.next + 1
        return Place(self.next - 1, *times, gap)

    def _count(self, seq: int | None, away: int) -> str:
        """Leave out the numbers of lost pairs; return why the board must have restarted."""
        before, self._seq = self._seq, seq
        restarted = seq is not None and before is not None and seq <= before
        missing = away if seq is None or restarted else 0
        if seq is not None and before is not None and not restarted:
            missing = seq - before - 1
        self.next += missing
        self.lost += missing
        return f"the board restarted: seq {seq} after {before}" if restarted else ""

    def _times(self, values: Values, arrived_ns: tuple[int, int]) -> tuple[tuple[int, int], str]:
        """Return the times of both channels, and why the board must have restarted."""
        if not self._timed:
            return arrived_ns, ""
        hard = values.get("t_hard", values.get("t"))
        soft = values.get("t_soft", hard)
        if hard is None:
            raise Refused("it has no time")
        apart = self._shortest(soft - hard)
        if abs(apart) > _APART_NS:
            raise Refused(f"its channels are {abs(apart) / 1e9:.3g} s apart; allowed: {_APART_NS / 1e9:g} s")
        before, waited = self._clock_ns, max(arrived_ns[0] - self._arrived_ns, 1)
        step = 0 if before is None else hard - before
        if before is not None and step == 0:
            raise Refused("its time is that of the pair before")
        if step < 0 and max(hard, before or 0) < self._wrap <= waited + _AHEAD_NS - step:
            step += self._wrap
        self._clock_ns = hard
        if before is None:
            first = max(arrived_ns[0], -apart)
            return (first, first + apart), ""
        self.remark = self._pace.add(step, waited) or self.remark
        late = self._jumped(step, waited)
        now = self._last_ns + (waited if self._ahead or step < 0 else step)
        return (now, now + apart), late and f"{late}: it shows {hard / 1e9:.6g} s after {before / 1e9:.6g} s"

    def _jumped(self, step: int, waited: int) -> str:
        """Return what the clock did; of pairs that are ahead one after the other only of the first."""
        before, self._ahead = self._ahead, step > waited + _AHEAD_NS
        if step < 0:
            return "the board restarted, its clock went back"
        return "the clock of the board jumped ahead" if self._ahead and not before else ""

    def _shortest(self, apart: int) -> int:
        """Return the difference of two times of a counter that may have begun again between them."""
        half = self._wrap // 2
        return (apart + half) % self._wrap - half if abs(apart) < self._wrap else apart

    def _moved(self, values: Values) -> str:
        before, now = self._capdacs, tuple(values.get(f"capdac_{channel}") for channel in ("hard", "soft"))
        self._capdacs = now
        return f"CAPDAC {before[0]}, {before[1]} -> {now[0]}, {now[1]}" if before not in (None, now) and before else ""
