"""What the newest samples show beside the estimate: followed in the thread of the measurement, read from any other."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.samples import Status
from palpate.stream import Stream
from palpate.stream.estimate import Batch

CHANNELS = ("hard", "soft")
PRESSED = ("contact", "done")
_SATURATED = (Status.HARD_SATURATED, Status.SOFT_SATURATED)
_MEDIAN_STEP = 0.954  # of the absolute difference of two samples, in standard deviations of the noise
_ADAPTS, _MOST = 0.03, 32  # change of the noise with each sample, relative; of so many samples of a batch at most
_BELOW_PF, _BELOW_NOISE = 0.02, 30  # below the baseline by this, and by so many times the noise
_SAME_SAMPLES = 8  # two codes of a converter are rarely the same


@dataclass(frozen=True)
class Seen:
    """What the samples of a measurement show so far.

    Attributes
    ----------
    at_s : float
        Time of the last batch on the clock; -inf: none yet.
    t_s : float
        Time of the last sample, s; nan: none yet.
    readings, noise_pF : (float, float)
        Of both channels, pF: the last reading with a value; the noise without contact. nan: not known.
    share : float or None
        Part of the running touch that is measured, 0 to 1; None: no touch, or one without a fixed length.
    left_s, contact_s, done_s : float
        Seconds to the end of the touch; in contact; in contact since the touch was complete. nan: none.
    limit_s : (float, float)
        Seconds of this contact in which each channel was at its limit.
    below_s, constant_s : (float, float)
        For how long each channel has been far below its baseline; has had the same value. 0: it is not so.
    below_pF : (float, float)
        How far below, of the last sample.
    baseline_s : float
        Time at which the baseline was measured; nan: not yet.
    """

    at_s: float = -math.inf
    t_s: float = math.nan
    readings: tuple[float, float] = (math.nan, math.nan)
    noise_pF: tuple[float, float] = (math.nan, math.nan)
    share: float | None = None
    left_s: float = math.nan
    contact_s: float = math.nan
    done_s: float = math.nan
    limit_s: tuple[float, float] = (0.0, 0.0)
    below_s: tuple[float, float] = (0.0, 0.0)
    below_pF: tuple[float, float] = (0.0, 0.0)
    constant_s: tuple[float, float] = (0.0, 0.0)
    baseline_s: float = math.nan


class Watch:
    """Follows the batches of a measurement; begins again with each new one.

    Parameters
    ----------
    clock : callable
        Seconds that only rise.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._seen = Seen()
        self._stream: Stream | None = None

    def seen_of(self, stream: Stream) -> Seen:
        """Return what the samples of this measurement show; from any thread."""
        return self._seen if stream is self._stream else Seen()

    def follow(self, batch: Batch, stream: Stream) -> None:
        """Take the next batch; in the thread of the measurement."""
        if stream is not self._stream:
            self._begin(stream)
        if len(batch.samples):
            t_s, state = batch.samples["t_hard_ns"] * 1e-9, stream.tracker.state
            self._follow_state(batch, t_s, state)
            channels = zip(self._channels, CHANNELS, _SATURATED, strict=True)
            for channel, name, flag in channels:
                channel.follow(batch, t_s, name, flag, state)
            self._seen = self._summed(float(t_s[-1]), state)

    def _begin(self, stream: Stream) -> None:
        settings = stream.tracker.settings
        self._seen, self._stream = Seen(), stream
        self._seconds, self._samples = settings.get("seconds"), settings.get("samples")
        self._channels = (_Channel(), _Channel())
        self._state, self._touch, self._count = "", 0, 0
        self._contact_s = self._touch_s = self._done_s = self._baseline_s = math.nan

    def _follow_state(self, batch: Batch, t_s: NDArray[np.float64], state: str) -> None:
        """Note when contact, touch, its completion and the baseline began."""
        last_s, before = float(t_s[-1]), self._state
        if state not in PRESSED:
            self._contact_s = math.nan
        elif before not in PRESSED:
            self._contact_s = float(t_s[0])
            for channel in self._channels:
                channel.limit_s = 0.0
        self._done_s = math.nan if state != "done" else self._done_s if before == "done" else last_s
        if state != "baseline" and (before == "baseline" or math.isnan(self._baseline_s)):
            self._baseline_s = last_s
        self._state = state
        number = int(batch.rows["touch"][-1])
        mine = np.flatnonzero(batch.rows["touch"] == number)
        if number != self._touch:
            self._touch, self._count, self._touch_s = number, 0, float(t_s[mine[0]])
        self._count += len(mine)

    def _summed(self, t_s: float, state: str) -> Seen:
        share, left_s = self._progress(t_s) if self._touch and state == "contact" else (None, math.nan)
        hard, soft = self._channels
        return Seen(
            at_s=self._clock(),
            t_s=t_s,
            readings=(hard.reading, soft.reading),
            noise_pF=(hard.noise_pF, soft.noise_pF),
            share=1.0 if state == "done" else share if share is None else round(share, 3),
            left_s=left_s,
            contact_s=t_s - self._contact_s,
            done_s=t_s - self._done_s,
            limit_s=(hard.limit_s, soft.limit_s),
            below_s=(hard.below.lasting_s(t_s), soft.below.lasting_s(t_s)),
            below_pF=(hard.below_pF, soft.below_pF),
            constant_s=(hard.constant_s(t_s), soft.constant_s(t_s)),
            baseline_s=self._baseline_s,
        )

    def _progress(self, t_s: float) -> tuple[float | None, float]:
        """Return the part of the touch that is measured, and the seconds that are left."""
        passed_s = t_s - self._touch_s
        if self._seconds:
            return min(passed_s / self._seconds, 1.0), max(self._seconds - passed_s, 0.0)
        if self._samples:
            left = max(self._samples - self._count, 0)
            return 1 - left / self._samples, left * passed_s / max(self._count - 1, 1)
        return None, math.nan


