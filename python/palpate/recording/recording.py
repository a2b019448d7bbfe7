"""A recording in memory: both channels as arrays."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from palpate.dataframe import Framed
from palpate.labels import require_same_index
from palpate.plotted import Plotted
from palpate.recording.session import Plan
from palpate.recording_protocol import ArrayRecording

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene
    from palpate.tracking import Touches


class Mark(NamedTuple):
    """A text at a time of a recording.

    Attributes
    ----------
    t_s : float
        On the clock of the recording, s; nan before the first sample.
    text : str

    Examples
    --------
    >>> Mark(12.5, "second specimen").text
    'second specimen'
    """

    t_s: float
    text: str


@dataclass(frozen=True, eq=False, repr=False)
class Recording(ArrayRecording, Framed, Plotted):
    """A recording in memory: times and capacitances of both channels.

    Attributes
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,)
        Times of the readings of each channel, s; nan if the file has no times, equal if it has one
        time for both.
    hard, soft : numpy.ndarray, shape (n,)
        Capacitances, pF, or signals in `unit`, baseline included; nan for a missing value.
    notes : tuple of str
        Remarks on the data: rows without a value, an incomplete last row, times that go back.
    full_scale_pF : float
        Readings of this magnitude are saturated: the range of the AD7746 in palpate's own files,
        else inf.
    host_stamps : bool
        Whether the computer stamped the samples when they arrived; False if it is not known.
    period_s : float
        From pair to pair, as the device has it, s; 0: not known.
    doubts : tuple of str
        Notes on differences from the file as it was written: results may be wrong.
    gap_rows : tuple of int
        Rows from which on the earlier baseline is not valid, from 1: the board was opened again, or
        its range moved.
    zero_utc_ns : int or None
        UTC of t = 0, ns since 1970, by the wall clock of the computer that recorded; None: unknown.
    understood : str
        Of a table of another program: one line that says which columns and units were used.
    marks : tuple of Mark
        From the sidecar of palpate's own files, in the order in which they were made.
    unit : str
        Of the values: pF, or as given to `palpate.read`.
    plan : Plan
        The session in the sidecar: specimens, which touch was on which of them, what is left out,
        notes; empty without one.

    Notes
    -----
    `len(recording)` is the number of pairs. `recording[2.0:5.0]` is the part from 2 s on, to before
    5 s, with the times and the epoch as they are. Begin a part without contact: the baseline of its
    touches is measured there.

    Examples
    --------
    >>> import palpate
    >>> recording = palpate.read("tests/data/four-specimens.csv")
    >>> recording.hard.shape == recording.t_soft_s.shape, recording.notes
    (True, ())
    >>> recording[0.0:10.0]
    <Recording: 10.0 s, 385 pairs, 1 note>
    """

    t_hard_s: NDArray[np.float64]
    t_soft_s: NDArray[np.float64]
    hard: NDArray[np.float64]
    soft: NDArray[np.float64]
    notes: tuple[str, ...] = ()
    full_scale_pF: float = math.inf
    host_stamps: bool = False
    period_s: float = 0.0
    doubts: tuple[str, ...] = ()
    gap_rows: tuple[int, ...] = ()
    zero_utc_ns: int | None = None
    understood: str = ""
    marks: tuple[Mark, ...] = ()
    unit: str = "pF"
    plan: Plan = Plan()  # noqa: RUF009  it cannot be changed

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.hard)

    def __getitem__(self, span: slice) -> "Recording":
        """Return the pairs from `span.start` to before `span.stop`, s, by their hard reading.

        Raises
        ------
        TypeError
            Not a slice of seconds: whole numbers may be meant as rows.
        ValueError
            The recording has no times, or there is no pair between these.
        """
        begin, end = _seconds(span)
        length_s = self.duration.total_seconds()  # an error without times
        inside = (self.t_hard_s >= begin) & (self.t_hard_s < end)
        # A negative time may be meant as one from the end.
        is_from_end = len(self) > 0 and -math.inf < begin < 0 <= self.t_hard_s[0]
        if is_from_end or not inside.any():
            allowed = "none"
            if len(self):
                first_s = self.t_hard_s[0]
                allowed = f"{first_s:.3f} to {first_s + length_s:.3f} s"
            raise ValueError(
                f"recording[{begin}:{end}]: got no pair, allowed: times from {allowed}"
            )
        kept_before = np.append(0, np.cumsum(inside))  # number of pairs kept before each row
        gaps = {int(kept_before[row]) for row in self.gap_rows}
        gaps -= {0, int(kept_before[-1])}
        note = f"the part {begin}:{end} s of a recording; other notes and doubts are of the whole"
        return replace(
            self,
            t_hard_s=self.t_hard_s[inside],
            t_soft_s=self.t_soft_s[inside],
            hard=self.hard[inside],
            soft=self.soft[inside],
            gap_rows=tuple(sorted(gaps)),
            marks=tuple(mark for mark in self.marks if begin <= mark.t_s < end),
            notes=(*self.notes, note),
        )

    def value_notes(self) -> Iterator[str]:
        """Yield remarks on times and values; a table was checked when it was read."""
        if not self.understood:
            yield from super().value_notes()

    def __repr__(self) -> str:
        """Return a summary in one line; the arrays are `hard`, `soft`, `t_hard_s` and `t_soft_s`."""
        from palpate.display.text import recording_line

        return recording_line(self)

    def _repr_html_(self) -> str:
        from palpate.display.cards import recording_card

        return recording_card(self)

    def _draw(self, ax: Any) -> None:
        from palpate.display.plots import draw_recording

        draw_recording(self, ax)

    def touches(
        self, *, scene: "_Scene" = "handheld", **settings: Unpack["_AnySettings"]
    ) -> "Touches":
        """Return the touches, as `palpate.touches`."""
        from palpate.tracking import tracked

        return tracked(self, scene=scene, **settings).touches

    def to_arrow(self) -> Any:
        """Return a pyarrow.Table, which `palpate.read` reads back, without notes and marks."""
        from palpate.recording.arrow import to_arrow

        return to_arrow(self)

    @property
    def duration(self) -> timedelta:
        """Time from the first reading to the last one.

        Raises
        ------
        ValueError
            The recording has no times.
        """
        times = np.concatenate([self.t_hard_s, self.t_soft_s])
        if not np.isfinite(times).all():
            raise ValueError(
                "duration: got a recording without times, allowed: one with a column of times"
            )
        return timedelta(seconds=float(np.ptp(times)) if len(times) else 0.0)

    @property
    def utc_ns(self) -> NDArray[np.int64]:
        """UTC of the hard channel's readings, ns since 1970, shape (n,).

        Raises
        ------
        ValueError
            It is not known, for example of a simulation that ran faster than time.
        """
        if self.zero_utc_ns is None:
            allowed = (
                "one of a device in real time (of a simulated one with speed=1), made by palpate"
            )
            raise ValueError(f"utc_ns: got a recording without the wall clock, allowed: {allowed}")
        return self.zero_utc_ns + np.rint(self.t_hard_s * 1e9).astype(np.int64)

    def __post_init__(self) -> None:
        """Convert the fields to arrays, and check them."""
        size = np.size(self.hard)
        arrays = {
            "t_hard_s": self.t_hard_s,
            "t_soft_s": self.t_soft_s,
            "hard": self.hard,
            "soft": self.soft,
        }
        require_same_index(arrays.keys(), arrays.values())
        for name, values in arrays.items():
            object.__setattr__(self, name, real_array(name, values, size))


def real_array(name: str, values: Any, size: int) -> NDArray[np.float64]:
    """Return values as floats of shape (size,), nan for masked ones; else an error."""
    if np.ma.isMaskedArray(values):
        values = np.ma.filled(values.astype(float), math.nan)
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name}: got dtype {array.dtype}, allowed: real numbers")
    if array.shape != (size,):
        raise ValueError(f"{name}: got shape {array.shape}, allowed: ({size},)")
    return np.asarray(array, float)


def _seconds(span: slice) -> tuple[float, float]:
    is_span = (
        isinstance(span, slice)
        and span.step is None
        and isinstance(span.start, float | np.floating | None)
        and isinstance(span.stop, float | np.floating | None)
    )
    if not is_span:
        allowed = (
            "seconds with a point, as recording[2.0:5.0]; "
            "rows are those of the arrays, as recording.hard[2:5]"
        )
        raise TypeError(f"recording: got [{span!r:.60}], allowed: {allowed}")
    begin = -math.inf if span.start is None else span.start
    end = math.inf if span.stop is None else span.stop
    return float(begin), float(end)
