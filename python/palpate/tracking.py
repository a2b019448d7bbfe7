"""Touches of a recording."""

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import (
    TYPE_CHECKING,
    Any,
    NamedTuple,
    SupportsIndex,
    Unpack,
    cast,
    overload,
)

import numpy as np
from numpy.typing import NDArray

from palpate._core import Tracker
from palpate.dataframe import Framed, arrow_of_touches
from palpate.judgements import Judgement, judgement_notes
from palpate.plotted import Plotted
from palpate.recording_protocol import Part, PartEnd, RecordingProtocol, require_recording
from palpate.samples import (
    MOST_BASELINE,
    RETAKEN,
    Instrument,
    baseline_pairs,
    pair_of,
    require_scale,
    settings_for,
)
from palpate.touch import Touch
from palpate.touch_readings.stiffening_watch import StiffeningWatch

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene


class Touches(list[Touch], Framed, Plotted):
    """The touches of a recording, in order of time: a list that shows and draws itself.

    Attributes
    ----------
    notes, doubts : tuple of str
        Notes and doubts of the recording, as in `palpate.Recording`. More notes are about readings
        (the sentences of `palpate.judgements.Judgement`), a baseline that was measured again,
        touches whose model was not tested, and touches with the next one too soon after them.
    unit : str
        Unit of both signals.
    soft_later_s : float
        How much later the soft channel is read than its times say, where most touches show it; 0:
        it is not.

    Examples
    --------
    >>> Touches()
    []
    """

    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    unit: str = "pF"
    soft_later_s: float = 0.0

    @overload
    def __getitem__(self, index: SupportsIndex, /) -> Touch: ...
    @overload
    def __getitem__(self, index: slice, /) -> "Touches": ...
    def __getitem__(self, index: SupportsIndex | slice, /) -> "Touch | Touches":
        """Return a touch, or some of them with the same notes and doubts."""
        if not isinstance(index, slice):
            return super().__getitem__(index)
        return Touches(super().__getitem__(index)).of(self)

    def of(self, recording: "RecordingProtocol | Touches") -> "Touches":
        """Take over the notes, the doubts and the unit of a recording."""
        self.notes = recording.notes
        self.doubts = recording.doubts
        self.unit = recording.unit
        if isinstance(recording, Touches):
            self.soft_later_s = recording.soft_later_s
        return self

    def __repr__(self) -> str:
        """Return one line for each touch."""
        from palpate.display.text import note_lines, touch_lines

        return touch_lines(self, note_lines(self.notes, self.doubts))

    def _repr_html_(self) -> str:
        from palpate.display.cards import touches_card
        from palpate.display.text import note_lines

        return touches_card(self, note_lines(self.notes, self.doubts))

    def _draw(self, ax: Any) -> None:
        from palpate.display.plots import draw_touches

        draw_touches(self, ax)

    def to_arrow(self) -> Any:
        """Return a pyarrow.Table with a row for each touch, and plain columns."""
        return arrow_of_touches(self)


class Tracked(NamedTuple):
    """The touches that a tracker found in a recording, and its counts."""

    touches: Touches
    retaken: int  # how often the baseline was measured again
    cut: int  # touches that had not ended when the recording ended: 0 or 1
    judgements: tuple[Judgement, ...]


Windows = Sequence[tuple[float, float]]
"""Begin and end, s, of touches that a person has chosen."""


