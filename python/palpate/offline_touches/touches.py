"""Touches of a recording, estimated offline: more points, all idle readings, without spikes."""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from palpate._core import Tracker
from palpate.offline_touches.fit import OfflineTouch, fit_ratio, since_change
from palpate.recording_protocol import RecordingProtocol, require_recording
from palpate.samples import baseline_pairs
from palpate.touch import Touch
from palpate.touch_readings.channel_readings import Array, Readings, Rows, readings_of, smooth
from palpate.touch_readings.idle import IdleLevel, idle, level_of, pause
from palpate.touch_readings.stiffening import stiffening
from palpate.touch_readings.stiffening_watch import StiffeningWatch
from palpate.touch_readings.sweep import sweep
from palpate.touch_readings.windows import HARD, aligned
from palpate.tracking import (
    Fed,
    feed_recording,
    given_levels,
    has_given_baseline,
    quiet_noise,
    tracker_of,
)

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene


def offline(
    recording: RecordingProtocol,
    *,
    scene: "_Scene" = "handheld",
    **settings: Unpack["_AnySettings"],
) -> list[OfflineTouch]:
    """Return the touches of a recording, each estimated again with the whole recording known.

    The tracker finds the touches, as in `palpate.touches`. Then the readings of each one, from its
    beginning or from the last change of its ratio to its end, are estimated by another method:

    - a matched pair of filters of 5 + 6 points around each hard reading, designed for the real
      times of its readings;
    - instrumental variables, r = sum z y / sum z x, z the mean of the soft readings around the
      readings of x: no bias in a light touch;
    - single readings that contradict their neighbours are left out, and windows with gaps; a
      constant lag of the soft channel (or of its times) is removed;
    - the baseline is the line between the means of the idle readings of up to 4 s before and after:
      only before, if the live result has the flag "creep", only after with the flag "baseline";
      never across a gap or a tare.

    The standard error is made of the noise of the readings or the scatter of the parts of the
    touch, whichever is larger, of the baselines, and of a difference of the ratio on the flanks.
    With a flag that the readings contradict hard = ratio * soft it is not below the live one. With
    the flag "drift" the ratio is a mean over the touch; the live ratio is nearer to its end.

    The level ratio is the slope of hard^(1/p) against soft^(1/p) over rise, hold and fall, to the
    power p. `OfflineTouch.stiffening` is how much the ratio grows with depth.

    Parameters
    ----------
    recording : Recording, Simulation, or the result of `palpate.recorded`
        As in `palpate.touches`; it is kept in memory as a whole.
    scene : str
        As in `Tracker`; not "fixed".
    **settings
        As in `Tracker`; but `contact_exponent`, p of force ~ depth^p, is any number from 1 (flat
        bumps, the default) to 3.

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
    >>> error = touch.ratio - scenarios.PROBE.ratio(8.68)
    >>> touch.method, abs(error) < 3 * touch.standard_error
    ('offline: matched pair of 5 + 6 points', True)
    >>> [touch] = palpate.offline(scenarios.run("not-level"), contact_exponent=1.2)
    >>> level, _ = touch.level(1.0)
    >>> abs(level / touch.live.level_ratio - 1) < 0.05
    True
    """
    if scene == "fixed":
        allowed = "one with a baseline and contacts, for example 'handheld'"
        raise ValueError(f"scene: got 'fixed', allowed: {allowed}")
    require_recording(recording)
    if not recording.timed:
        allowed = "one with times; name its column, as time=COL"
        raise ValueError(f"recording: got one without times, allowed: {allowed}")
    exponent = settings.pop("contact_exponent", 1.0)
    if not 1 <= exponent <= 3:
        raise ValueError(f"contact_exponent: got {exponent}, allowed: 1 to 3")
    tracker = tracker_of(recording, scene, settings)
    watch = StiffeningWatch(tracker)
    whole = Fed.joined(feed_recording(watch, recording))
    watch.finish()
    if whole is not None and tracker.settings["falling"]:
        whole = whole.negated()
    if whole is None or not tracker.touches:
        return []
    t_hard = whole.t_hard_s
    t_soft = whole.t_soft_s + tracker.settings.get("soft_later", 0.0)
    if tracker.settings.get("host_stamps"):
        t_hard = smooth(t_hard)
        t_soft = smooth(t_soft)
    full_scale = tracker.settings["full_scale"]
    hard = readings_of(t_hard, whole.hard, full_scale)
    soft = readings_of(t_soft, whole.soft, full_scale)
    result = []
    given = _given(tracker, whole)
    for touch in _estimated(watch.touches, whole, (hard, soft), given):
        ratio, error = touch.level(exponent)
        result.append(replace(touch, level_ratio=ratio, level_standard_error=error))
    return result


_Given = tuple[IdleLevel | None, IdleLevel | None]


def _given(tracker: Tracker, whole: Fed) -> _Given:
    """Return the baselines of both channels where they are given."""
    if not has_given_baseline(tracker):
        return None, None
    sign = -1.0 if tracker.settings["falling"] else 1.0
    hard, soft = given_levels(tracker)
    return _known(sign * hard, whole.hard), _known(sign * soft, whole.soft)


def _known(level: float, values: Array) -> IdleLevel:
    nothing = np.zeros(1)
    return IdleLevel(nothing, nothing + level, nothing, quiet_noise(values), "given")


class _Span(NamedTuple):
    """Rows of a touch: its first and last, the first of the baseline after it, the next touch."""

    start: int
    end: int
    pause: int
    next_start: int


