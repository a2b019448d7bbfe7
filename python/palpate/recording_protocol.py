"""The interface of a recording: what `palpate.touches` needs to find the touches in it."""

from collections.abc import Iterator
from enum import Enum, auto
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.importers.table_checks import clipped
from palpate.samples import UNTIMED_NS

Times = NDArray[np.int64] | NDArray[np.float64]
"""Times of readings, shape (n,): ns as integers, or s as numbers with a point."""


class PartEnd(Enum):
    """What happens to the baseline after a part of a recording.

    Attributes
    ----------
    CONTINUES
        Nothing: it holds for the next part, too.
    TARE
        It was measured again.
    GAP
        It is not valid any more: the board was opened again, or its range moved. It is measured
        again.
    """

    CONTINUES = auto()
    TARE = auto()
    GAP = auto()


class Part(NamedTuple):
    """Consecutive pairs of a recording, as `Tracker.process` takes them.

    Attributes
    ----------
    t_hard, t_soft : numpy.ndarray, shape (n,)
        Times of both channels, in ns (integers) or s (numbers with a point).
    hard, soft : numpy.ndarray of float, shape (n,)
        Readings in pF, or in the unit of the recording, with the baseline; nan: not usable.
    end : PartEnd
        What happens to the baseline after the last pair.

    Examples
    --------
    >>> t = np.array([0, 26_000_000, 52_000_000])
    >>> part = Part(t, t, np.ones(3), np.ones(3))
    >>> part.seconds[0].tolist(), part.step_s
    ([0.0, 0.026, 0.052], 0.026)
    """

    t_hard: Times
    t_soft: Times
    hard: NDArray[np.float64]
    soft: NDArray[np.float64]
    end: PartEnd = PartEnd.CONTINUES

    @property
    def pairs(self) -> int:
        """Number of pairs."""
        return len(self.hard)

    @property
    def columns(self) -> tuple[Times, Times, NDArray[np.float64], NDArray[np.float64]]:
        """The four arrays."""
        return self.t_hard, self.t_soft, self.hard, self.soft

    @property
    def seconds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times of both channels, s."""
        return _seconds(self.t_hard), _seconds(self.t_soft)

    @property
    def step_s(self) -> float:
        """Median time from pair to pair, s; of two pairs at least."""
        step = float(np.median(np.diff(self.t_hard)))
        return step / 1e9 if self.t_hard.dtype.kind == "i" else step

    def rows(self, begin: int, end: int) -> "Part":
        """Return the pairs from number `begin` to before `end`; nothing happens after them."""
        which = slice(begin, end)
        return Part(self.t_hard[which], self.t_soft[which], self.hard[which], self.soft[which])


def _seconds(times: Times) -> NDArray[np.float64]:
    return np.asarray(times / 1e9 if times.dtype.kind == "i" else times)


class RecordingProtocol(Protocol):
    """What every recording has: in memory, in a file, a table, or simulated.

    `palpate.touches`, `palpate.offline` and a calibration read nothing else of it. A class of your
    own can be a recording, too; one with arrays needs `ArrayRecording` and five attributes only.
    """

    @property
    def timed(self) -> bool:
        """Whether every pair has its times."""

    @property
    def unit(self) -> str:
        """Unit of the readings: "pF", or any other text."""

    @property
    def full_scale_pF(self) -> float:
        """Readings of this magnitude are saturated, pF; inf: unknown."""

    @property
    def host_stamps(self) -> bool:
        """Whether the computer stamped the samples when they arrived; False: it did not, or unknown."""

    @property
    def period_s(self) -> float:
        """Time from pair to pair by the device's settings, s; 0: unknown."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data, complete after all `parts` were read; the `doubts` among them."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons why results may be wrong, complete after all `parts` were read."""

    def parts(self, full_scale_pF: float) -> Iterator[Part]:
        """Yield all pairs in order.

        Parameters
        ----------
        full_scale_pF : float
            The tracker's full scale, pF: it recognises these readings as saturated by itself.
        """

    def value_notes(self) -> Iterator[str]:
        """Yield remarks on times and values that nothing has checked while they were read."""


