"""Numbers of the samples of a stream, and its gaps."""

from typing import NamedTuple


class Place(NamedTuple):
    """The number of a sample, and why the baseline before does not hold; empty: it holds."""

    seq: int
    gap: str


class Numbering:
    """Numbers samples from 0: as the sender numbers them, so that a lost one leaves its number out, else as they come.

    While a stream is connected LSL loses no sample: without numbers of the sender some are missing after a reconnection
    only, as many as the period says.

    Examples
    --------
    >>> numbering = Numbering()
    >>> numbering.place(700, 0, 0), numbering.place(702, 0, 20), numbering.place(702, 0, 20)
    (Place(seq=0, gap=''), Place(seq=2, gap=''), None)
    >>> numbering.place(703, 1, 30), numbering.place(0, 0, 90)
    (Place(seq=3, gap='the sender had a gap'), Place(seq=4, gap='the sender began again'))
    """

    def __init__(self) -> None:
        self._last: Place | None = None
        self._t_ns = 0
        self._base = self._gaps = 0  # number of the sender at seq 0; its gaps so far
        self._away, self._period_ns = "", 0.0

    def reconnected(self, why: str, period_ns: float) -> None:
        """Say that the next sample comes after a reconnection; period: from sample to sample, ns, inf if unknown."""
        self._away, self._period_ns = why, period_ns

    def place(self, number: int | None, gaps: int | None, t_ns: int) -> Place | None:
        """Return the place of the next sample; None: it came before.

        Parameters
        ----------
        number, gaps : int, optional
            Number of the sample, and number of gaps, of the sender.
        t_ns : int
            Its time, which does not fall.
        """
        following = self._last.seq + 1 if self._last else 0
        why, self._away = self._away, ""
        if number is None:
            seq = following + (max(round((t_ns - self._t_ns) / self._period_ns) - 1, 0) if why and self._last else 0)
        else:
            seq = number - self._base
            if self._last and seq < following:
                if t_ns <= self._t_ns:
                    self._away = why
                    return None
                why = why or "the sender began again"
            if not self._last or seq < following:
                self._base, seq = number - following, following
            elif gaps is not None and gaps > self._gaps:
                why = why or "the sender had a gap"
        self._gaps = gaps or 0
        self._t_ns = t_ns
        self._last = Place(seq, why)
        return self._last
