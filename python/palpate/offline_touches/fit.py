"""The ratio of a touch from its readings: instrumental variables, without spikes and lag."""

import math
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from palpate import number_format
from palpate.touch import Touch
from palpate.touch_readings.channel_readings import Array, Mask, Readings, Rows, median_size
from palpate.touch_readings.idle import IdleLevel, variance_of_sum
from palpate.touch_readings.stiffening import Stiffening
from palpate.touch_readings.sweep import Sweep
from palpate.touch_readings.windows import FEWEST, HARD, SOFT, Aligned, Windows, aligned

Levels = tuple[IdleLevel, IdleLevel]

METHOD = f"offline: matched pair of {HARD} + {SOFT} points"
"""Name of the method."""
_ROUNDS = 11  # of leaving out readings, and of removing a lag
_OUTLIER = 6.0
_MAD = 1.4826  # standard deviation / median of the absolute values
_PROVEN = 8.0  # standard errors of a lag that is removed
_BATCHES = 16
_FLANK = 3  # windows
_FLANK_SHARES = (0.2, 0.8)  # of the height
_LEAST = 0.001  # change from the flanks to the height, share


@dataclass(frozen=True, kw_only=True)
class OfflineTouch:
    """A touch estimated offline, with its live result.

    Attributes
    ----------
    ratio, standard_error : float
        Of this method; nan if it has no result.
    method : str
        Its name; without a result, the reason.
    baselines : str
        "before and after", "before" or "after": which idle readings it used; "given"; empty without a
        result.
    samples : int
        Pairs used.
    covariance : float
        Unscaled covariance of the ratio, 1/pF^2.
    start_s, stop_s : float
        First and last reading used, s: if the ratio changed, those after the last change.
    left_out : int
        Readings left out as spikes.
    lag_s : float
        Delay of the soft channel, or of its times, s: removed; 0 if not significant.
    live : Touch
        The touch as the tracker found it; its flags hold here, too.
    level_ratio, level_standard_error : float
        As of `Touch`, for any exponent of the contact; nan if there is none.
    stiffening : palpate.touch_readings.stiffening.Stiffening or None
        How much the ratio grows with depth; None: the touch does not show it.
    sweep : palpate.touch_readings.sweep.Sweep or None
        The pairs of the level ratio.
    """

    ratio: float = math.nan
    standard_error: float = math.nan
    method: str = METHOD
    baselines: str = ""
    samples: int = 0
    covariance: float = math.nan
    start_s: float
    stop_s: float = math.nan
    left_out: int = 0
    lag_s: float = 0.0
    live: Touch
    level_ratio: float = math.nan
    level_standard_error: float = math.nan
    stiffening: Stiffening | None = None
    sweep: Sweep | None = field(default=None, repr=False, compare=False)

    def level(self, contact_exponent: float) -> tuple[float, float]:
        """Return the level ratio with another exponent, and its standard error; nan: none."""
        if self.sweep is None:
            return math.nan, math.nan
        return self.sweep.result(self.live.ratio, contact_exponent)

    @property
    def flags(self) -> tuple[str, ...]:
        """Warnings about the touch: the flags of `live`."""
        return self.live.flags

    @property
    def alarm_share(self) -> float:
        """Share of the samples of `live` with the alarm on."""
        return self.live.alarm_share

    def as_dict(self) -> dict[str, Any]:
        """Return all fields but `live` as a dict of plain values; nan and inf become None."""
        values = dict(self.__dict__)
        del values["live"]
        del values["sweep"]
        values["stiffening"] = self.stiffening and number_format.plain(asdict(self.stiffening))
        return number_format.plain(values)


def fit_ratio(touch: Touch, hard: Readings, soft: Readings, levels: Levels) -> OfflineTouch | None:
    """Return a touch with the ratio of the changes of both channels; None: too few pairs."""
    # r = sum z y / sum z x. In rounds: a lag of the soft channel, y = r (x + lag x'), is removed
    # from its times where it is significant; then of the windows that are 6 standard deviations
    # off, in each run of them, the reading that explains most is left out.
    lag = 0.0
    left_out = 0
    whole = None
    for number in range(_ROUNDS + 1):
        pairs = aligned(hard, soft)
        if pairs is None or not pairs.high.any():
            break
        high = pairs.high
        ratio = float(np.median(pairs.y[high] / pairs.x[high]))
        more = _lag(pairs, ratio)
        bad = np.abs(pairs.rest(ratio)) > _OUTLIER * _scale(pairs, ratio, levels)
        is_clean = more == 0 and not bad.any()
        if is_clean or number == _ROUNDS:
            used = pairs.good & ~bad
            if np.count_nonzero(used) < FEWEST:
                break
            found = _solved(touch, pairs, used, whole or pairs, levels)
            return replace(found, left_out=left_out, lag_s=lag)
        if more:
            soft = replace(soft, t=soft.t - more)
            lag += more
            continue
        whole = whole or pairs
        keep_hard, keep_soft = _without_spikes(pairs, ratio, np.flatnonzero(bad))
        left_out += int(np.count_nonzero(~keep_hard) + np.count_nonzero(~keep_soft))
        hard = hard[keep_hard]
        soft = soft[keep_soft]
    return None


