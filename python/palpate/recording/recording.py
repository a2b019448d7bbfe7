"""A recording in memory: both channels as arrays."""

import math
from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from palpate.recording.session import Plan
from palpate.tables.readers.outgoing import Framed

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene
    from palpate.touch import Touches


class Mark(NamedTuple):
    """What was marked while it was recorded.

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
class Recording(Framed):
    """A recording in memory: times and capacitances of both channels.

    Attributes
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,)
        Times of the readings of each channel, s; nan if the file has no times, equal if it has one time for both.
    hard, soft : numpy.ndarray, shape (n,)
        Capacitances, pF, baseline included; nan for a missing value.
    notes : tuple of str
        Remarks on the data: rows without a value, an incomplete last row, times that go back.
    full_scale_pF : float
        Readings of this magnitude are saturated: that of the AD7746 in palpate's own files, else inf.
    host_stamps : bool
        Whether the times are those of the arrival at the computer; False if it is not known.
    doubts : tuple of str
        Those of the notes that say that the file is not as it was written: results may be wrong.
    gap_rows : tuple of int
        Rows from which on the baseline before does not hold, from 1: the board was opened again, or its range moved.
    zero_utc_ns : int or None
        UTC of t = 0, ns since 1970, by the wall clock of the computer that recorded; None: unknown.
    understood : str
        Of a table of another program: one line that says which columns and units were used.
    marks : tuple of Mark
        From the sidecar of palpate's own files, in the order in which they were made.
    plan : Plan
        The session in the sidecar: specimens, which touch was on which of them, what is left out, notes; empty without one.

    Notes
    -----
    `len(recording)` is the number of pairs. `recording[2.0:5.0]` is the part from 2 s on, to before 5 s, with the times
    and the epoch as they are. Begin a part without contact: the baseline of its touches is measured there.

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
    doubts: tuple[str, ...] = ()
    gap_rows: tuple[int, ...] = ()
    zero_utc_ns: int | None = None
    understood: str = ""
    marks: tuple[Mark, ...] = ()
    plan: Plan = Plan()  # noqa: RUF009  it cannot be changed

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.hard)

    def __getitem__(self, span: slice) -> "Recording":
        """Return the part between two times, s."""
        from palpate.recording.part import part

        return part(self, span)

    def __repr__(self) -> str:
        """Return what there is, in one line; the arrays are `hard`, `soft`, `t_hard_s` and `t_soft_s`."""
        from palpate.display import text

        return text.recording(self)

    def _repr_html_(self) -> str:
        from palpate.display import cards

        return cards.recording(self)

    def plot(self, ax: Any = None) -> Any:
        """Draw the change of both channels over time, pF, with the marks, and a dashed line at each gap.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Default: new axes of pyplot.

        Returns
        -------
        matplotlib Axes

        Raises
        ------
        MissingExtra
            matplotlib is missing; type: pip install 'palpate[science]'.
        """
        from palpate.display import plots

        return plots.recording(self, ax)

    def touches(self, *, scene: "_Scene" = "handheld", **settings: Unpack["_AnySettings"]) -> "Touches":
        """Return the touches, as `palpate.touches`."""
        from palpate.touch import touches

        return touches(self, scene=scene, **settings)

    def to_arrow(self) -> Any:
        """Return a pyarrow.Table of the four arrays; `palpate.read` makes the same recording of it, without notes and marks."""
        from palpate.recording.exchange.frames import to_arrow

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
            raise ValueError("duration: got a recording without times, allowed: one with a column of times")
        return timedelta(seconds=float(np.ptp(times)) if len(times) else 0.0)

    @property
    def utc_ns(self) -> NDArray[np.int64]:
        """UTC of the hard channel's readings, ns since 1970, shape (n,); it puts recordings on one time axis.

        Raises
        ------
        ValueError
            It is not known, for example of a simulation that ran faster than time.
        """
        if self.zero_utc_ns is None:
            raise ValueError(
                "utc_ns: got a recording without the wall clock, allowed: one of a device in real time "
                "(of a simulated one with speed=1), made by palpate"
            )
        return self.zero_utc_ns + np.rint(self.t_hard_s * 1e9).astype(np.int64)

    def __post_init__(self) -> None:
        """Convert the fields to arrays, and check them."""
        size = np.size(self.hard)
        for name in ("t_hard_s", "t_soft_s", "hard", "soft"):
            given: Any = getattr(self, name)
            array = np.asarray(np.ma.filled(given.astype(float), math.nan) if np.ma.isMaskedArray(given) else given)
            if array.dtype.kind not in "biuf":
                raise TypeError(f"{name}: got dtype {array.dtype}, allowed: real numbers")
            if array.shape != (size,):
                raise ValueError(f"{name}: got shape {array.shape}, allowed: ({size},)")
            object.__setattr__(self, name, np.asarray(array, float))
