"""Counts over a recording, summed block by block."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.recording.codes import Codes
from palpate.samples import Block, Status, refused


@dataclass
class Survey:
    """Counts of rows, lost samples and faults in a recording.

    Attributes
    ----------
    rows : int
        Number of rows.
    first_seq, last_seq : int or None
        Numbers of the first and last sample.
    gaps, lost : int
        Number of gaps in `seq`, and of samples missing in them.
    disordered : int
        Rows whose `seq` is not above that of the row before.
    backward : int
        Rows whose time is before that of the row before.
    refused, excitation, hard_saturated, soft_saturated : int
        Rows without a usable value; those of them with EXCERR of the converter; rows with a saturated channel.
    miscoded : int
        Rows with a code above the largest one of the converter.
    seconds : float
        Time from the first row to the last, s.
    pause : (float, int)
        The longest time from row to row, s, and the number of the row before; those of `marked` left out.
    marked : frozenset of int
        Rows after which a mark says that the baseline was measured again.
    spans_pF : dict
        (lowest, highest) value of "hard" and "soft", pF; no entry for a channel without values.
    largest_code : int
        The largest code of the converter.

    Examples
    --------
    >>> from palpate.samples import Sample, block_of
    >>> survey = Survey()
    >>> survey.add(block_of([Sample(0, 0, 0, -1, -1, 1.0, 2.0, 0), Sample(3, 0, 0, -1, -1, 1.5, 2.0, 0)]))
    >>> survey.rows, survey.lost, survey.spans_pF["hard"]
    (2, 2, (1.0, 1.5))
    """

    rows: int = 0
    first_seq: int | None = None
    last_seq: int | None = None
    gaps: int = 0
    lost: int = 0
    disordered: int = 0
    backward: int = 0
    refused: int = 0
    excitation: int = 0
    hard_saturated: int = 0
    soft_saturated: int = 0
    miscoded: int = 0
    first_ns: int = 0
    last_ns: int = 0
    pause: tuple[float, int] = (0.0, 0)
    marked: frozenset[int] = frozenset()
    spans_pF: dict[str, tuple[float, float]] = field(default_factory=dict)
    largest_code: int = Codes().largest

    @property
    def in_gaps(self) -> str:
        """Number of gaps as text: "in 1 gap", "in 2 gaps"."""
        return "in 1 gap" if self.gaps == 1 else f"in {self.gaps} gaps"

    @property
    def told_pause(self) -> str:
        """What to say of a pause without a mark, above a second and 20 periods; "": nothing."""
        seconds, seq = self.pause
        if not seconds > max(1.0, 20 * self.period_s):
            return ""
        return (
            f"no sample for {seconds:.1f} s after sample {seq}, and no mark says why: if the board was opened again there, "
            "the baseline before does not hold, and the touches after it may be wrong"
        )

    def add(self, block: Block) -> None:
        """Add the next block of samples."""
        if not len(block):
            return
        if self.first_seq is None:
            self.first_seq, self.first_ns = int(block["seq"][0]), int(block["t_hard_ns"][0])
        seqs, times = (
            np.append(np.array([last] if self.rows else [], np.int64), block[name])
            for last, name in ((self.last_seq, "seq"), (self.last_ns, "t_hard_ns"))
        )
        self._add_order(seqs)
        self._add_times(seqs, times)
        self._add_values(block)
        self.rows += len(block)
        self.last_seq, self.last_ns = int(seqs[-1]), int(times[-1])

    @property
    def seconds(self) -> float:
        """Time from the first row to the last, s."""
        return (self.last_ns - self.first_ns) / 1e9

    @property
    def period_s(self) -> float:
        """Mean time between pairs, lost ones included, s; nan below two rows."""
        pairs = self.rows - 1 + self.lost
        return self.seconds / pairs if pairs > 0 else float("nan")

    def _add_order(self, seqs: NDArray[np.int64]) -> None:
        steps = np.diff(seqs)
        others = steps[steps != 1]
        gaps = others[others > 1].tolist()
        self.gaps += len(gaps)
        self.lost += sum(gaps) - len(gaps)
        self.disordered += len(others) - len(gaps)

    def _add_times(self, seqs: NDArray[np.int64], times: NDArray[np.int64]) -> None:
        self.backward += int(np.count_nonzero(times[1:] < times[:-1]))  # a difference of integers can overflow
        steps = np.diff(times / 1e9)
        if len(steps):
            if self.marked:
                steps[np.isin(seqs[:-1], list(self.marked))] = 0.0
            at = int(np.argmax(steps))
            if steps[at] > self.pause[0]:  # of equal ones the first, however the file is cut
                self.pause = float(steps[at]), int(seqs[at])

    def _add_values(self, block: Block) -> None:
        spans = [(name, values.min(), values.max()) for name in ("hard", "soft") for values in [block[name]]]
        if block["status"].any() or not np.isfinite([span[1:] for span in spans]).all():
            spans = self._add_faults(block)
        for name, low, high in spans:
            known = self.spans_pF.get(name, (np.inf, -np.inf))
            self.spans_pF[name] = (min(known[0], float(low)), max(known[1], float(high)))
        if max(block["hard_raw"].max(), block["soft_raw"].max()) > self.largest_code:
            above = (block["hard_raw"] > self.largest_code) | (block["soft_raw"] > self.largest_code)
            self.miscoded += int(np.count_nonzero(above))

    def _add_faults(self, block: Block) -> list[tuple[str, np.float64, np.float64]]:
        status = block["status"]
        self.refused += int(np.count_nonzero(refused(block)))
        self.excitation += int(np.count_nonzero(status & Status.EXCITATION))
        self.hard_saturated += int(np.count_nonzero(status & Status.HARD_SATURATED))
        self.soft_saturated += int(np.count_nonzero(status & Status.SOFT_SATURATED))
        finite = ((name, block[name][np.isfinite(block[name])]) for name in ("hard", "soft"))
        return [(name, values.min(), values.max()) for name, values in finite if len(values)]