def _lag(pairs: Aligned, ratio: float) -> float:
    """Return how late the soft channel is, s; 0 if that is not significant."""
    rest = pairs.rest(ratio)
    spread = _MAD * median_size(rest[pairs.good])
    near = pairs.good & (np.abs(rest) <= _OUTLIER * spread)
    if np.count_nonzero(near) < FEWEST:
        return 0.0
    slope = np.gradient(pairs.x, pairs.t)[near]
    squares = float(slope @ slope)
    if squares == 0 or ratio == 0:
        return 0.0
    late = float(slope @ rest[near]) / squares
    left = rest[near] - late * slope
    error = float(np.linalg.norm(slope * left)) / squares
    if abs(late) > _PROVEN * error:
        return late / ratio
    return 0.0


def _scale(pairs: Aligned, ratio: float, levels: Levels) -> float:
    """Return the scatter of the windows, at least by the noise of their readings."""
    seen = _MAD * median_size(pairs.rest(ratio)[pairs.good])
    hard, soft = levels
    hard2 = hard.noise**2 * (pairs.hard.weight**2).sum(axis=1)
    soft2 = (ratio * soft.noise) ** 2 * (pairs.soft.weight**2).sum(axis=1)
    noise2 = float(np.median(hard2 + soft2))
    return max(seen, math.sqrt(noise2))


def _without_spikes(pairs: Aligned, ratio: float, bad: Rows) -> tuple[Mask, Mask]:
    """Return masks of the readings to keep.

    Of each run of bad windows, they leave out the reading that explains most.
    """
    rest = pairs.rest(ratio)
    keep_hard = np.ones(len(pairs.hard.readings.t), bool)
    keep_soft = np.ones(len(pairs.soft.readings.t), bool)
    by_hard = _explained(pairs.hard, rest)
    by_soft = _explained(pairs.soft, rest)
    run_starts = np.flatnonzero(np.diff(bad) > 1) + 1
    for run in np.split(bad, run_starts):
        hard_at = pairs.hard.at[run]
        soft_at = pairs.soft.at[run]
        if by_soft[soft_at].max() > by_hard[hard_at].max():
            _leave_out_largest(keep_soft, by_soft, soft_at)
        else:
            _leave_out_largest(keep_hard, by_hard, hard_at)
    return keep_hard, keep_soft


def _leave_out_largest(keep: Mask, explained: Array, at: Rows) -> None:
    inside = np.unique(at)
    keep[inside[np.argmax(explained[inside])]] = False


def _explained(channel: Windows, rest: Array) -> Array:
    """Return the part of the sum of squares that an error of each reading explains."""
    squared = replace(channel, weight=channel.weight**2)
    squares = squared.spread(np.ones(len(rest)))
    return channel.spread(rest) ** 2 / np.where(squares > 0, squares, 1)