def tracked(
    recording: RecordingProtocol,
    *,
    scene: "_Scene" = "handheld",
    windows: Windows | None = None,
    **settings: Unpack["_AnySettings"],
) -> Tracked:
    """Return the touches of one recording as `palpate.touches` does, and the tracker's counts."""
    if windows is not None:
        return _tracked_in(windows, recording, scene, settings)
    tracker = tracker_of(recording, scene, settings)
    watch = StiffeningWatch(tracker)
    period_s = 0.0
    has_one_time = recording.timed
    for _, part in _parts(tracker, recording):
        watch.process(*part.columns)
        has_one_time = has_one_time and np.array_equal(part.t_hard, part.t_soft)
        if period_s == 0 and part.pairs > 1 and recording.timed:
            period_s = part.step_s
    ended = tracker.touch_count
    watch.finish()
    found = watch.touches
    judgements = tracker.judgements
    if not recording.timed:
        found = [touch.without_times() for touch in found]
        judgements = [judgement.without_time() for judgement in judgements]
    touches = Touches(found).of(recording)
    touches.notes += (
        *recording.value_notes(),
        *judgement_notes(judgements),
        *_tracker_notes(tracker),
        *_touch_notes(touches, period_s, revises=not has_given_baseline(tracker)),
    )
    if has_one_time and _most_lag(touches):
        later_s = _soft_later(recording, scene, settings, touches)
        if 0 < abs(later_s) < period_s:
            touches.soft_later_s = later_s
            touches.notes += (_soft_later_note(later_s),)
    return Tracked(touches, tracker.retaken, tracker.touch_count - ended, tuple(judgements))


def _most_lag(touches: Touches) -> bool:
    """Return whether most touches have the flag lag, and agree about it within a third."""
    lags = _lags_ms(touches)
    if 2 * len(lags) <= len(touches):
        return False
    typical = float(np.median(lags))
    apart = np.abs(np.array(lags) - typical)
    return bool(np.median(apart) < abs(typical) / 3)


def _lags_ms(touches: Sequence[Touch]) -> list[float]:
    return [touch.effects["lag"] for touch in touches if "lag" in touch.flags]


def _soft_later(
    recording: RecordingProtocol, scene: "_Scene", settings: "_AnySettings", touches: Touches
) -> float:
    """Return how much later the soft channel is read, s, so that no lag is left; 0: unknown."""
    later_s = float(cast(Any, settings).get("soft_later", 0.0))
    found: Sequence[Touch] = touches
    lag_ms = float(np.median(_lags_ms(touches)))
    for _ in range(_TRIES):
        later_s -= lag_ms / 1000
        changed = cast("_AnySettings", {**settings, "soft_later": later_s})
        tracker = tracker_of(recording, scene, changed)
        for _, part in _parts(tracker, recording):
            tracker.take(*part.columns)
        tracker.finish()
        found = tracker.touches
        lag_ms = _STEP * float(np.median([touch.effects["lag"] for touch in found]))
        if abs(lag_ms) < _NO_LAG_MS:
            break
    is_right = 2 * len(_lags_ms(found)) <= len(found)
    return later_s if is_right else 0.0


_TRIES = 4
_STEP = 2 / 3  # a lag of filtered pairs, as of shifted times, is 1.3 to 1.6 times too large
_NO_LAG_MS = 0.1


def _soft_later_note(later_s: float) -> str:
    """Return the note on a channel that is read later than its times say."""
    later_ms = 1000 * later_s
    side = "after" if later_s > 0 else "before"
    return f"soft is read {abs(later_ms):.1f} ms {side} hard: --soft-later-ms {later_ms:.1f}"


def has_given_baseline(tracker: Tracker) -> bool:
    """Return whether the baseline of a tracker is given, in place of measured."""
    return bool(tracker.settings.get("baseline", "measured") != "measured")


def _tracker_notes(tracker: Tracker) -> Iterator[str]:
    if has_given_baseline(tracker):
        yield _given_note(tracker)
    elif tracker.retaken:
        yield f"{RETAKEN} ({_times(tracker.retaken)})"
    if tracker.pressed_again:
        times = _times(tracker.pressed_again)
        yield f"pressed again before it was lifted ({times}): such a press is no touch"