class _Lasting:
    """Since when something holds without a break."""

    def __init__(self) -> None:
        self.since_s = math.nan
        self.samples = 0

    def follow(self, holds: NDArray[np.bool_], t_s: NDArray[np.float64]) -> None:
        broken = np.flatnonzero(~holds)
        first = int(broken[-1]) + 1 if len(broken) else 0
        if len(broken):
            self.samples, self.since_s = 0, math.nan
        if first < len(holds) and not self.samples:
            self.since_s = float(t_s[first])
        self.samples += len(holds) - first

    def lasting_s(self, t_s: float, least: int = 1) -> float:
        """Return for how long it holds, s; 0: for fewer than these samples."""
        return t_s - self.since_s if self.samples >= least else 0.0


@dataclass
class _Channel:
    """What one channel shows."""

    reading: float = math.nan
    noise_pF: float = math.nan
    limit_s: float = 0.0
    below_pF: float = 0.0
    below: _Lasting = field(default_factory=_Lasting)
    _same: _Lasting = field(default_factory=_Lasting)
    _last: float = math.nan
    _last_s: float = math.nan

    def constant_s(self, t_s: float) -> float:
        return self._same.lasting_s(t_s, _SAME_SAMPLES)

    def follow(self, batch: Batch, t_s: NDArray[np.float64], name: str, flag: Status, state: str) -> None:
        values = batch.samples[name]
        limited = (batch.samples["status"] & int(flag)) != 0
        steps = np.diff(values, prepend=self._last)
        self._same.follow((steps == 0) & ~limited, t_s)
        self._follow_limit(limited, t_s, state)
        self._follow_noise(steps, state)
        self._follow_baseline(values - batch.rows[f"{name}_baseline"], limited, t_s, state)
        self._last, self._last_s = float(values[-1]), float(t_s[-1])
        if known := np.flatnonzero(np.isfinite(values)).tolist():
            self.reading = float(values[known[-1]])

    def _follow_limit(self, limited: NDArray[np.bool_], t_s: NDArray[np.float64], state: str) -> None:
        if state in PRESSED and limited.any():
            passed_s = np.diff(t_s, prepend=t_s[0] if math.isnan(self._last_s) else self._last_s)
            self.limit_s += float(passed_s[limited].sum())

    def _follow_noise(self, steps: NDArray[np.float64], state: str) -> None:
        """Noise from the median step between neighbours, so that the begin of a touch counts as a few samples."""
        sizes = np.abs(steps[np.isfinite(steps)]) / _MEDIAN_STEP
        if state in PRESSED or not len(sizes):
            return
        if not self.noise_pF > 0:
            self.noise_pF = float(np.median(sizes))
        more = 2 * float(np.mean(sizes > self.noise_pF)) - 1
        self.noise_pF *= math.exp(_ADAPTS * min(len(sizes), _MOST) * more)

    def _follow_baseline(
        self, change: NDArray[np.float64], limited: NDArray[Any], t_s: NDArray[np.float64], state: str
    ) -> None:
        margin = _BELOW_PF + _BELOW_NOISE * (0.0 if math.isnan(self.noise_pF) else self.noise_pF)
        below = (change < -margin) & ~limited if state == "waiting" else np.zeros(len(change), bool)
        self.below.follow(below, t_s)
        self.below_pF = -float(change[-1])
