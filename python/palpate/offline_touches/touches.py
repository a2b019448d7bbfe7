"""Touches of a recording, estimated offline: with more points, all idle readings, and without spikes."""

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from palpate import number_format
from palpate.offline_touches.fit import HARD, SOFT, aligned, fit_ratio, since_change
from palpate.offline_touches.idle import IdleLevel, Readings, idle, level_of, pause
from palpate.offline_touches.sweep import Sweep, sweep
from palpate.recording_protocol import RecordingProtocol, require_recording
from palpate.touch import Touch
from palpate.tracking import Fed, feed_recording, tracker_of

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene


Array = NDArray[np.float64]
_REACH = 16  # rows on either side
_PAUSE = 8.0  # periods


def smooth(t: Array) -> Array:
    """Return times, shape (n,), n at least 2, each replaced by the mean over up to 16 rows on either side."""
    # For readings at an even rate that is the middle of a straight line through them. A pause is not smoothed.
    out = np.empty_like(t)
    steps = np.abs(np.diff(t))
    pauses = np.flatnonzero(steps > _PAUSE * np.median(steps)) + 1
    for rows in np.split(np.arange(len(t)), pauses):
        part = t[rows] - t[rows[0]]
        sums = np.append(0, np.cumsum(part))
        place = np.arange(len(rows))
        reach = np.minimum(_REACH, np.minimum(place, place[::-1]))
        out[rows] = t[rows[0]] + (sums[place + reach + 1] - sums[place - reach]) / (2 * reach + 1)
    return out


METHOD = f"offline: matched pair of {HARD} + {SOFT} points"
"""Name of the method."""


@dataclass(frozen=True)
class OfflineTouch:
    """A touch estimated offline, with its live result.

    Attributes
    ----------
    ratio, standard_error : float
        Of this method; nan if it has no result.
    method : str
        Its name; without a result, the reason.
    baselines : str
        "before and after", "before" or "after": which idle readings it used; empty without a result.
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
    sweep : palpate.offline_touches.sweep.Sweep or None
        The pairs of the level ratio.
    """

    ratio: float
    standard_error: float
    method: str
    baselines: str
    samples: int
    covariance: float
    start_s: float
    stop_s: float
    left_out: int
    lag_s: float
    live: Touch
    level_ratio: float = math.nan
    level_standard_error: float = math.nan
    sweep: Sweep | None = field(default=None, repr=False, compare=False)

    def level(self, contact_exponent: float) -> tuple[float, float]:
        """Return the level ratio with another exponent, and its standard error; nan: there is none."""
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
        return number_format.plain(
            {name: value for name, value in self.__dict__.items() if name not in ("live", "sweep")}
        )


