"""Touches of a recording, estimated afterwards: with more points, all idle readings, and spikes left out."""

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from palpate import number_format
from palpate.offline_touches.fit import HARD, SOFT, Sweep, aligned, fitted, since_change, sweep
from palpate.offline_touches.idle import IdleLevel, Readings, idle, level_of, pause
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
        sums, place = np.append(0, np.cumsum(part)), np.arange(len(rows))
        reach = np.minimum(_REACH, np.minimum(place, place[::-1]))
        out[rows] = t[rows[0]] + (sums[place + reach + 1] - sums[place - reach]) / (2 * reach + 1)
    return out


METHOD = f"offline: matched pair of {HARD} + {SOFT} points"
"""Name of the method."""
_MISFITS = frozenset({"offset", "drift", "lag", "curve", "creep", "baseline"})


@dataclass(frozen=True)
class OfflineTouch:
    """A touch estimated afterwards, beside the live result.

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
        How late the soft channel was, or its times: removed; 0 if not significant.
    live : Touch
        The touch as the tracker found it; its flags hold here, too.
    level_ratio, level_standard_error : float
        As of `Touch`, for any exponent of the contact; nan if there is none.
    sweep : palpate.offline_touches.fit.Sweep or None
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
        return (
            self.sweep.result(self.live.ratio, contact_exponent)
            if self.sweep
            else (math.nan, math.nan)
        )

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
    larger, of the baselines, and of what a ratio that differs on the flanks leaves open. With a flag that the readings
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
    t_hard, t_soft = whole.t_hard_s, whole.t_soft_s
    if tracker.settings.get("host_stamps"):
        t_hard = smooth(t_hard)
        t_soft = smooth(t_soft)
    full_scale = tracker.settings["full_scale"]
    hard = _readings(t_hard, whole.hard, full_scale)
    soft = _readings(t_soft, whole.soft, full_scale)
    found = _estimated(tracker.touches, whole.rows, whole.era, (hard, soft))
    levels = [one.level(exponent) for one in found]
    return [
        replace(one, level_ratio=r, level_standard_error=e)
        for one, (r, e) in zip(found, levels, strict=True)
    ]


def _readings(t: NDArray[Any], value: NDArray[Any], full_scale: float) -> Readings:
    row = np.flatnonzero(np.abs(value) < full_scale)  # nan is not
    row = row[t[row] > np.maximum.accumulate(np.append(-math.inf, t[row]))[:-1]]
    return Readings(t[row], value[row], row)


def _estimated(
    touches: list[Touch],
    rows: NDArray[Any],
    era: NDArray[np.intp],
    channels: tuple[Readings, Readings],
) -> list[OfflineTouch]:
    ends = [
        int(np.flatnonzero(rows["touch"] == number)[-1]) for number in range(1, len(touches) + 1)
    ]
    starts = [touch.start for touch in touches] + [len(rows)]
    pauses = [
        pause(rows, end, start, measured=touch.revised)
        for touch, end, start in zip(touches, ends, starts[1:], strict=True)
    ]
    free = idle(rows, channels[0], starts, pauses)
    unused = [channel[free[channel.row]] for channel in channels]
    found = []
    for i, touch in enumerate(touches):
        levels = [
            _level(
                touch,
                channel[era[channel.row] == era[ends[i]]],
                starts[i],
                (pauses[i], starts[i + 1]),
                all_of,
            )
            for channel, all_of in zip(unused, channels, strict=True)
        ]
        inside = [channel.rows(starts[i], ends[i] + 1) for channel in channels]
        alarms = starts[i] + np.flatnonzero(rows["alarm"][starts[i] : ends[i] + 1])
        one = _one(touch, inside, levels, alarms)
        if not math.isnan(one.ratio) and levels[1] and not _coarse(inside, levels):
            bases = (
                [rows[name][starts[i]] for name in ("hard_baseline", "soft_baseline")]
                if touch.age_s
                else levels
            )
            part = max(starts[i] - HARD // 2, 0), ends[i] + 1 if touch.age_s else pauses[i]
            swept = (
                _change(channel.rows(*part), base)
                for channel, base in zip(channels, bases, strict=True)
            )
            since_s = one.start_s if len(alarms) else -math.inf
            one = replace(one, sweep=sweep(aligned(*swept), levels[1].noise, since_s, ends[i]))
        found.append(one)
    return found


def _level(
    touch: Touch, unused: Readings, start: int, after: tuple[int, int], channel: Readings
) -> IdleLevel | None:
    nothing = unused[:0]
    before = nothing if "baseline" in touch.flags else unused.rows(0, start)
    later = nothing if "creep" in touch.flags else unused.rows(*after)
    begin = channel.rows(start, after[0]).t
    following = channel.t[np.searchsorted(channel.row, after[1]) :]
    return level_of(
        before, later, *(float(t[0]) if len(t) else math.inf for t in (begin, following))
    )


def _change(channel: Readings, base: Any) -> Readings:
    """Return readings without their baseline; at an age by the tracker's baseline, as creep has hardly begun."""
    return replace(
        channel, value=channel.value - (base.at(channel.t) if isinstance(base, IdleLevel) else base)
    )


def _one(
    touch: Touch, inside: list[Readings], levels: list[IdleLevel | None], alarms: NDArray[np.intp]
) -> OfflineTouch:
    hard_level, soft_level = levels
    if hard_level is None or soft_level is None:
        return _without(touch, "no idle readings before and after the touch")
    hard, soft = map(_change, inside, (hard_level, soft_level))
    if len(alarms):
        pairs = aligned(hard, soft)
        first = since_change(pairs, alarms) if pairs else None
        if first is None:
            return _without(touch, "too few pairs since the last change of the ratio")
        hard, soft = (channel[channel.row >= first] for channel in (hard, soft))
    found = fitted(hard, soft, (hard_level, soft_level))
    if found is None:
        return _without(
            touch, "too few pairs" + (" since the last change of the ratio" if len(alarms) else "")
        )
    if _MISFITS & set(touch.flags) or _coarse(inside, levels):
        found["standard_error"] = max(found["standard_error"], touch.standard_error)
    names = [level.side for level in (hard_level, soft_level)]
    baselines = names[0] if names[0] == names[1] else f"{names[0]} (hard), {names[1]} (soft)"
    return OfflineTouch(**found, method=METHOD, baselines=baselines, live=touch)


def _coarse(inside: list[Readings], levels: list[IdleLevel | None]) -> bool:
    """Return whether the noise does not move the readings from code to code: only the tracker knows what that hides."""
    for channel, level in zip(inside, levels, strict=True):
        steps = np.diff(np.unique(channel.value))
        codes = steps / steps.min(initial=math.inf)
        if (
            level is not None
            and level.noise < steps.min(initial=math.inf) / 2
            and (np.abs(codes - np.rint(codes)) < 0.01).all()
        ):
            return True
    return False


def _without(touch: Touch, reason: str) -> OfflineTouch:
    nan = math.nan
    return OfflineTouch(
        nan, nan, f"offline: none, {reason}", "", 0, nan, touch.start_s, nan, 0, 0.0, touch
    )