def _solved(
    touch: Touch, pairs: Aligned, used: Mask, whole: Aligned, levels: Levels
) -> OfflineTouch:
    """Return the result from some windows; `whole`: the pairs before readings were left out."""
    hard_level, soft_level = levels
    z = np.where(used, pairs.z, 0)
    size = float(z @ pairs.x)
    ratio = float(z @ pairs.y) / size
    # ratio = truth + sum of each reading's error times its weight: exact, as windows are linear.
    hard = pairs.hard.spread(z) / size
    soft = -pairs.soft.spread(z) * ratio / size
    of_hard = hard_level.noise**2 * float(hard @ hard)
    of_soft = soft_level.noise**2 * float(soft @ soft)
    of_readings = of_hard + of_soft
    scores = (z * pairs.rest(ratio))[used] / size
    batches = max(min(_BATCHES, len(scores) // 4), 2)
    seen = variance_of_sum(scores, batches, freedom=batches - 1)
    of_levels = _of_levels(hard, soft, pairs, levels)
    of_flanks = _flank_error(whole, ratio, levels)
    variance = max(of_readings, seen) + of_levels + of_flanks**2
    baselines = hard_level.side
    if soft_level.side != hard_level.side:
        baselines = f"{hard_level.side} (hard), {soft_level.side} (soft)"
    times = pairs.hard.readings.t[pairs.hard.at[used]]
    return OfflineTouch(
        ratio=ratio,
        standard_error=math.sqrt(variance),
        baselines=baselines,
        samples=len(scores),
        covariance=1 / size,
        start_s=float(times.min()),
        stop_s=float(times.max()),
        live=touch,
    )


def _flank_error(pairs: Aligned, ratio: float, levels: Levels) -> float:
    """Return twice the change of the ratio from the flanks of the touch to its height.

    It is 0 if it is not significant.
    """
    # An offset or a curve causes it. At half of the height, the change by an offset is the error
    # of the result; a curve has half of its change as error.
    size = np.abs(pairs.x)
    height = size / median_size(pairs.x[pairs.high])
    low, high = _FLANK_SHARES
    flank = pairs.good & (height > low) & (height < high)
    count = np.count_nonzero(flank)
    if count < _FLANK:
        return 0.0
    x = pairs.x[flank]
    change = float(np.median(pairs.y[flank] / x)) - ratio
    noise = 1.25 * _scale(pairs, ratio, levels) / median_size(x)
    error = noise / math.sqrt(count)
    if abs(change) > _PROVEN * error and abs(change) > _LEAST * abs(ratio):
        return 2 * change
    return 0.0


def _of_levels(hard: Array, soft: Array, pairs: Aligned, levels: Levels) -> float:
    """Return the variance of the ratio by the baselines, from the weights of the readings in it.

    A significant drift of the baselines adds 1/16 of the squared shift that it causes.
    """
    # As in the live result, for a drift of more than 3 standard errors: half of the correction is
    # open for a jump, a quarter for an exponential.
    variance = 0.0
    shift = 0.0
    shift_variance = 0.0
    channels = (pairs.hard.readings, pairs.soft.readings)
    for weight, readings, level in zip((hard, soft), channels, levels, strict=True):
        first = level.variance[0]
        last = level.variance[-1]
        late = float(weight @ level.share(readings.t))
        early = float(weight.sum()) - late
        variance += early**2 * first + late**2 * last
        shift += late * (level.value[-1] - level.value[0])
        shift_variance += late**2 * (first + last)
    if shift**2 > 9 * shift_variance:
        variance += shift**2 / 16
    return float(variance)


_KNOWN = 4  # pairs of a part whose ratio can be compared
_AGREE = 5.0  # standard errors between two parts


def since_change(pairs: Aligned, alarms: Rows) -> int | None:
    """Return the row with which the part since the last change begins; None: it is too short."""
    # An alarm is a change only if the ratios on both sides of it differ: noise of a burst alarms,
    # too. From the last part back, parts are joined as long as they agree; one that is too short
    # to be compared joins with the one before it.
    high = pairs.high
    ratios = pairs.y[high] / pairs.x[high]
    edges = np.searchsorted(pairs.row[high], alarms + 1)
    parts = np.split(ratios, edges)
    starts = np.append(pairs.hard.readings.row[0], alarms + 1)
    known = [i for i, part in enumerate(parts) if len(part) >= _KNOWN]
    if not known:
        return None
    begin = known.pop()
    joined = parts[begin]
    tail = np.concatenate([joined[:0], *parts[begin + 1 :]])
    if len(tail):
        difference = np.median(tail) - np.median(joined)
        if abs(difference) > _OUTLIER * _spread(joined):
            return None
    while known and _agree(parts[known[-1]], joined):
        begin = known.pop()
        joined = np.concatenate([parts[begin], joined])
    return int(starts[begin])


def _spread(ratios: Array) -> float:
    return _MAD * median_size(ratios - np.median(ratios))


def _agree(one: Array, other: Array) -> bool:
    """Return whether two medians agree.

    Their errors are 1.25 spread / sqrt(n), and 1.5 times for neighbours alike.
    """
    error = 1.9 * _spread(one) / np.sqrt(len(one))
    other_error = 1.9 * _spread(other) / np.sqrt(len(other))
    difference = abs(np.median(one) - np.median(other))
    return bool(difference <= _AGREE * np.hypot(error, other_error))
