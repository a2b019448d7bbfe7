"""What is marked on the axis of time: marks, tares, gaps, judgements, and flags."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from palpate.flags import advice
from palpate.judgements import Judgement, without_repeats
from palpate.live.measurement import Measurement
from palpate.live.multiresolution import ROWS
from palpate.live.page_frames import RowFlag
from palpate.live.protocol import (
    EventsMessage,
    ShownFlag,
    ShownGap,
    ShownJudgement,
    ShownMark,
)
from palpate.sources import Gap
from palpate.stream import Batch, Listener, Stream
from palpate.touch import Touch

HOLE_S = 0.25  # a hole in the samples without a message of the source is shown from here on; all are counted
_MOST_GAPS = 1000  # the newest
_MOST_FLAGGED = 1000  # touches; the newest
_MOST_JUDGED = 1000  # judgements; the newest
# shown at their first sample; the rest: at the end
_AT_FIRST = {"saturated": RowFlag.SATURATED, "refused": RowFlag.REFUSED}


class Annotations(Listener):
    """The events of a measurement: follows its samples."""

    def __init__(self, measurement: Measurement) -> None:
        self._measurement = measurement
        self.begun()
        measurement.listeners.append(self)

    def begun(self, stream: Stream | None = None) -> None:
        """Begin with the next measurement."""
        self._gaps: deque[ShownGap] = deque(maxlen=_MOST_GAPS)
        self._judgements: deque[Judgement] = deque(maxlen=_MOST_JUDGED)
        self._gap_text: str | None = None  # of a gap before the next sample
        self._last_seq = np.empty(0, np.int64)
        self._last_s = np.empty(0)
        self._flagged: tuple[Sequence[Touch] | None, list[ShownFlag]] = (None, [])

    def document(self) -> EventsMessage:
        """Return the message `events`."""
        marks = [ShownMark(one.id, one.t_s, one.text) for one in self._measurement.marks.copy()]
        judgements = []
        for each in without_repeats(self._judgements.copy()):
            judgements.append(ShownJudgement(each.time_s, each.channel, each.name, each.text))
        return EventsMessage(
            marks,
            list(self._measurement.tares.copy()),
            list(self._gaps.copy()),
            judgements,
            self._flags(),
        )

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
        seq = np.append(self._last_seq, batch.samples["seq"])
        t_s = np.append(self._last_s, batch.samples["t_hard_ns"] * 1e-9)
        self._last_seq = seq[-1:]
        self._last_s = t_s[-1:]
        first_new = len(seq) - len(batch.samples)
        texts = {}
        if self._gap_text is not None:
            texts[first_new] = self._gap_text
            self._gap_text = None
        holes = np.flatnonzero((np.diff(seq) > 1) & (np.diff(t_s) >= HOLE_S)) + 1
        for at in sorted({*texts, *holes.tolist()} - {0}):
            missing = max(int(seq[at] - seq[at - 1]) - 1, 0)
            text = texts.get(at, f"{missing} pairs are missing")
            self._gaps.append(ShownGap(float(t_s[at - 1]), float(t_s[at]), missing, text))

    def _flags(self) -> list[ShownFlag]:
        """Return the flags of the newest touches, computed again when one has ended or was revised."""
        touches = self._measurement.touches
        if self._flagged[0] is not touches:
            self._flagged = (touches, self._flags_of(touches))
        return self._flagged[1]

    def _flags_of(self, touches: Sequence[Touch]) -> list[ShownFlag]:
        first = max(len(touches) - _MOST_FLAGGED, 0)
        found = []
        for number, touch in enumerate(touches[first:], first + 1):
            for each in advice(touch):
                if each.flag in touch.flags:
                    at_s = self._arises(each.flag, number, touch.start_s)
                    found.append(ShownFlag(at_s, number, each.flag.value, str(each)))
        return found

    def _arises(self, flag: str, number: int, start_s: float) -> float:
        """Return when a flag arose, s: at its first sample if that is known, else at the end of the touch."""
        end_s = self._measurement.ends.get(number, start_s)
        if flag not in _AT_FIRST:
            return end_s
        rows = self._measurement.levels.view(start_s, end_s, ROWS)
        is_inside = (rows["t_s"] >= start_s) & (rows["t_s"] <= end_s)
        has_flag = (rows["flags"] & int(_AT_FIRST[flag])) > 0
        times = rows["t_s"][has_flag & is_inside]
        return float(times[0]) if len(times) else end_s
