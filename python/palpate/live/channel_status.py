"""What the newest samples show beside the estimate: followed in the thread of the measurement, read from any other."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate import number_format
from palpate.ad7746.registers import NOISE_PF
from palpate.live.measurement import PRESSED, LiveMeasurement
from palpate.samples import Status
from palpate.sources import Gap, GapCause
from palpate.stream import Batch, Listener, Stream
from palpate.tracking import has_given_baseline

CHANNELS = ("hard", "soft")
_SATURATED = {"hard": Status.HARD_SATURATED, "soft": Status.SOFT_SATURATED}
# of the absolute difference of two samples, in standard deviations of the noise
_MEDIAN_STEP = 0.954
_ADAPTS = 0.03  # change of the noise with each sample, relative
_MOST = 32  # samples of a batch that change it
_BELOW_PF = 0.02  # a channel is far below the baseline: by this,
_BELOW_NOISE = 30  # and by this many times the noise
_SAME_SAMPLES = 8  # two codes of a converter are rarely the same
# A touch while the baseline is measured, in multiples of the usual noise:
_MOVES = 50  # one channel moves by this,
_BOTH_MOVE = 10  # and both by this
_FIRST = 32  # values of a baseline
_FEWEST = 12  # with fewer of them it is not judged
_MOST_AGAIN = 600  # times that it is measured again for it: a recording has a mark of each
_QUARTILES = 1.35  # their distance, in standard deviations


@dataclass(frozen=True)
class ChannelSeen:
    """What the samples of one channel show so far."""

    name: str
    reading: float = math.nan  # pF, the last with a value
    noise_pF: float = math.nan  # without contact
    limit_s: float = 0.0  # time of this contact at the limit
    below_s: float = 0.0  # far below the baseline for this time; 0: it is not
    below_pF: float = 0.0  # how far, of the last sample
    idle_s: float = 0.0  # at its baseline for this time; 0: it is not
    constant_s: float = 0.0  # the same value for this time; 0: it is not


@dataclass(frozen=True)
class SignalSeen:
    """What the samples of a measurement show so far."""

    channels: tuple[ChannelSeen, ChannelSeen] = (ChannelSeen("hard"), ChannelSeen("soft"))
    at_s: float = -math.inf  # time of the last batch on the clock; -inf: none yet
    # part of the running touch that is measured; None: no touch, or one without a length
    share: float | None = None
    left_s: float = math.nan  # to the end of the touch
    contact_s: float = 0.0  # in contact for this time; 0: it is not
    done_s: float = 0.0  # in contact for this time since the touch was complete; 0: it is not
    baseline_s: float = math.nan  # time at which the baseline was measured
    touching: str = ""  # what shows that something touches while the baseline is measured


class SignalFollower(Listener):
    """Follows the batches of a measurement; begins again with each new one. `clock`: seconds that only rise.

    A baseline that was measured in contact is measured again: the first one, one after a gap, and one after a tare that
    was not forced.
    """

    def __init__(
        self, measurement: LiveMeasurement, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.seen = SignalSeen()
        self._measurement = measurement
        self._clock = clock

    def begun(self, stream: Stream) -> None:
        """Begin with the next measurement."""
        self._stream = stream
        self._tracker = stream.tracker
        device = stream.source.describe()
        capf = (device.get("configuration") or {}).get("capf")
        self._converter_pF = math.nan if capf is None else NOISE_PF[capf]
        self._first = np.empty((0, 2))  # values of the baseline that is measured
        self._touching = ""
        self._level = np.full(2, math.nan)  # of the last good baseline
        self._range: list[object] = []  # where its range was
        self._guards = True  # the next baseline is judged
        self._again = 0  # times that it was measured again
        self._measurement.forced = False
        self._sign = -1.0 if self._tracker.settings.get("falling") else 1.0
        self._is_given = has_given_baseline(self._tracker)
        self._channels = [ChannelFollower(name, self._sign) for name in CHANNELS]
        self._contact = LastingCondition()
        self._done = LastingCondition()
        self._state = ""
        self._touch = 0  # number of the touch
        self._count = 0  # samples of it
        self._touch_s = math.nan
        self._baseline_s = math.nan
        self.seen = SignalSeen()

    def gap(self, gap: Gap) -> None:
        """Judge the baseline after a gap; over a pause of the computer the level may have moved far."""
        self._guards = True
        self._measurement.forced = False
        self._first = self._first[:0]
        if gap.cause in (GapCause.SLEPT, GapCause.STOPPED, GapCause.CLOCK_SET):
            self._level = np.full(2, math.nan)

    def batch(self, batch: Batch) -> None:
        """Take the next batch."""
        if not len(batch.samples):
            return
        self._judge(batch)
        t_s = batch.samples["t_hard_ns"] * 1e-9
        state = self._tracker.state
        self._follow_state(batch, t_s, state)
        hard, soft = (channel.follow(batch, t_s, state) for channel in self._channels)
        share, left_s = self._progress(float(t_s[-1]), state)
        self.seen = SignalSeen(
            (hard, soft),
            self._clock(),
            share,
            left_s,
            contact_s=self._contact.follow(np.full(len(t_s), state in PRESSED), t_s),
            done_s=self._done.follow(np.full(len(t_s), state == "done"), t_s),
            baseline_s=self._baseline_s,
            touching=self._touching,
        )

    def _judge(self, batch: Batch) -> None:
        """Look at the first values of a baseline; where something touches, measure it again."""
        before = self._state
        state = self._tracker.state
        if state == "baseline" and before != "baseline":
            self._first = self._first[:0]
            self._guards |= before == "waiting"
        if "baseline" not in (before or "baseline", state):
            self._level = np.array([batch.rows[f"{name}_baseline"][-1] for name in CHANNELS])
            return
        values = np.column_stack([batch.samples[name] for name in CHANNELS])
        self._first = np.concatenate([self._first, values])[-_FIRST:]
        is_open = self._guards and not self._measurement.forced and not self._is_given
        found = ""
        if is_open:
            found = self._found()
        if state == "baseline":
            self._touching = found or self._touching
        elif found and state == "waiting":
            self._touching = found
            self._again += 1
            if self._again <= _MOST_AGAIN:
                self._stream.tare(force=True)
        else:
            self._guards = False
            self._touching = ""
            self._again = 0
            self._range = self._range_now()

    def _range_now(self) -> list[object]:
        """Return what moves the level without a contact: the range of the converter, and another chip."""
        device = self._stream.source.describe()
        return [device.get("configuration"), device.get("fingerprint")]

    def _found(self) -> str:
        """Return what shows that something touches; "": nothing."""
        known = self._first[np.isfinite(self._first).all(axis=1)]
        usual = np.fmax(self._converter_pF, [channel.seen.noise_pF for channel in self._channels])
        if len(known) < _FEWEST:
            return ""
        low, high = np.quantile(known, [0.25, 0.75], axis=0)
        spread = (high - low) / _QUARTILES
        times = spread / usual
        if times.max() > _MOVES and times.min() > _BOTH_MOVE:
            most = int(times.argmax())
            size = number_format.number(1e3 * float(spread[most]))
            noise = number_format.number(float(times[most]))
            return f"the {CHANNELS[most]} channel moves by {size} fF, {noise} times its noise"
        change = np.median(known, axis=0) - self._level
        least = _BELOW_PF + _BELOW_NOISE * np.nan_to_num(usual)
        if self._range == self._range_now() and (self._sign * change > least).all():
            side = "above" if self._sign > 0 else "below"
            return f"hard {change[0]:+.2f} pF, soft {change[1]:+.2f} pF {side} the baseline before"
        return ""

    def _follow_state(self, batch: Batch, t_s: NDArray[np.float64], state: str) -> None:
        """Note when the touch began, and when its baseline was measured."""
        before = self._state
        self._state = state
        if state != "baseline" and (before == "baseline" or math.isnan(self._baseline_s)):
            self._baseline_s = float(t_s[-1])
        number = int(batch.rows["touch"][-1])
        mine = np.flatnonzero(batch.rows["touch"] == number)
        if number > self._touch:
            self._measurement.forced = False
        if number != self._touch:
            self._touch = number
            self._count = 0
            self._touch_s = float(t_s[mine[0]])
        self._count += len(mine)

    def _progress(self, t_s: float, state: str) -> tuple[float | None, float]:
        """Return the part of the touch that is measured, and the seconds that are left."""
        if state == "done":
            return 1.0, math.nan
        if not self._touch or state != "contact":
            return None, math.nan
        passed_s = t_s - self._touch_s
        settings = self._tracker.settings
        seconds = settings.get("seconds")
        if seconds:
            return round(min(passed_s / seconds, 1.0), 3), max(seconds - passed_s, 0.0)
        samples = settings.get("samples")
        if samples:
            left = max(samples - self._count, 0)
            period_s = passed_s / max(self._count - 1, 1)
            return round(1 - left / samples, 3), left * period_s
        return None, math.nan


class LastingCondition:
    """Since when something holds without a break."""

    def __init__(self) -> None:
        self.since_s = math.nan
        self.samples = 0

    def follow(self, holds: NDArray[np.bool_], t_s: NDArray[np.float64], least: int = 1) -> float:
        """Return for how long it holds, s; 0: for fewer than these samples."""
        broken = np.flatnonzero(~holds)
        first = 0
        if len(broken):
            first = int(broken[-1]) + 1
            self.samples = 0
        if first < len(holds) and not self.samples:
            self.since_s = float(t_s[first])
        self.samples += len(holds) - first
        if self.samples < least:
            return 0.0
        return float(t_s[-1]) - self.since_s


class ChannelFollower:
    """Follows one channel; `sign`: of its change when it is pressed."""

    def __init__(self, name: str, sign: float) -> None:
        self._sign = sign
        self.seen = ChannelSeen(name)
        self._below = LastingCondition()
        self._idle = LastingCondition()
        self._same = LastingCondition()
        self._last = math.nan  # value of the last sample
        self._last_s = math.nan  # its time

    def follow(self, batch: Batch, t_s: NDArray[np.float64], state: str) -> ChannelSeen:
        """Take the next batch; return what is seen."""
        name = self.seen.name
        before = self.seen
        values = batch.samples[name]
        is_limited = (batch.samples["status"] & int(_SATURATED[name])) != 0
        change = values - batch.rows[f"{name}_baseline"]
        steps = np.diff(values, prepend=self._last)
        last_s = t_s[0] if math.isnan(self._last_s) else self._last_s
        passed_s = np.diff(t_s, prepend=last_s)
        self._last = float(values[-1])
        self._last_s = float(t_s[-1])
        noise_pF = before.noise_pF
        if state == "waiting":
            noise_pF = _adapted(noise_pF, steps)
        reading = before.reading
        known = values[np.isfinite(values)]
        if len(known):
            reading = float(known[-1])
        limit_s = 0.0
        if state in PRESSED:
            limit_s = before.limit_s + float(passed_s[is_limited].sum())
        margin = _BELOW_PF + _BELOW_NOISE * np.nan_to_num(noise_pF)
        is_below = (self._sign * change < -margin) & ~is_limited & (state == "waiting")
        is_idle = (np.abs(change) < margin) & ~is_limited
        is_same = (steps == 0) & ~is_limited
        self.seen = ChannelSeen(
            name,
            reading,
            noise_pF,
            limit_s,
            self._below.follow(is_below, t_s),
            -self._sign * float(change[-1]),
            self._idle.follow(is_idle, t_s),
            self._same.follow(is_same, t_s, _SAME_SAMPLES),
        )
        return self.seen


def _adapted(noise_pF: float, steps: NDArray[np.float64]) -> float:
    """Return the noise by the median step between neighbours, so that the begin of a touch counts as a few samples."""
    sizes = np.abs(steps[np.isfinite(steps)]) / _MEDIAN_STEP
    if not len(sizes):
        return noise_pF
    if not noise_pF > 0:
        noise_pF = float(np.median(sizes))
    more = 2 * float(np.mean(sizes > noise_pF)) - 1
    return noise_pF * math.exp(_ADAPTS * min(len(sizes), _MOST) * more)