_MEMBERS = frozenset(name for name in dir(RecordingProtocol) if not name.startswith("_"))


def is_like_recording(value: object) -> bool:
    """Return whether a value has any member of a recording."""
    return not _MEMBERS.isdisjoint(dir(value))


def require_recording(value: object) -> None:
    """Check that a value is a recording.

    Raises
    ------
    TypeError
        It lacks members of `RecordingProtocol`; the message names them.

    Examples
    --------
    >>> require_recording(3)
    Traceback (most recent call last):
    TypeError: recording: got 3, without doubts, full_scale_pF, host_stamps, notes, parts, \
period_s, timed, unit, value_notes, allowed: the result of palpate.read or palpate.recorded; \
a live source has to be recorded first
    """
    missing = sorted(_MEMBERS.difference(dir(value)))
    if missing:
        raise TypeError(
            f"recording: got {value!r:.60}, without {', '.join(missing)}, allowed: the result of "
            "palpate.read or palpate.recorded; a live source has to be recorded first"
        )


class ArrayRecording:
    """Base of recordings in memory: makes the members of `RecordingProtocol` from arrays.

    The class needs `t_hard_s`, `t_soft_s`, `hard`, `soft`, each of shape (n,), and `full_scale_pF`.

    Examples
    --------
    >>> from palpate.simulation import scenarios
    >>> run = scenarios.run("stiff-steady")
    >>> [part.pairs for part in run.parts(run.full_scale_pF)] == [len(run.hard)]
    True
    """

    t_hard_s: NDArray[np.float64]
    t_soft_s: NDArray[np.float64]
    hard: NDArray[np.float64]
    soft: NDArray[np.float64]

    @property
    def unit(self) -> str:
        """Unit of the readings."""
        return "pF"

    @property
    def host_stamps(self) -> bool:
        """Whether the computer stamped the samples when they arrived."""
        return False

    @property
    def period_s(self) -> float:
        """From pair to pair, as the device has it, s; 0: unknown."""
        return 0.0

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data."""
        return ()

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons why results may be wrong."""
        return ()

    @property
    def gap_rows(self) -> tuple[int, ...]:
        """Rows from which on the earlier baseline is not valid."""
        return ()

    @property
    def timed(self) -> bool:
        """Whether every pair has its times."""
        return bool(np.isfinite(self.t_hard_s).all() and np.isfinite(self.t_soft_s).all())

    def parts(self, full_scale_pF: float) -> Iterator[Part]:
        """Yield the pairs, a new part after each gap; without times, pairs are 26 ms apart."""
        rows = len(self.hard)
        whole = Part(self.t_hard_s, self.t_soft_s, self.hard, self.soft)
        if not self.timed:
            times = np.arange(rows) * UNTIMED_NS
            whole = Part(times, times, self.hard, self.soft)
        gaps_left = len(self.gap_rows)
        for begin, end in pairwise([0, *self.gap_rows, rows]):
            part = whole.rows(begin, end)
            yield part._replace(end=PartEnd.GAP) if gaps_left else part
            gaps_left -= 1

    def value_notes(self) -> Iterator[str]:
        """Yield remarks on times that are no numbers, and on clipped channels."""
        rows = len(self.hard)
        bad = np.count_nonzero(~np.isfinite(self.t_hard_s + self.t_soft_s))
        if 0 < bad < rows:
            yield (
                f"{bad} of {rows} rows have a time that is no number: no time is used, "
                "pairs are taken for 26 ms apart"
            )
        yield from _clipped("hard", self.hard)
        yield from _clipped("soft", self.soft)


def _clipped(name: str, values: NDArray[np.float64]) -> list[str]:
    """Return remarks on a clipped channel; none if it rests at its extreme: it begins there."""
    extremes = (np.nanmin(values, initial=np.inf), np.nanmax(values, initial=-np.inf))
    if not len(values) or values[0] in extremes:
        return []
    return clipped(name, values)
