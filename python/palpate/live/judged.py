"""What was judged of the channels: what still holds of it, and what is news."""

import math
import time
from collections.abc import Callable

import numpy as np

from palpate.judgements import Judgement
from palpate.live.measurement import LiveMeasurement
from palpate.sources import Gap
from palpate.stream import Batch, Listener, Stream

NEWS_S = 5.0  # what has happened once is shown for this time
_NEAR_PF = 0.01  # a channel at its end, which may dither, is this near to it
_LASTING = ("saturated", "frozen", "falling")


class JudgedChannels(Listener):
    """Follows the judgements of a measurement. `clock`: seconds that only rise."""

    def __init__(
        self, measurement: LiveMeasurement, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._measurement = measurement
        self._clock = clock
        self._lasting: dict[tuple[str, str], Judgement] = {}
        self._newest: Judgement | None = None
        self._newest_s = -math.inf

    @property
    def lasting(self) -> tuple[Judgement, ...]:
        """What was judged and still holds, in order of time."""
        return tuple(self._lasting.values())

    @property
    def news(self) -> Judgement | None:
        """What happened once, a short time ago; None: nothing."""
        if self._clock() - self._newest_s >= NEWS_S:
            return None
        return self._newest

    def begun(self, _: Stream) -> None:
        """Begin with the next measurement."""
        self._lasting = {}
        self._newest = None

    def gap(self, _: Gap) -> None:
        """Forget what was judged before the source began again."""
        self._lasting = {}

    def batch(self, batch: Batch) -> None:
        """Forget what no longer holds."""
        # another thread reads the old ones meanwhile
        self._lasting = {
            kind: judgement
            for kind, judgement in self._lasting.items()
            if self._holds(judgement, batch)
        }

    def judgement(self, judgement: Judgement) -> None:
        """Keep a judgement: a state until it ends, anything else for a while."""
        if judgement.name in _LASTING:
            kind = judgement.channel, judgement.name
            self._lasting = {**self._lasting, kind: self._lasting.get(kind, judgement)}
        else:
            self._newest = judgement
            self._newest_s = self._clock()

    def _holds(self, judgement: Judgement, batch: Batch) -> bool:
        """Return whether a judgement holds after a batch: to the last reading, or to a tare."""
        if judgement.channel == "both":
            tares = self._measurement.tares
            return not tares or tares[-1] < judgement.time_s
        values = batch.samples[judgement.channel]
        known = values[np.isfinite(values)]
        if not len(known):
            return True
        away = abs(float(known[-1]) - judgement.size)
        if judgement.name == "saturated":
            return away <= _NEAR_PF
        return away == 0.0