def offline(
    recording: RecordingProtocol,
    *,
    scene: "_Scene" = "handheld",
    **settings: Unpack["_AnySettings"],
) -> list[OfflineTouch]:
    """Return the touches of a recording, each estimated again with the whole recording known.

    The tracker finds the touches, as in `palpate.touches`. Then the readings of each one, from its beginning or from
    the last change of its ratio to its end, are estimated by another method:

    - a matched pair of filters of 5 + 6 points around each hard reading, designed for the real times of its readings;
    - instrumental variables, r = sum z y / sum z x, z the mean of the soft readings around the readings of x: no bias in
      a light touch;
    - single readings that contradict their neighbours are left out, and windows with gaps; a constant lag of the soft channel
      (or of its times) is removed;
    - the baseline is the line between the means of the idle readings of up to 4 s before and after: only before, if the
      live result has the flag "creep", only after with the flag "baseline"; never across a gap or a tare.

    The standard error is made of the noise of the readings or the scatter of the parts of the touch, whichever is
    larger, of the baselines, and of a difference of the ratio on the flanks. With a flag that the readings
    contradict hard = ratio * soft it is not below the live one. With the flag "drift" the ratio is a mean over
    the touch; the live ratio is nearer to its end.

    The level ratio is the slope of hard^(1/p) against soft^(1/p) over rise, hold and fall, to the power p.

    Parameters
    ----------
    recording : Recording, Simulation, or the result of `palpate.recorded`
        As in `palpate.touches`; it is kept in memory as a whole.
    scene : str
        As in `Tracker`; not "fixed".
    **settings
        As in `Tracker`; but `contact_exponent`, p of force ~ depth^p, is any number from 1 (flat bumps, the default) to 3.

    Returns
    -------
    list of OfflineTouch
        One for each touch of `palpate.touches`, in the same order.

    Raises
    ------
    ValueError
        A recording without times; a scene without a baseline; a setting out of range.
    TypeError
        An unknown setting; or not a recording.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> [touch] = palpate.offline(scenarios.run("stiff-steady"))
    >>> touch.method, abs(touch.ratio / scenarios.PROBE.ratio(8.68) - 1) < 3 * touch.standard_error / touch.ratio
    ('offline: matched pair of 5 + 6 points', True)
    >>> [touch] = palpate.offline(scenarios.run("not-level"), contact_exponent=1.2)
    >>> [abs(ratio / touch.live.level_ratio - 1) < 0.05 for ratio in (touch.level_ratio, touch.level(1.0)[0])]
    [True, True]
    """
    if scene == "fixed":
        raise ValueError(
            "scene: got 'fixed', allowed: one with a baseline and contacts, for example 'handheld'"
        )
    require_recording(recording)
    if not recording.timed:
        raise ValueError(
            "recording: got one without times, allowed: one with times; name its column, as time=COL"
        )
    exponent = settings.pop("contact_exponent", 1.0)
    if not 1 <= exponent <= 3:
        raise ValueError(f"contact_exponent: got {exponent}, allowed: 1 to 3")
    tracker = tracker_of(recording, scene, settings)
    whole = Fed.joined(feed_recording(tracker, recording))
    tracker.finish()
    if whole is None or not tracker.touches:
        return []
    t_hard = whole.t_hard_s
    t_soft = whole.t_soft_s
    if tracker.settings.get("host_stamps"):
        t_hard = smooth(t_hard)
        t_soft = smooth(t_soft)
    full_scale = tracker.settings["full_scale"]
    hard = _readings(t_hard, whole.hard, full_scale)
    soft = _readings(t_soft, whole.soft, full_scale)
    found = _estimated(tracker.touches, whole.rows, whole.era, (hard, soft))
    with_levels = list[OfflineTouch]()
    for touch in found:
        ratio, error = touch.level(exponent)
        with_levels.append(replace(touch, level_ratio=ratio, level_standard_error=error))
    return with_levels


def _readings(t: NDArray[Any], value: NDArray[Any], full_scale: float) -> Readings:
    row = np.flatnonzero(np.abs(value) < full_scale)  # nan is not
    row = row[t[row] > np.maximum.accumulate(np.append(-math.inf, t[row]))[:-1]]
    return Readings(t[row], value[row], row)


