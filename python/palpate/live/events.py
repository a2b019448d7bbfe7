"""What is marked on the axis of time: marks, tares, gaps, judgements, and flags."""

from collections import deque
from typing import Any

import numpy as np

from palpate.flags import advice
from palpate.judgements import Judgement, without_repeats
from palpate.live.feed import Document, Flag
from palpate.live.levels import ROWS
from palpate.live.measurement import AnyMeasurement
from palpate.sources import Gap
from palpate.stream import Batch, Listener, Stream

HOLE_S = 0.25  # a hole in the samples without a message of the source is shown from here on; all are counted
_MOST_GAPS, _FLAGGED = 1000, 1000  # gaps, touches; the newest
_MOST_JUDGED = 1000  # judgements; the newest
# shown at their first sample; the rest: at the end
_AT_FIRST = {"saturated": Flag.SATURATED, "refused": Flag.REFUSED}


class Events(Listener):
    """The events of a measurement: follows its samples."""

    def __init__(self, measurement: AnyMeasurement) -> None:
        self._measurement = measurement
        self.begun()
        measurement.listeners.append(self)

    def begun(self, stream: Stream | None = None) -> None:
        """Begin with the next measurement."""
        self._gaps: deque[Document] = deque(maxlen=_MOST_GAPS)
        self._judgements: deque[Judgement] = deque(maxlen=_MOST_JUDGED)
        self._gap_text: str | None = None  # of a gap before the next sample
        self._last = np.empty(0, np.int64), np.empty(0)
        self._flagged: tuple[Any, list[Document]] = (None, [])

    def document(self) -> Document:
        """Return the message `events`."""
        tares, gaps = list(self._measurement.tares.copy()), list(self._gaps.copy())
        marks = [
            {"id": mark.id, "t_s": mark.t_s, "text": mark.text}
            for mark in self._measurement.marks.copy()
        ]
        judgements = [
            {"t_s": each.time_s, "channel": each.channel, "name": each.name, "text": each.text}
            for each in without_repeats(self._judgements.copy())
        ]
        return {
            "marks": marks,
            "tares": tares,
            "gaps": gaps,
            "judgements": judgements,
            "flags": self._flags(),
        }

    def gap(self, gap: Gap) -> None:
        """Keep a gap until its sample comes."""
        self._gap_text = gap.text

    def judgement(self, judgement: Judgement) -> None:
        """Keep a judgement."""
        self._judgements.append(judgement)

    def batch(self, batch: Batch) -> None:
        """Note where pairs are missing: at each gap of the source, and where a hole can be seen."""
        if not len(batch.samples):
            return
        new = batch.samples["seq"], batch.samples["t_hard_ns"] * 1e-9
        seq, t_s = (np.append(last, each) for last, each in zip(self._last, new, strict=True))
        self._last = seq[-1:], t_s[-1:]
        at_gap = len(seq) - len(batch.samples)  # the first new sample
        texts = {} if self._gap_text is None else {at_gap: self._gap_text}
        self._gap_text = None
        long = np.flatnonzero((np.diff(seq) > 1) & (np.diff(t_s) >= HOLE_S)) + 1
        for at in sorted({*texts, *long.tolist()} - {0}):
            missing = max(int(seq[at] - seq[at - 1]) - 1, 0)
            text = texts.get(at, f"{missing} pairs are missing")
            self._gaps.append(
                {
                    "from_s": float(t_s[at - 1]),
                    "to_s": float(t_s[at]),
                    "lost": missing,
                    "text": text,
                }
            )

    def _flags(self) -> list[Document]:
        """Return the flags of the newest touches, computed again when one has ended or was revised."""
        touches = self._measurement.touches
        if self._flagged[0] is not touches:
            first = max(len(touches) - _FLAGGED, 0)
            found = [
                {
                    "t_s": self._arises(each.flag, number, touch.start_s),
                    "touch": number,
                    "name": each.flag.value,
                    "text": str(each),
                }
                for number, touch in enumerate(touches[first:], first + 1)
                for each in advice(touch)
                if each.flag in touch.flags
            ]
            self._flagged = touches, found
        return self._flagged[1]

    def _arises(self, flag: str, number: int, start_s: float) -> float:
        """Return where a flag stands, s: at its first sample if that is known, else at the end of the touch."""
        end_s = self._measurement.ends.get(number, start_s)
        if flag in _AT_FIRST:
            rows = self._measurement.levels.view(start_s, end_s, ROWS)
            there = (
                (rows["flags"] & int(_AT_FIRST[flag]) > 0)
                & (rows["t_s"] >= start_s)
                & (rows["t_s"] <= end_s)
            )
            return float(next(iter(rows["t_s"][there]), end_s))
        return end_s