@dataclass(frozen=True)
class _Channel:
    """All readings of one channel, and those in which the baseline is measured."""

    readings: Readings
    unused: Readings
    given: IdleLevel | None

    def inside(self, span: _Span) -> Readings:
        """Return the readings of a touch."""
        return self.readings.rows(span.start, span.end + 1)

    def level(self, touch: Touch, span: _Span, era: NDArray[np.int64]) -> IdleLevel | None:
        """Return the baseline of a touch; None: there are too few readings.

        Readings from the other side of a gap or tare are not used.
        """
        if self.given:
            return self.given
        unused = self.unused[era[self.unused.row] == era[span.end]]
        before = unused.rows(0, span.start)
        if "baseline" in touch.flags:
            before = unused[:0]
        after = unused.rows(span.pause, span.next_start)
        if "creep" in touch.flags:
            after = unused[:0]
        begin = self.readings.rows(span.start, span.pause)
        following = self.readings[np.searchsorted(self.readings.row, span.next_start) :]
        return level_of(before, after, begin.first_s, following.first_s)


def _estimated(
    touches: list[Touch], whole: Fed, readings: tuple[Readings, Readings], given: _Given
) -> list[OfflineTouch]:
    hard, soft = readings
    rows = whole.rows
    collected = 0
    if len(hard.t) > 1:
        collected = baseline_pairs(float(np.median(np.diff(hard.t))))
    spans = _spans(touches, rows, collected)
    starts = []
    pauses = []
    for span in spans:
        starts.append(span.start)
        pauses.append(span.pause)
    free = idle(rows, hard, [*starts, len(rows)], pauses, collected)
    channels = []
    for each, level in zip(readings, given, strict=True):
        channels.append(_Channel(each, each[free[each.row]], level))
    result = []
    for touch, span in zip(touches, spans, strict=True):
        levels = [channel.level(touch, span, whole.era) for channel in channels]
        inside = [channel.inside(span) for channel in channels]
        alarm = rows["alarm"][span.start : span.end + 1]
        alarms = span.start + np.flatnonzero(alarm)
        estimate = _estimate(touch, inside, levels, alarms)
        hard_level, soft_level = levels
        has_ratio = not math.isnan(estimate.ratio)
        if has_ratio and hard_level and soft_level and not _coarse(inside, levels):
            hard_base: IdleLevel | float = hard_level
            soft_base: IdleLevel | float = soft_level
            end = span.pause
            if touch.age_s:  # by the tracker's baseline, as creep has hardly begun
                hard_base = rows["hard_baseline"][span.start]
                soft_base = rows["soft_baseline"][span.start]
                end = span.end + 1
            begin = max(span.start - HARD // 2, 0)
            pairs = aligned(
                _change(hard.rows(begin, end), hard_base),
                _change(soft.rows(begin, end), soft_base),
            )
            since_s = -math.inf
            if len(alarms):
                since_s = estimate.start_s
            swept = sweep(pairs, soft_level.noise, since_s, span.end)
            if swept:
                shown = stiffening(swept)
                estimate = replace(estimate, sweep=swept, stiffening=shown)
        result.append(estimate)
    return result


def _spans(touches: list[Touch], rows: NDArray[Any], collected: int) -> list[_Span]:
    next_starts = [*(touch.start for touch in touches[1:]), len(rows)]
    spans = []
    for number, (touch, next_start) in enumerate(zip(touches, next_starts, strict=True), 1):
        end = int(np.flatnonzero(rows["touch"] == number)[-1])
        after = pause(rows, end, next_start, collected, measured=touch.revised)
        spans.append(_Span(touch.start, end, after, next_start))
    return spans


def _change(channel: Readings, base: IdleLevel | float) -> Readings:
    """Return readings without their baseline: a line, or a number."""
    level = base.at(channel.t) if isinstance(base, IdleLevel) else base
    return replace(channel, value=channel.value - level)


def _estimate(
    touch: Touch, inside: list[Readings], levels: list[IdleLevel | None], alarms: Rows
) -> OfflineTouch:
    hard_level, soft_level = levels
    if hard_level is None or soft_level is None:
        return _without(touch, "no idle readings before and after the touch")
    hard = _change(inside[0], hard_level)
    soft = _change(inside[1], soft_level)
    too_few = "too few pairs"
    if len(alarms):
        too_few += " since the last change of the ratio"
        pairs = aligned(hard, soft)
        first = since_change(pairs, alarms) if pairs else None
        if first is None:
            return _without(touch, too_few)
        hard = hard[hard.row >= first]
        soft = soft[soft.row >= first]
    found = fit_ratio(touch, hard, soft, (hard_level, soft_level))
    if found is None:
        return _without(touch, too_few)
    is_misfit = any(flag.meaning.misfit for flag in touch.flags)
    if is_misfit or _coarse(inside, levels):
        error = max(found.standard_error, touch.standard_error)
        found = replace(found, standard_error=error)
    return found


def _coarse(inside: list[Readings], levels: list[IdleLevel | None]) -> bool:
    """Return whether the noise does not move the readings from code to code.

    Only the tracker knows what that hides.
    """
    for channel, level in zip(inside, levels, strict=True):
        steps = np.diff(np.unique(channel.value))
        code = steps.min(initial=math.inf)
        if level is None or not level.noise < code / 2:
            continue
        codes = steps / code
        off = np.abs(codes - np.rint(codes))
        if (off < 0.01).all():
            return True
    return False


def _without(touch: Touch, reason: str) -> OfflineTouch:
    method = f"offline: none, {reason}"
    return OfflineTouch(method=method, start_s=touch.start_s, live=touch)