def _estimated(
    touches: list[Touch],
    rows: NDArray[Any],
    era: NDArray[np.int64],
    channels: tuple[Readings, Readings],
) -> list[OfflineTouch]:
    spans = _spans(touches, rows)
    starts = [*(span.start for span in spans), len(rows)]
    free = idle(rows, channels[0], starts, [span.pause for span in spans])
    found = list[OfflineTouch]()
    for touch, span in zip(touches, spans, strict=True):
        unused = (channel[free[channel.row]] for channel in channels)
        levels = [
            _level(touch, span, readings, channel, era)
            for readings, channel in zip(unused, channels, strict=True)
        ]
        inside = [channel.rows(span.start, span.end + 1) for channel in channels]
        alarms = span.start + np.flatnonzero(rows["alarm"][span.start : span.end + 1])
        result = _estimate(touch, inside, levels, alarms)
        if not math.isnan(result.ratio) and levels[1] and not _coarse(inside, levels):
            since_s = result.start_s if len(alarms) else -math.inf
            bases: list[Any] = levels
            end = span.pause
            if touch.age_s:  # by the tracker's baseline, as creep has hardly begun
                bases = [rows[name][span.start] for name in ("hard_baseline", "soft_baseline")]
                end = span.end + 1
            begin = max(span.start - HARD // 2, 0)
            hard, soft = (
                _change(channel.rows(begin, end), base)
                for channel, base in zip(channels, bases, strict=True)
            )
            swept = sweep(aligned(hard, soft), levels[1].noise, since_s, span.end)
            result = replace(result, sweep=swept)
        found.append(result)
    return found


@dataclass(frozen=True)
class _Span:
    """Rows of a touch: its first and last one, the first of the baseline after it, and the first of the next touch."""

    start: int
    end: int
    pause: int
    next_start: int


def _spans(touches: list[Touch], rows: NDArray[Any]) -> list[_Span]:
    next_starts = [*(touch.start for touch in touches[1:]), len(rows)]
    spans = list[_Span]()
    for number, (touch, next_start) in enumerate(zip(touches, next_starts, strict=True), 1):
        end = int(np.flatnonzero(rows["touch"] == number)[-1])
        after = pause(rows, end, next_start, measured=touch.revised)
        spans.append(_Span(touch.start, end, after, next_start))
    return spans


def _level(
    touch: Touch, span: _Span, unused: Readings, channel: Readings, era: NDArray[np.int64]
) -> IdleLevel | None:
    """Return the baseline of a touch from a channel's unused readings; None: there are too few.

    Readings from the other side of a gap or tare are not used.
    """
    unused = unused[era[unused.row] == era[span.end]]
    nothing = unused[:0]
    before = nothing if "baseline" in touch.flags else unused.rows(0, span.start)
    after = nothing if "creep" in touch.flags else unused.rows(span.pause, span.next_start)
    begin_s = _first_s(channel.rows(span.start, span.pause).t)
    next_s = _first_s(channel.t[np.searchsorted(channel.row, span.next_start) :])
    return level_of(before, after, begin_s, next_s)


def _first_s(t: Array) -> float:
    return float(t[0]) if len(t) else math.inf


def _change(channel: Readings, base: IdleLevel | float) -> Readings:
    """Return readings without their baseline: a line, or a number."""
    level = base.at(channel.t) if isinstance(base, IdleLevel) else base
    return replace(channel, value=channel.value - level)


def _estimate(
    touch: Touch, inside: list[Readings], levels: list[IdleLevel | None], alarms: NDArray[np.intp]
) -> OfflineTouch:
    hard_level, soft_level = levels
    if hard_level is None or soft_level is None:
        return _without(touch, "no idle readings before and after the touch")
    hard = _change(inside[0], hard_level)
    soft = _change(inside[1], soft_level)
    since = ""
    if len(alarms):
        since = " since the last change of the ratio"
        pairs = aligned(hard, soft)
        first = since_change(pairs, alarms) if pairs else None
        if first is None:
            return _without(touch, f"too few pairs{since}")
        hard = hard[hard.row >= first]
        soft = soft[soft.row >= first]
    found = fit_ratio(hard, soft, (hard_level, soft_level))
    if found is None:
        return _without(touch, f"too few pairs{since}")
    standard_error = found.standard_error
    is_misfit = any(flag.meaning.misfit for flag in touch.flags)
    if is_misfit or _coarse(inside, levels):
        standard_error = max(standard_error, touch.standard_error)
    baselines = hard_level.side
    if soft_level.side != hard_level.side:
        baselines = f"{hard_level.side} (hard), {soft_level.side} (soft)"
    return OfflineTouch(
        ratio=found.ratio,
        standard_error=standard_error,
        method=METHOD,
        baselines=baselines,
        samples=found.samples,
        covariance=found.covariance,
        start_s=found.start_s,
        stop_s=found.stop_s,
        left_out=found.left_out,
        lag_s=found.lag_s,
        live=touch,
    )


def _coarse(inside: list[Readings], levels: list[IdleLevel | None]) -> bool:
    """Return whether the noise does not move the readings from code to code: only the tracker knows what that hides."""
    for channel, level in zip(inside, levels, strict=True):
        steps = np.diff(np.unique(channel.value))
        code = steps.min(initial=math.inf)
        if level is None or not level.noise < code / 2:
            continue
        codes = steps / code
        if (np.abs(codes - np.rint(codes)) < 0.01).all():
            return True
    return False


def _without(touch: Touch, reason: str) -> OfflineTouch:
    return OfflineTouch(
        ratio=math.nan,
        standard_error=math.nan,
        method=f"offline: none, {reason}",
        baselines="",
        samples=0,
        covariance=math.nan,
        start_s=touch.start_s,
        stop_s=math.nan,
        left_out=0,
        lag_s=0.0,
        live=touch,
    )
