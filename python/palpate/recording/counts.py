"""Counts over a recording, summed block by block."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.recording.rows import Codes
from palpate.samples import Block, Status, memory_s, refused_samples


@dataclass
class Survey:
    """Counts of rows, lost samples and faults in a recording.

    Attributes
    ----------
    rows : int
        Number of rows.
    first_seq, last_seq : int or None
        Numbers of the first and the last sample.
    gaps, lost : int
        Number of gaps in `seq`, and of samples missing in them.
    disordered : int
        Rows whose `seq` is not above the one of the row before.
    backward : int
        Rows whose time is earlier than in the row before.
    refused, excitation, hard_saturated, soft_saturated : int
        Rows without a usable value; how many of these have EXCERR of the converter; rows with a
        saturated channel.
    miscoded : int
        Rows with a code above the largest one of the converter.
    first_ns, last_ns : int
        Times of the first and the last row, ns.
    seconds : float
        Time from the first row to the last, s.
    pause : (float, int)
        The longest time from row to row, s, and the number of the row before; pauses at `marked`
        rows do not count.
    marked : frozenset of int
        Rows after which a mark says that the baseline was measured again.
    at_marks : (int, int)
        Steps from such a row to the next one without a missing number, and their time, ns.
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
    at_marks: tuple[int, int] = (0, 0)
    spans_pF: dict[str, tuple[float, float]] = field(default_factory=dict)
    largest_code: int = Codes().largest

    @property
    def in_gaps(self) -> str:
        """Number of gaps as text: "in 1 gap", "in 2 gaps"."""
        return "in 1 gap" if self.gaps == 1 else f"in {self.gaps} gaps"

    @property
    def pause_note(self) -> str:
        """A note on a pause without a mark that a baseline does not last; "" if there is none."""
        seconds, seq = self.pause
        if not seconds > memory_s(self.period_s):
            return ""
        pause = f"no sample for {seconds:.1f} s after sample {seq}, and no mark says why"
        valid = "the earlier baseline is not valid, and the touches after it may be wrong"
        return f"{pause}: if the board was opened again there, {valid}"

    @property
    def seconds(self) -> float:
        """Time from the first row to the last, s."""
        return (self.last_ns - self.first_ns) / 1e9

    @property
    def period_s(self) -> float:
        """Mean time between pairs, lost ones included, s; nan below two rows.

        Without the times at `marked` rows, unless numbers are missing there.
        """
        left_out, left_out_ns = self.at_marks
        pairs = self.rows - 1 + self.lost - left_out
        return (self.seconds - left_out_ns / 1e9) / pairs if pairs > 0 else float("nan")

    def add(self, block: Block) -> None:
        """Add the next block of samples, one at least."""
        if self.first_seq is None:
            self.first_seq = int(block["seq"][0])
            self.first_ns = int(block["t_hard_ns"][0])
        self._add_steps(block)
        self.rows += len(block)
        self.last_seq = int(block["seq"][-1])
        self.last_ns = int(block["t_hard_ns"][-1])
        codes = np.maximum(block["hard_raw"], block["soft_raw"])
        self.miscoded += int(np.count_nonzero(codes > self.largest_code))
        self.refused += int(np.count_nonzero(refused_samples(block)))
        if block["status"].any():
            self._add_status(block["status"])
        self._widen_span("hard", block["hard"])
        self._widen_span("soft", block["soft"])

    def _add_status(self, status: NDArray[np.uint8]) -> None:
        self.excitation += int(np.count_nonzero(status & Status.EXCITATION))
        self.hard_saturated += int(np.count_nonzero(status & Status.HARD_SATURATED))
        self.soft_saturated += int(np.count_nonzero(status & Status.SOFT_SATURATED))

    def _widen_span(self, name: str, values: NDArray[np.float64]) -> None:
        smallest = values.min()
        largest = values.max()
        if not np.isfinite([smallest, largest]).all():  # also if one of the values is nan
            values = values[np.isfinite(values)]
            if not len(values):
                return
            smallest = values.min()
            largest = values.max()
        low, high = self.spans_pF.get(name, (np.inf, -np.inf))
        self.spans_pF[name] = min(low, float(smallest)), max(high, float(largest))

    def _add_steps(self, block: Block) -> None:
        known = slice(0 if self.rows else 1, None)  # the last row before, if there is one
        seqs = np.append(np.int64(self.last_seq or 0), block["seq"])[known]
        times = np.append(np.int64(self.last_ns), block["t_hard_ns"])[known]
        steps = np.diff(seqs)
        if (steps != 1).any():
            missing = steps[steps > 1] - 1
            self.gaps += len(missing)
            self.lost += sum(missing.tolist())
            self.disordered += int(np.count_nonzero(steps < 1))
        # Compared, not subtracted: a difference of integers can overflow.
        self.backward += int(np.count_nonzero(times[1:] < times[:-1]))
        pauses = np.diff(times / 1e9)
        if self.marked:
            marked = np.isin(seqs[:-1], list(self.marked))
            found = pauses[marked & (steps == 1)].tolist()
            count, total_ns = self.at_marks
            total_ns += sum(round(1e9 * pause_s) for pause_s in found)
            self.at_marks = count + len(found), total_ns
            pauses[marked] = 0.0
        if len(pauses):
            longest = int(np.argmax(pauses))
            if pauses[longest] > self.pause[0]:  # of equal ones the first, however the file is cut
                self.pause = float(pauses[longest]), int(seqs[longest])
