"""What the newest samples show beside the estimate: followed in the thread of the measurement, read from any other."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

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
_MEDIAN_STEP = (
    0.954  # of the absolute difference of two samples, in standard deviations of the noise
)
# change of the noise with each sample, relative; of so many samples of a batch at most
_ADAPTS, _MOST = (0.03, 32)
_BELOW_PF, _BELOW_NOISE = 0.02, 30  # below the baseline by this, and by so many times the noise
_SAME_SAMPLES = 8  # two codes of a converter are rarely the same
# A touch while the baseline is measured: one channel moves by so many times its usual noise, and both by so many.
_MOVES, _BOTH_MOVE = 50, 10
_FIRST, _FEWEST = 32, 12  # values of a baseline; with fewer of them it is not judged
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
    constant_s: float = 0.0  # the same value for this time; 0: it is not


@dataclass(frozen=True)
class SignalSeen:
    """What the samples of a measurement show so far."""

    channels: tuple[ChannelSeen, ChannelSeen] = (ChannelSeen("hard"), ChannelSeen("soft"))
    at_s: float = -math.inf  # time of the last batch on the clock; -inf: none yet
    share: float | None = (
        None  # part of the running touch that is measured; None: no touch, or one without a length
    )
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
        self._measurement, self._clock = measurement, clock

    def begun(self, stream: Stream) -> None:
        """Begin with the next measurement."""
        self._stream, self._tracker = stream, stream.tracker
        capf = (stream.source.describe().get("configuration") or {}).get("capf")
        self._converter_pF = math.nan if capf is None else NOISE_PF[capf]
        self._first, self._touching = np.empty((0, 2)), ""
        self._level = np.full(2, math.nan)  # of the last good baseline
        self._range = list[Any]()  # where its range was
        self._guards, self._again, self._measurement.forced = True, 0, False
        self._sign = -1.0 if self._tracker.settings.get("falling") else 1.0
        self._is_given = has_given_baseline(self._tracker)
        self._channels = _Channel("hard", self._sign), _Channel("soft", self._sign)
        self._contact, self._done = _Lasting(), _Lasting()
        self._state, self._touch, self._count = "", 0, 0  # the count: samples of the touch
        self._touch_s = self._baseline_s = math.nan
        self.seen = SignalSeen()

    def gap(self, gap: Gap) -> None:
        """Judge the baseline after a gap; over a pause of the computer the level may have moved far."""
        self._guards, self._measurement.forced = True, False
        self._first = self._first[:0]
        if gap.cause in (GapCause.SLEPT, GapCause.STOPPED, GapCause.CLOCK_SET):
            self._level = np.full(2, math.nan)

    def batch(self, batch: Batch) -> None:
        """Take the next batch."""
        if not len(batch.samples):
            return
        self._judge(batch)
        t_s, state = batch.samples["t_hard_ns"] * 1e-9, self._tracker.state
        self._follow_state(batch, t_s, state)
        hard, soft = (channel.follow(batch, t_s, state) for channel in self._channels)
        contact_s = self._contact.follow(np.full(len(t_s), state in PRESSED), t_s)
        done_s = self._done.follow(np.full(len(t_s), state == "done"), t_s)
        times = (*self._progress(float(t_s[-1]), state), contact_s, done_s, self._baseline_s)
        self.seen = SignalSeen((hard, soft), self._clock(), *times, self._touching)

    def _judge(self, batch: Batch) -> None:
        """Look at the first values of a baseline; where something touches, measure it again."""
        before, state = self._state, self._tracker.state
        if state == "baseline" and before != "baseline":
            self._first = self._first[:0]
            self._guards |= before == "waiting"
        if "baseline" not in (before or "baseline", state):
            self._level = np.array([batch.rows[f"{name}_baseline"][-1] for name in CHANNELS])
            return
        values = np.column_stack([batch.samples[name] for name in CHANNELS])
        self._first = np.concatenate([self._first, values])[-_FIRST:]
        is_open = self._guards and not self._measurement.forced and not self._is_given
        found = self._found() if is_open else ""
        if state == "baseline":
            self._touching = found or self._touching
        elif found and state == "waiting":
            self._touching, self._again = found, self._again + 1
            if self._again <= _MOST_AGAIN:
                self._stream.tare(force=True)
        else:
            self._guards, self._touching, self._again = False, "", 0
            self._range = self._range_now()

    def _range_now(self) -> list[Any]:
        """Return what moves the level without a contact: the range of the converter, and another chip."""
        device = self._stream.source.describe()
        return [device.get(name) for name in ("configuration", "fingerprint")]

    def _found(self) -> str:
        """Return what shows that something touches; "": nothing."""
        known = self._first[np.isfinite(self._first).all(axis=1)]
        usual = np.fmax(self._converter_pF, [channel.seen.noise_pF for channel in self._channels])
        if len(known) < _FEWEST:
            return ""
        spread = np.subtract(*np.quantile(known, [0.75, 0.25], axis=0)) / _QUARTILES
        times, change = spread / usual, np.median(known, axis=0) - self._level
        if times.max() > _MOVES and times.min() > _BOTH_MOVE:
            most = int(times.argmax())
            size, noise = (
                number_format.number(1e3 * float(spread[most])),
                number_format.number(float(times[most])),
            )
            return f"the {CHANNELS[most]} channel moves by {size} fF, {noise} times its noise"
        if (
            self._range == self._range_now()
            and (self._sign * change > _BELOW_PF + _BELOW_NOISE * np.nan_to_num(usual)).all()
        ):
            side = "above" if self._sign > 0 else "below"
            return f"hard {change[0]:+.2f} pF, soft {change[1]:+.2f} pF {side} the baseline before"
        return ""

    def _follow_state(self, batch: Batch, t_s: NDArray[np.float64], state: str) -> None:
        """Note when the touch began, and when its baseline was measured."""
        before, self._state = self._state, state
        if state != "baseline" and (before == "baseline" or math.isnan(self._baseline_s)):
            self._baseline_s = float(t_s[-1])
        number = int(batch.rows["touch"][-1])
        mine = np.flatnonzero(batch.rows["touch"] == number)
        if number > self._touch:
            self._measurement.forced = False
        if number != self._touch:
            self._touch, self._count, self._touch_s = number, 0, float(t_s[mine[0]])
        self._count += len(mine)

    def _progress(self, t_s: float, state: str) -> tuple[float | None, float]:
        """Return the part of the touch that is measured, and the seconds that are left."""
        passed_s, settings = t_s - self._touch_s, self._tracker.settings
        if state == "done":
            return 1.0, math.nan
        if not self._touch or state != "contact":
            return None, math.nan
        if seconds := settings.get("seconds"):
            return round(min(passed_s / seconds, 1.0), 3), max(seconds - passed_s, 0.0)
        if samples := settings.get("samples"):
            left = max(samples - self._count, 0)
            return round(1 - left / samples, 3), left * passed_s / max(self._count - 1, 1)
        return None, math.nan


class _Lasting:
    """Since when something holds without a break."""

    def __init__(self) -> None:
        self.since_s, self.samples = math.nan, 0

    def follow(self, holds: NDArray[np.bool_], t_s: NDArray[np.float64], least: int = 1) -> float:
        """Return for how long it holds, s; 0: for fewer than these samples."""
        broken = np.flatnonzero(~holds)
        first = int(broken[-1]) + 1 if len(broken) else 0
        if len(broken):
            self.samples = 0
        if first < len(holds) and not self.samples:
            self.since_s = float(t_s[first])
        self.samples += len(holds) - first
        return float(t_s[-1]) - self.since_s if self.samples >= least else 0.0


class _Channel:
    """Follows one channel; `sign`: of its change when it is pressed."""

    def __init__(self, name: str, sign: float) -> None:
        self._sign = sign
        self.seen = ChannelSeen(name)
        self._below, self._same = _Lasting(), _Lasting()
        self._last = self._last_s = math.nan  # value and time of the last sample

    def follow(self, batch: Batch, t_s: NDArray[np.float64], state: str) -> ChannelSeen:
        """Take the next batch; return what is seen."""
        name, before = self.seen.name, self.seen
        values, limited = (
            batch.samples[name],
            (batch.samples["status"] & int(_SATURATED[name])) != 0,
        )
        change = values - batch.rows[f"{name}_baseline"]
        steps = np.diff(values, prepend=self._last)
        passed_s = np.diff(t_s, prepend=t_s[0] if math.isnan(self._last_s) else self._last_s)
        noise_pF = _adapted(before.noise_pF, steps) if state == "waiting" else before.noise_pF
        margin = _BELOW_PF + _BELOW_NOISE * np.nan_to_num(noise_pF)
        known = values[np.isfinite(values)]
        self._last, self._last_s = float(values[-1]), float(t_s[-1])
        self.seen = ChannelSeen(
            name,
            float(known[-1]) if len(known) else before.reading,
            noise_pF,
            before.limit_s + float(passed_s[limited].sum()) if state in PRESSED else 0.0,
            self._below.follow(
                (self._sign * change < -margin) & ~limited & (state == "waiting"), t_s
            ),
            -self._sign * float(change[-1]),
            self._same.follow((steps == 0) & ~limited, t_s, _SAME_SAMPLES),
        )
        return self.seen


def _adapted(noise_pF: float, steps: NDArray[np.float64]) -> float:
    """Return the noise by the median step between neighbours, so that the begin of a touch counts as a few samples."""
    sizes = np.abs(steps[np.isfinite(steps)]) / _MEDIAN_STEP
    if not len(sizes):
        return noise_pF
    noise_pF = noise_pF if noise_pF > 0 else float(np.median(sizes))
    more = 2 * float(np.mean(sizes > noise_pF)) - 1
    return noise_pF * math.exp(_ADAPTS * min(len(sizes), _MOST) * more)