def _given_note(tracker: Tracker) -> str:
    hard, soft = given_levels(tracker)
    levels = f"{hard:g} and {soft:g}" if hard or soft else "zero"
    note = f"the baseline is given, {levels}: its error is not in the uncertainty"
    if not tracker.retaken:
        return note
    return f"{note}; the readings fell far below it ({_times(tracker.retaken)})"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _touch_notes(touches: Touches, period_s: float, *, revises: bool) -> Iterator[str]:
    """Yield remarks on touches with few pairs, untested ones, and ones followed too soon.

    `revises`: the baseline is measured again after each touch.
    """
    if period_s > 0.5:
        yield (
            f"pairs are {period_s:.3g} s apart: a touch has few; times are in s, or integers of ns"
        )
    untested = sum(_is_untested(touch) for touch in touches)
    if untested:
        yield f"{untested} of {len(touches)} touches: {_UNTESTED}"
    soon = sum(_is_soon(after, before) for before, after in pairwise(touches))
    if soon and revises:
        yield (
            f"{soon} of {len(touches)} touches were followed too soon by the next one: "
            f"{baseline_takes(period_s)}; a drift stays in them"
        )


_UNTESTED = (
    "the model was not tested: pairs slower than 40 ms, or on no even grid, or a channel falls; "
    "a tilt, an offset, a lag are not seen"
)


def _is_untested(touch: Touch) -> bool:
    """Return whether a touch of a scene with a test of the model had no pairs for it."""
    effects = {name: size for name, size in touch.effects.items() if name != "shift"}
    is_cut = _CUT_SHORT.intersection(touch.flags)
    return bool(effects) and touch.samples >= 20 and not any(effects.values()) and not is_cut


def _is_soon(after: Touch, before: Touch) -> bool:
    """Return whether a touch begins before the baseline after the touch before it was measured."""
    is_cut = "gap" in after.flags or _CUT_SHORT.intersection(before.flags)
    return bool(before.effects) and not before.revised and not is_cut


_CUT_SHORT = {"gap", "step", "jumped"}
"""Flags of a touch that has another reason for what it lacks."""


def baseline_takes(period_s: float, scene: str = "handheld") -> str:
    """Return how long a baseline takes in a scene; `period_s`: from pair to pair, 0: unknown."""
    is_timed = scene in ("handheld", "sliding")
    pair_s = pair_of(period_s)
    count = baseline_pairs(pair_s) if is_timed else MOST_BASELINE
    text = f"a baseline takes {count} pairs without contact"
    if not period_s > 0:
        return text
    return f"{text}, {count * pair_s:.2g} s here"


def _tracked_in(
    windows: Windows, recording: RecordingProtocol, scene: "_Scene", settings: "_AnySettings"
) -> Tracked:
    """Return the touch in each window; its baseline is from the readings before or after it."""
    until_lift = _until_lift(scene, settings)
    tracker = tracker_of(recording, scene, until_lift)
    if not recording.timed:
        raise ValueError(
            "windows: got a recording without times, allowed: one with times; "
            "name its column, as time=COL"
        )
    whole = _fed_whole(tracker, recording)
    if has_given_baseline(tracker):
        until_lift = _with_levels(until_lift, given_levels(tracker), whole)
        tracker = tracker_of(recording, scene, until_lift)
        whole = _fed_whole(tracker, recording)
    starts = [touch.start for touch in tracker.touches]
    cut = _Cut(recording, scene, until_lift, whole, starts)
    touches = Touches(cut.touch(window) for window in windows).of(recording)
    touches.notes += tuple(judgement_notes(tracker.judgements))
    if has_given_baseline(tracker):
        touches.notes += (_given_note(tracker),)
    touches.notes += tuple(cut.notes)
    return Tracked(touches, tracker.retaken, 0, tuple(tracker.judgements))


def _fed_whole(tracker: Tracker, recording: RecordingProtocol) -> "Fed":
    """Feed a recording to a tracker as a whole."""
    whole = Fed.joined(feed_recording(StiffeningWatch(tracker), recording))
    tracker.finish()
    if whole is None:
        raise ValueError("windows: got a recording without samples, allowed: one with samples")
    return whole


