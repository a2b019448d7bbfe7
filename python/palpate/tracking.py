"""Touches of a recording."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import make_dataclass
from itertools import pairwise
from types import GetSetDescriptorType
from typing import (
    TYPE_CHECKING,
    Any,
    NamedTuple,
    Protocol,
    SupportsIndex,
    Unpack,
    overload,
    runtime_checkable,
)

import numpy as np
from numpy.typing import NDArray

from palpate._core import Touch, Tracker
from palpate.dataframe import Framed, arrow_of_touches
from palpate.errors import display
from palpate.samples import RETAKEN, UNTIMED_NS, Block, require_scale, settings_for, usable

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene


class Touches(list[Touch], Framed):
    """The touches of a recording, in order of time: a list that shows and draws itself.

    Attributes
    ----------
    notes, doubts : tuple of str
        Those of the recording, as in `palpate.Recording`; and notes on a baseline that was measured again, on touches
        whose model was not tested, and on such that the next touch followed too soon.
    unit : str
        Of both signals.

    Examples
    --------
    >>> Touches()
    []
    """

    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    unit: str = "pF"

    @overload
    def __getitem__(self, index: SupportsIndex, /) -> Touch: ...
    @overload
    def __getitem__(self, index: slice, /) -> "Touches": ...
    def __getitem__(self, index: SupportsIndex | slice, /) -> "Touch | Touches":
        """Return a touch, or some of them with the same notes and doubts."""
        if not isinstance(index, slice):
            return super().__getitem__(index)
        return Touches(super().__getitem__(index)).of(self)

    def of(self, recording: Any) -> "Touches":
        """Take over the notes and doubts of a recording."""
        self.notes, self.doubts = (
            tuple(getattr(recording, name, ())) for name in ("notes", "doubts")
        )
        self.unit = getattr(recording, "unit", "pF")
        return self

    def __repr__(self) -> str:
        """Return one line for each touch."""
        return str(display("text.touches", self, display("text.remarks", self.notes, self.doubts)))

    def _repr_html_(self) -> str:
        return str(display("cards.touches", self, display("text.remarks", self.notes, self.doubts)))

    def plot(self, ax: Any = None) -> Any:
        """Draw the ratio of each touch over its begin, with its uncertainty and flags.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Default: new axes of pyplot.

        Returns
        -------
        matplotlib Axes

        Raises
        ------
        MissingExtra
            matplotlib is missing; type: pip install 'palpate[science]'.
        """
        return display("plots.touches", self, ax)

    def to_arrow(self) -> Any:
        """Return a pyarrow.Table, a row for each touch: the fields of `Touch.as_dict`, flags and effects as plain columns."""
        return arrow_of_touches([touch.as_dict() for touch in self])


_FIELDS = [
    (name, Any) for name, member in vars(Touch).items() if isinstance(member, GetSetDescriptorType)
]
_RECORD = make_dataclass("Touch", _FIELDS)
for _name in ("fields", "params"):  # pandas and polars make columns of them
    setattr(Touch, f"__dataclass_{_name}__", getattr(_RECORD, f"__dataclass_{_name}__"))
Touch.__annotations__ = _RECORD.__annotations__


class Channels(Protocol):
    """Interface of a recording in memory for `touches`."""

    @property
    def t_hard_s(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def t_soft_s(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def hard(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def soft(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def full_scale_pF(self) -> float: ...  # noqa: D102


@runtime_checkable
class Blocks(Protocol):
    """Interface of a recording read in blocks for `touches`."""

    @property
    def timed(self) -> bool: ...  # noqa: D102
    @property
    def full_scale_pF(self) -> float: ...  # noqa: D102
    @property
    def tares(self) -> frozenset[int]: ...  # noqa: D102
    def blocks(self) -> Iterator[Block]: ...  # noqa: D102


class Tracked(NamedTuple):
    """What a tracker found in a recording."""

    touches: Touches
    retaken: int  # how often the baseline was measured again
    cut: int  # how many of the last touches ran when the recording ended: 0 or 1


_UNTESTED = "the model was not tested: pairs slower than 40 ms, or on no even grid, or a channel falls; a tilt, an offset, a lag are not seen"


def _is_untested(touch: Touch) -> bool:
    """Return whether a touch of a scene with a test had no pairs for it."""
    effects = {name: size for name, size in touch.effects.items() if name != "shift"}
    return bool(effects) and touch.samples >= 20 and not any(effects.values())


def baseline_takes(period_s: float) -> str:
    """Return how long nothing may be touched before a touch; period_s: from pair to pair, 0: not known."""
    pair_s = period_s if period_s > 1 / 120 else 0.025  # a mean of a fast converter
    return "a baseline takes 32 pairs without contact" + (
        f", {32 * pair_s:.2g} s here" if period_s > 0 else ""
    )


def _noted(touches: Touches, tracker: Tracker, period_s: float) -> Touches:
    """Add notes: what the tracker has counted, the model was not tested, the next touch came too soon."""
    counts = (tracker.retaken, tracker.pressed_again)
    retaken, pressed = (
        "once" if count == 1 else f"{count} times" if count else "" for count in counts
    )
    untested = sum(_is_untested(touch) for touch in touches)
    soon = sum(
        bool(one.effects) and not one.revised and "gap" not in after.flags
        for one, after in pairwise(touches)
    )
    notes = {
        f"{RETAKEN} ({retaken})": retaken,
        f"pressed again before it was lifted ({pressed}): such a press is no touch": pressed,
        f"pairs are {period_s:.3g} s apart: a touch has few; times are in s, or integers of ns": period_s
        > 0.5,
        f"{untested} of {len(touches)} touches: {_UNTESTED}": untested,
        f"{soon} of {len(touches)} touches were followed too soon by the next one: {baseline_takes(period_s)}; a drift stays in them": soon,
    }
    touches.notes += tuple(note for note, counts in notes.items() if counts)
    return touches


Windows = Sequence[tuple[float, float]]
"""Times of touches that are cut out by hand: begin and end of each, s."""


def tracked(
    recording: Channels | Blocks,
    *,
    scene: "_Scene" = "handheld",
    windows: Windows | None = None,
    **settings: Unpack["_AnySettings"],
) -> Tracked:
    """Return the touches of one recording, as `palpate.touches` does for any number of them, and what the tracker knows."""
    if windows is not None:
        return _tracked_in(windows, recording, scene, settings)
    tracker = tracker_of(recording, scene, settings)
    period_s = 0.0
    for _, part in _parts(tracker, recording):
        tracker.take(*part)
        if not period_s and len(part[0]) > 1 and timed(recording):
            period_s = float(np.median(np.diff(part[0]))) / (
                1e9 if isinstance(recording, Blocks) else 1
            )
    ended = tracker.touch_count
    tracker.finish()
    found = Touches(
        tracker.touches if timed(recording) else [touch._untimed() for touch in tracker.touches]
    )
    found = found.of(recording)
    if not isinstance(recording, Blocks) and not getattr(recording, "understood", ""):
        found.notes += tuple(_of_arrays(recording))
    return Tracked(_noted(found, tracker, period_s), tracker.retaken, tracker.touch_count - ended)


def _of_arrays(recording: Channels) -> Iterator[str]:
    """Yield notes on times and values that no table has checked."""
    from palpate.importers.table_checks import clipped

    bad, rows = (
        np.count_nonzero(~np.isfinite(recording.t_hard_s + recording.t_soft_s)),
        len(recording.hard),
    )
    if 0 < bad < rows:
        yield f"{bad} of {rows} rows have a time that is no number: no time is used, pairs are taken for 26 ms apart"
    for name, values in {"hard": recording.hard, "soft": recording.soft}.items():
        if len(values) and values[0] not in (
            np.nanmin(values, initial=np.inf),
            np.nanmax(values, initial=-np.inf),
        ):
            yield from clipped(name, values)


_LEFT, _INSIDE, _AFTER = 1, 2, 3  # parts of a recording beside a window; 0: before the contact
_WHOLE: dict[str, Any] = {"samples": None, "seconds": None, "age": 0.0, "release": 0.1}
"""Settings with which a touch ends where the probe is lifted."""


def _tracked_in(
    windows: Windows, recording: Channels | Blocks, scene: "_Scene", settings: "_AnySettings"
) -> Tracked:
    """Return the touch in each window. Its baseline is from the readings without contact before it."""
    known = Tracker(scene).settings
    given: Any = {**settings, **{name: value for name, value in _WHOLE.items() if name in known}}
    tracker = tracker_of(recording, scene, given)
    if not timed(recording):
        raise ValueError(
            "windows: got a recording without times, allowed: one with times; name its column, as time=COL"
        )
    fed = [
        (part[0], part[4]["contact"]) for part in feed_recording(tracker, recording) if len(part[0])
    ]
    tracker.finish()
    if not fed:
        raise ValueError("windows: got a recording without samples, allowed: one with samples")
    times, contact = (np.concatenate(columns) for columns in zip(*fed, strict=True))
    times = np.maximum.accumulate(times)
    found = []
    for window in windows:
        try:
            begin_s, end_s = map(float, window)
        except (TypeError, ValueError):
            allowed = "a list of pairs of times, s, as [(4.0, 6.0)]"
            raise ValueError(f"windows: got {window!r:.40} in it, allowed: {allowed}") from None
        begin, end = (
            int(np.searchsorted(times, begin_s)),
            int(np.searchsorted(times, end_s, "right")),
        )
        if not (times[0] <= begin_s < times[-1] and begin < end):
            span = f"begin before end, with samples, within {times[0]:.3f} to {times[-1]:.3f} s"
            raise ValueError(f"windows: got {begin_s:g} to {end_s:g} s, allowed: {span}")
        starts = [touch.start for touch in tracker.touches]
        left = max(
            [start for start in starts if start < begin and contact[begin - 1]], default=begin
        )
        following = min([start for start in starts if start >= end], default=len(times))
        again = tracker_of(recording, scene, given)
        touches, retaken = _cut_out(again, recording, [left, begin, end, following])
        if len(touches) != 1 or retaken:
            why = (
                "the baseline before it was measured in contact" if retaken else _WHY[bool(touches)]
            )
            raise ValueError(
                f"windows: got {begin_s:g} to {end_s:g} s: {why}, allowed: one press after a second without contact"
            )
        found += touches
    return Tracked(Touches(found).of(recording), tracker.retaken, 0)


_WHY = (
    "nothing rises above the baseline before it, or the window is too short",
    "the probe is lifted in it, and pressed again",
)


def _cut_out(
    tracker: Tracker, recording: Channels | Blocks, rows: list[int]
) -> tuple[list[Touch], int]:
    """Feed a recording up to the last of four rows; return the touches from the second to the third, where they end.

    Readings from the first to the second are left out: the contact that has begun before the window. Also returned is
    how often the baseline was found to be wrong from the second row on.
    """
    at, stage, counts, retaken = 0, 0, list[int](), 0
    for _, part in _parts(tracker, recording):
        edges = np.clip(np.array(rows) - at, 0, len(part[0]))
        at += len(part[0])
        for piece, columns in enumerate(
            zip(*(np.split(column, edges) for column in part), strict=True)
        ):
            if not len(columns[0]) or piece > _AFTER:
                continue
            if stage < piece in (_INSIDE, _AFTER):
                tracker.finish()
                counts.append(tracker.touch_count)
                retaken = retaken if len(counts) > 1 else tracker.retaken
            stage = piece
            t_hard, t_soft, hard, soft = columns
            tracker.take(
                t_hard,
                t_soft,
                *((hard * math.nan, soft * math.nan) if piece == _LEFT else (hard, soft)),
            )
    tracker.finish()
    counts.append(tracker.touch_count)
    return tracker.touches_since(counts[0])[: counts[1] - counts[0]], tracker.retaken - retaken


def tracker_of(recording: Channels | Blocks, scene: "_Scene", settings: "_AnySettings") -> Tracker:
    """Return a new tracker for a recording: with its full scale and its stamps, and a length that it can have."""
    if not hasattr(recording, "full_scale_pF"):
        raise TypeError(
            f"recording: got {recording!r:.60}, allowed: the result of palpate.read or palpate.recorded; "
            "a live source has to be recorded first"
        )
    stamps = "host" if getattr(recording, "host_stamps", False) else "converter"
    of_device = {"full_scale_pF": recording.full_scale_pF, "stamps": stamps}
    given: dict[str, Any] = settings_for(
        scene, of_device | {"period_s": getattr(recording, "period_s", 0.0)}
    )
    given |= settings
    require_scale(scene, getattr(recording, "unit", "pF"), settings)
    if not timed(recording):
        given = _without_times(scene, given)
    return Tracker(scene, **given)


_PAIRS = 250  # the length of a touch of one converter


def _without_times(scene: "_Scene", given: dict[str, Any]) -> dict[str, Any]:
    """Return settings with a length in samples in place of seconds, and without means over some time."""
    if given.get("seconds") is not None:
        raise ValueError(
            f"seconds: got {given['seconds']:g} for a recording without times, allowed: samples; or name the column of times"
        )
    usual = Tracker(scene).settings
    free: dict[str, Any] = {"averaged": 0.0} if "averaged" in usual else {}
    if usual["seconds"] is not None and "seconds" not in given:
        free |= {"samples": _PAIRS, "seconds": None}
    return free | given


def timed(recording: Channels | Blocks) -> bool:
    """Return whether the times of a recording are known."""
    if isinstance(recording, Blocks):
        return recording.timed
    return bool(np.isfinite(recording.t_hard_s).all() and np.isfinite(recording.t_soft_s).all())


def feed_recording(
    tracker: Tracker, recording: Channels | Blocks
) -> Iterator[tuple[NDArray[Any], ...]]:
    """Feed a recording to a tracker; yield times, s, readings, the rows of the tracker, and the number of the era, in parts."""
    for era, part in _parts(tracker, recording):
        taken = tracker.process(*part)
        seconds = [ns / 1e9 for ns in part[:2]] if isinstance(recording, Blocks) else part[:2]
        yield *seconds, *part[2:], taken, np.full(len(taken), era)


def _parts(
    tracker: Tracker, recording: Channels | Blocks
) -> Iterator[tuple[int, tuple[NDArray[Any], ...]]]:
    """Yield the readings in parts, as a tracker takes them, with the number of each era; between them tell it of gaps."""
    if isinstance(recording, Blocks):
        yield from _parts_of_blocks(tracker, recording)
        return
    rows = np.arange(len(recording.hard)) * UNTIMED_NS  # the same time for both channels
    t_hard, t_soft = (recording.t_hard_s, recording.t_soft_s) if timed(recording) else (rows, rows)
    for era, (begin, end) in enumerate(
        pairwise([0, *getattr(recording, "gap_rows", ()), len(rows)])
    ):
        if era:
            tracker.gap()
        yield (
            era,
            tuple(column[begin:end] for column in (t_hard, t_soft, recording.hard, recording.soft)),
        )


def _parts_of_blocks(
    tracker: Tracker, recording: Blocks
) -> Iterator[tuple[int, tuple[NDArray[Any], ...]]]:
    tares, era = recording.tares, 0  # once: found anew among all marks at each use
    gaps = {seq for seq, _ in getattr(recording, "gap_marks", ())}
    for block in recording.blocks():
        yield (
            era,
            (
                block["t_hard_ns"],
                block["t_soft_ns"],
                *usable(block, tracker.settings["full_scale"]),
            ),
        )
        if (last := int(block["seq"][-1])) in gaps:
            tracker.gap()
        elif last in tares:
            tracker.tare(force=True)  # as in the measurement, where it may have been forced
        era += last in tares