class _Cut:
    """Cuts touches out of a recording, `whole`; `starts`: rows where the tracker found touches."""

    def __init__(
        self,
        recording: RecordingProtocol,
        scene: "_Scene",
        settings: "_AnySettings",
        whole: "Fed",
        starts: list[int],
    ) -> None:
        self.notes = list[str]()
        self._recording = recording
        self._scene = scene
        self._settings = settings
        self._whole = whole
        self._starts = starts
        self._times = np.maximum.accumulate(whole.t_hard_s)

    def touch(self, window: tuple[float, float]) -> Touch:
        """Return the touch in a window."""
        begin_s, end_s = _window(window)
        times = self._times
        begin = int(np.searchsorted(times, begin_s))
        end = int(np.searchsorted(times, end_s, "right"))
        if not times[0] <= begin_s < times[-1] or begin >= end:
            raise ValueError(
                f"windows: got {begin_s:g} to {end_s:g} s, allowed: begin before end, "
                f"with samples, within {times[0]:.3f} to {times[-1]:.3f} s"
            )
        contact = begin
        if begin and self._whole.rows["contact"][begin - 1]:
            contact = max([start for start in self._starts if start < begin], default=begin)
        following = min([start for start in self._starts if start >= end], default=len(times))
        touches, retaken = self._tracked([contact, begin, end, following], self._settings)
        if len(touches) == 1 and not retaken:
            return touches[0]
        after = None
        if len(touches) < 2:
            after = self._touch_by_rest_after(begin, end)
        if after is None:
            raise ValueError(
                f"windows: got {begin_s:g} to {end_s:g} s: {_why_none(len(touches), retaken)}, "
                "allowed: one press with a second without contact before or after it, or a given "
                "baseline (--baseline)"
            )
        self.notes.append(
            f"window {begin_s:g} to {end_s:g} s: its baseline is from the readings after it"
        )
        return after

    def _tracked(self, rows: list[int], settings: "_AnySettings") -> tuple[list[Touch], int]:
        tracker = tracker_of(self._recording, self._scene, settings)
        return _cut_out(tracker, self._recording, rows)

    def _touch_by_rest_after(self, begin: int, end: int) -> Touch | None:
        """Return the touch with the baseline of the rest after it; None: there is none."""
        if self._settings.get("baseline", "measured") != "measured" or not self._has_baseline():
            return None
        rest = self._rest_after(begin, end)
        if len(rest) < 2 * _BATCHES:
            return None
        hard, soft = self._whole.hard[rest], self._whole.soft[rest]
        levels = (float(hard.mean()), float(soft.mean()))
        settings = _with_levels(self._settings, levels, self._whole)
        touches, _ = self._tracked([0, begin, end, end], settings)
        if len(touches) != 1:
            return None
        [touch] = touches
        ratio = touch.ratio
        change = float(np.nanmean(self._whole.soft[begin:end])) - levels[1]
        shared = _variance_of_mean(hard) + ratio**2 * _variance_of_mean(soft)
        error = math.hypot(touch.standard_error, math.sqrt(shared) / abs(change))
        return replace(touch, standard_error=error)

    def _has_baseline(self) -> bool:
        return "baseline" in Tracker(self._scene).settings

    def _rest_after(self, begin: int, end: int) -> NDArray[np.intp]:
        """Return the rows without contact after a press: before it, if time went backwards."""
        whole = self._whole
        same = np.flatnonzero(whole.era[begin:] == whole.era[end - 1]) + begin
        rows = same[::-1]
        tracker = tracker_of(self._recording, self._scene, self._settings)
        times = (-whole.t_hard_s[rows], -whole.t_soft_s[rows])
        contact = tracker.process(*times, whole.hard[rows], whole.soft[rows])["contact"]
        tracker.finish()
        at_end = int(np.flatnonzero(rows == end - 1)[0])
        starts = [touch.start for touch in tracker.touches if touch.start <= at_end]
        if not starts or not contact[at_end]:
            return rows[:0]
        last_contact = np.flatnonzero(contact[: starts[-1]]).max(initial=-1)
        rest = rows[last_contact + 1 : starts[-1] - _RISE]
        near = np.abs(whole.t_hard_s[rest] - whole.t_hard_s[rows[starts[-1]]]) < _REST_S
        is_whole = np.isfinite(whole.hard[rest] + whole.soft[rest])
        found: NDArray[np.intp] = rest[near & is_whole]
        return found


def given_levels(tracker: Tracker) -> tuple[float, float]:
    """Return the given baseline of a tracker."""
    baseline = tracker.settings["baseline"]
    return (0.0, 0.0) if baseline == "zero" else baseline[:2]


def _with_levels(
    settings: "_AnySettings", levels: tuple[float, float], whole: "Fed"
) -> "_AnySettings":
    """Return settings with a given baseline, and the noise of all readings, also of later ones."""
    noises = quiet_noise(whole.hard), quiet_noise(whole.soft)
    return cast("_AnySettings", {**settings, "baseline": (*levels, *noises)})


def quiet_noise(values: NDArray[np.float64]) -> float:
    """Return the noise of a channel where it is quiet; 0: unknown."""
    bends = np.abs(np.diff(values[np.isfinite(values)], 2))
    if len(bends) < _BLOCK:
        return 0.0
    blocks = np.array_split(bends, len(bends) // _BLOCK)
    means = [float(block.mean()) for block in blocks]
    return _PER_BEND * float(np.quantile(means, _QUIET))


_BLOCK = 16  # second differences
_QUIET = 0.05  # of the blocks
_PER_BEND = 0.5117  # standard deviation over mean second difference, 1 / (sqrt(6) sqrt(2 / pi))
_RISE = 3  # readings before a contact that may belong to it
_REST_S = 4.0  # the longest rest of a baseline
_BATCHES = 8  # of a mean: their scatter shows noise that is slow


def _variance_of_mean(values: NDArray[np.float64]) -> float:
    means = [float(batch.mean()) for batch in np.array_split(values, _BATCHES)]
    return float(np.var(means, ddof=1)) / _BATCHES


def _until_lift(scene: "_Scene", settings: "_AnySettings") -> "_AnySettings":
    """Return settings with which a touch has any length, and ends where the probe is lifted."""
    known = Tracker(scene).settings
    fixed = {"samples": None, "seconds": None, "age": 0.0, "release": 0.1}
    of_scene = {name: value for name, value in fixed.items() if name in known}
    return cast("_AnySettings", {**settings, **of_scene})


def _window(window: tuple[float, float]) -> tuple[float, float]:
    try:
        begin_s, end_s = map(float, window)
    except (TypeError, ValueError):
        allowed = "a list of pairs of times, s, as [(4.0, 6.0)]"
        raise ValueError(f"windows: got {window!r:.40} in it, allowed: {allowed}") from None
    return begin_s, end_s


def _why_none(touches: int, retaken: int) -> str:
    """Return why a window has no touch, or several."""
    if retaken:
        return "the baseline before it was measured in contact"
    if touches:
        return "the probe is lifted in it, and pressed again"
    return "nothing rises above the baseline before it, or the window is too short"


_LEFT, _INSIDE, _AFTER = 1, 2, 3  # stages of a recording around a window; 0: before the contact


def _cut_out(
    tracker: Tracker, recording: RecordingProtocol, rows: list[int]
) -> tuple[list[Touch], int]:
    """Feed a recording up to the last of four rows; return touches from the second to the third.

    Readings from the first to the second are left out: the contact that has begun before the
    window. Also returned is how often the baseline was wrong from the second row on.
    """
    watch = StiffeningWatch(tracker)
    at = 0
    stage_before = 0
    retaken_before = 0
    counts = list[int]()
    for _, part in _parts(tracker, recording):
        edges = [0, *np.clip(np.array(rows) - at, 0, part.pairs).tolist()]
        at += part.pairs
        for stage, (first, last) in enumerate(pairwise(edges)):
            if first == last:
                continue
            if stage in (_INSIDE, _AFTER) and stage > stage_before:
                watch.finish()
                if not counts:
                    retaken_before = tracker.retaken
                counts.append(tracker.touch_count)
            stage_before = stage
            piece = part.rows(first, last)
            if stage == _LEFT:
                nothing = np.full(piece.pairs, math.nan)
                piece = piece._replace(hard=nothing, soft=nothing)
            watch.process(*piece.columns)
    watch.finish()
    counts.append(tracker.touch_count)
    touches = watch.touches_since(counts[0])[: counts[1] - counts[0]]
    return touches, tracker.retaken - retaken_before


def tracker_of(recording: RecordingProtocol, scene: "_Scene", settings: "_AnySettings") -> Tracker:
    """Return a new tracker for a recording, with settings that it can have.

    Raises
    ------
    TypeError
        Not a recording: the message names the missing members.
    ValueError
        A setting is out of range, or cannot be used without times, or without values in pF.
    """
    require_recording(recording)
    instrument = Instrument(recording.full_scale_pF, recording.period_s, recording.host_stamps)
    complete = settings_for(scene, instrument) | settings
    if recording.unit != "pF":
        complete.setdefault("full_scale", sys.float_info.max)  # no end of a converter in pF
    require_scale(scene, recording.unit, settings)
    if not recording.timed:
        complete = _without_times(scene, complete)
    return Tracker(scene, **cast(Any, complete))


_PAIRS = 250  # the length of a touch of one converter


def _without_times(scene: "_Scene", settings: "_AnySettings") -> "_AnySettings":
    """Return settings with a length in samples instead of seconds, and without means over time."""
    if settings.get("seconds") is not None:
        raise ValueError(
            f"seconds: got {settings['seconds']:g} for a recording without times, "
            "allowed: samples; or name the column of times"
        )
    usual = Tracker(scene).settings
    untimed = settings.copy()
    if "averaged" in usual:
        untimed.setdefault("averaged", 0.0)
    if usual["seconds"] is not None and "seconds" not in settings:
        untimed["seconds"] = None
        untimed.setdefault("samples", _PAIRS)
    return untimed


class Fed(NamedTuple):
    """Pairs that were fed to a tracker.

    Attributes
    ----------
    t_hard_s, t_soft_s, hard, soft : numpy.ndarray of float, shape (n,)
        Times, s, and readings, pF.
    rows : numpy.ndarray, shape (n,)
        Rows of `Tracker.process`.
    era : numpy.ndarray of int, shape (n,)
        How often the baseline was tared, or became invalid, before each pair.
    """

    t_hard_s: NDArray[np.float64]
    t_soft_s: NDArray[np.float64]
    hard: NDArray[np.float64]
    soft: NDArray[np.float64]
    rows: NDArray[np.void]
    era: NDArray[np.int64]

    def negated(self) -> "Fed":
        """Return the pairs with the other sign of readings and baselines."""
        rows = self.rows.copy()
        rows["hard_baseline"] *= -1
        rows["soft_baseline"] *= -1
        return self._replace(hard=-self.hard, soft=-self.soft, rows=rows)

    @staticmethod
    def joined(parts: Iterable["Fed"]) -> "Fed | None":
        """Return consecutive parts as one; None: there is no pair."""
        columns = list(zip(*(part for part in parts if len(part.rows)), strict=True))
        if not columns:
            return None
        return Fed(*(np.concatenate(column) for column in columns))


def feed_recording(watch: StiffeningWatch, recording: RecordingProtocol) -> Iterator[Fed]:
    """Feed a recording to a tracker; yield its pairs with the tracker's rows."""
    for era, part in _parts(watch.tracker, recording):
        rows = watch.process(*part.columns)
        yield Fed(*part.seconds, part.hard, part.soft, rows, np.full(len(rows), era))


def _parts(tracker: Tracker, recording: RecordingProtocol) -> Iterator[tuple[int, Part]]:
    """Yield era and part of a recording; after each, pass its end to the tracker."""
    era = 0
    for part in recording.parts(tracker.settings["full_scale"]):
        yield era, part
        if part.end is PartEnd.CONTINUES:
            continue
        era += 1
        if part.end is PartEnd.GAP:
            tracker.gap()
        else:
            tracker.tare(force=True)  # as in the measurement, where it may have been forced
