"""Touches of a recording, estimated afterwards: with more points, all idle readings, and spikes left out."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from palpate._core import Touch, Tracker
from palpate.touch import Blocks, Channels, replayed, timed
from palpate.window_filters import HARD, SOFT, Windows, windows

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene

Array = NDArray[np.float64]
METHOD = f"offline: matched pair of {HARD} + {SOFT} points"
_FEWEST = 8  # pairs, and readings of a baseline
_NEAR_S = 4.0  # readings of a baseline are at most as long before or after
_MARGIN_S = 0.1  # not in a baseline: a touch may begin before it is above the noise
_SETTLED = 32  # readings with which the tracker measures a new baseline; they begin after the release
_LIMIT = 6.0  # standard deviations of a spike
_ROUNDS = 8  # of leaving out spikes
_BATCHES = 16
_MISFITS = frozenset({"offset", "drift", "lag", "curve", "creep", "baseline"})


@dataclass(frozen=True)
class OfflineTouch:
    """A touch estimated afterwards, beside the live result.

    Attributes
    ----------
    ratio, standard_error : float
        Of this method; nan if it has no result.
    method : str
        Its name; without a result, why.
    pairs : int
        Number of windows used.
    from_s, to_s : float
        First and last reading used, s: if the ratio changed, those after the last change.
    spikes : int
        Readings left out as spikes.
    baselines : str
        "before and after", or the only one that is known or may be used.
    live : Touch
        The touch as the tracker found it, with its flags, which hold here, too.
    """

    ratio: float
    standard_error: float
    method: str
    pairs: int
    from_s: float
    to_s: float
    spikes: int
    baselines: str
    live: Touch

    @property
    def flags(self) -> tuple[str, ...]:
        """Warnings about the touch: those of `live`."""
        return self.live.flags

    def as_dict(self) -> dict[str, Any]:
        """Return all fields but `live` as plain numbers; nan becomes None."""
        fields = {name: value for name, value in self.__dict__.items() if name != "live"}
        return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in fields.items()}


@dataclass
class _Channel:
    """Readings of one channel with a value: times, values, which are idle, and the rows that they are from."""

    t: Array
    value: Array
    row: NDArray[np.intp]


@dataclass(frozen=True)
class _Level:
    """A line between two means: times, values, variances of these; and the noise of a reading."""

    t: Array
    value: Array
    variance: Array
    noise: float

    def share(self, t: Array) -> Array:
        """Return the part of the later mean in the level at times t."""
        if len(self.t) == 1:
            return np.zeros_like(t)
        return np.clip((t - self.t[0]) / (self.t[1] - self.t[0]), 0, 1)

    def at(self, t: Array) -> Array:
        """Return the level at times t."""
        return np.asarray(self.value[0] + self.share(t) * (self.value[-1] - self.value[0]))


def offline(
    recording: Channels | Blocks, *, scene: "_Scene" = "handheld", **settings: Unpack["_AnySettings"]
) -> list[OfflineTouch]:
    """Return the touches of a recording, each estimated again with the whole recording known.

    The tracker finds the touches, as in `palpate.touches`. Then the readings of each one, from its beginning or from
    the last change of its ratio to its end, are estimated by a method of its own:

    - a matched pair of filters of 5 + 6 points for each hard reading, designed for the real times of its readings;
    - instrumental variables, r = sum z y / sum z x, z a mean of the soft readings around those of x, without them: no
      bias in a light touch;
    - single readings that contradict the others, and windows with gaps, are left out;
    - the baseline is a line between the means of the idle readings of up to 4 s before and after (as in the live
      result, not after a creep).

    The standard error has the noise of the readings, the scatter of parts of the touch, and the baselines. With a
    flag that says that the readings contradict hard = ratio * soft, it is at least that of the live result.

    Parameters
    ----------
    recording : Recording, Simulation, or the result of `palpate.recorded`
        As in `palpate.touches`; it is kept in memory as a whole.
    scene : str
        As in `Tracker`; not "fixed".
    **settings
        As in `Tracker`.

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
    """
    if scene == "fixed":
        raise ValueError("scene: got 'fixed', allowed: a scene with a baseline and contacts, as 'handheld'")
    if not hasattr(recording, "full_scale_pF"):
        raise TypeError(f"recording: got {recording!r:.60}, allowed: the result of palpate.read or palpate.recorded")
    if not timed(recording):
        raise ValueError("recording: it has no times, and the rate is needed; name its column of times")
    given: dict[str, Any] = {"full_scale": recording.full_scale_pF, **settings}
    tracker = Tracker(scene, **given)
    parts = list(replayed(tracker, recording))
    tracker.finish()
    if not tracker.touches:
        return []
    t_hard, t_soft, hard, soft = (np.concatenate([part[i] for part in parts]) for i in range(4))
    rows = np.concatenate([part[4] for part in parts])
    if tracker.settings.get("host_stamps"):
        t_hard, t_soft = _smooth(t_hard), _smooth(t_soft)
    channels = tuple(
        _channel(t, value, tracker.settings["full_scale"]) for t, value in ((t_hard, hard), (t_soft, soft))
    )
    return _all(tracker.touches, rows, channels)


def _smooth(t: Array) -> Array:
    """Return times of a host, each as the middle of a line through those of the 16 rows before and after it."""
    rows = np.arange(len(t))
    breaks = np.flatnonzero(np.abs(np.diff(t)) > 8 * np.median(np.diff(t))) + 1  # a pause is not smoothed away
    out = np.empty_like(t)
    for part in np.split(rows, breaks):
        sums, first, last = np.append(0, np.cumsum(t[part] - t[part[0]])), part[0], part[-1]
        wide = np.minimum(16, np.minimum(part - first, last - part))
        out[part] = t[first] + (sums[part - first + wide + 1] - sums[part - first - wide]) / (2 * wide + 1)
    return out


def _channel(t: Array, value: Array, full_scale: float) -> _Channel:
    row = np.flatnonzero(np.abs(value) < full_scale)  # nan is not
    row = row[np.diff(t[row], prepend=-math.inf) > 0]
    return _Channel(t[row], value[row], row)


def _all(touches: list[Touch], rows: NDArray[Any], channels: tuple[_Channel, ...]) -> list[OfflineTouch]:
    spans = [np.flatnonzero(rows["touch"] == number)[[0, -1]] for number in range(1, len(touches) + 1)]
    starts = [touch.start for touch in touches] + [len(rows)]
    pauses = [_pause(rows, spans[i][1], starts[i + 1]) for i in range(len(touches))]
    idle = _idle(rows, starts, pauses)
    found = []
    for i, touch in enumerate(touches):
        alarms = np.flatnonzero(rows["alarm"][starts[i] : spans[i][1] + 1])
        first = starts[i] + (alarms[-1] + 1 if len(alarms) else 0)
        levels = [_level(channel, idle, touch, starts[i], (pauses[i], starts[i + 1])) for channel in channels]
        inside = [_part(channel, first, spans[i][1] + 1) for channel in channels]
        found.append(_estimate(touch, *inside, *levels))
    return found


def _pause(rows: NDArray[Any], last: int, end: int) -> int:
    """Return the first row after a touch with which its new baseline was measured; `end` if there was no time."""
    out = np.flatnonzero(~rows["contact"][last:end])
    if not len(out):
        return end
    level = rows["hard_baseline"][last + out[0] : end]
    new = np.flatnonzero(level != level[0])
    return int(last + out[0] + max(new[0] - _SETTLED + 1, 0)) if len(new) else end


def _idle(rows: NDArray[Any], starts: list[int], pauses: list[int]) -> NDArray[np.bool_]:
    idle = np.ones(len(rows), bool)
    for start, pause in zip(starts, pauses, strict=False):
        idle[start:pause] = False
    return idle


def _part(channel: _Channel, first: int, end: int) -> _Channel:
    of, to = np.searchsorted(channel.row, [first, end])
    return _Channel(channel.t[of:to], channel.value[of:to], channel.row[of:to])


def _level(channel: _Channel, idle: Any, touch: Touch, start: int, after: tuple[int, int]) -> _Level | None:
    part = _part(channel, 0, start)
    mine = idle[part.row]
    sides = []
    if mine.any() and "baseline" not in touch.flags:
        t, value = part.t[mine], part.value[mine]
        begin = channel.t[len(part.t)] - _MARGIN_S if len(part.t) < len(channel.t) else math.inf
        near = (t > t[-1] - _NEAR_S) & (t < begin)
        sides.append((t[near], value[near]))
    part = _part(channel, *after)
    if len(part.t) and "creep" not in touch.flags:
        near = part.t < part.t[0] + _NEAR_S
        if after[1] < len(idle):
            near &= part.t < part.t[-1] - _MARGIN_S
        sides.append((part.t[near], part.value[near]))
    means = [_mean(*side) for side in sides if len(side[0]) >= _FEWEST]
    if not means:
        return None
    t, value, variance, noise = np.array(means).T
    return _Level(t, value, variance, float(np.sqrt(np.mean(noise**2))))


def _mean(t: Array, value: Array) -> tuple[float, float, float, float]:
    """Return mean time, mean, its variance, and the noise, of the values that are near their line."""
    steps = np.diff(np.unique(value))
    code = float(steps.min()) if len(steps) else 0.0
    kept = np.ones(len(t), bool)
    centre = np.median(value)
    limit = _LIMIT * 1.4826 * np.median(np.abs(value - centre))
    kept = np.abs(value - centre) <= max(limit, 1.5 * code)
    t, value = t[kept], value[kept]
    line = np.polynomial.Polynomial.fit(t, value, 1)
    noise2 = float(np.sum((value - line(t)) ** 2)) / max(len(t) - 2, 1)
    # Codes that are coarser than the noise: the mean of rounded values is off by up to code / pi.
    coarse = (code / math.pi) ** 2 / 2 * math.exp(-4 * math.pi**2 * max(noise2 / code**2 - 1 / 12, 0)) if code else 0.0
    return float(t.mean()), float(value.mean()), noise2 / len(t) + coarse, math.sqrt(noise2)


def _estimate(
    touch: Touch, hard: _Channel, soft: _Channel, level_h: _Level | None, level_s: _Level | None
) -> OfflineTouch:
    if level_h is None or level_s is None:
        return _none(touch, "no idle readings before or after the touch")
    y_all, x_all = hard.value - level_h.at(hard.t), soft.value - level_s.at(soft.t)
    use_h, use_s = np.ones(len(hard.t), bool), np.ones(len(soft.t), bool)
    spikes = 0
    for _ in range(_ROUNDS):
        w = windows(hard.t[use_h], soft.t[use_s])
        if len(w.mismatch) < _FEWEST:
            return _none(touch, "too few")
        h, s = y_all[use_h], x_all[use_s]
        y, x, z = (w.hard_weight * h[w.hard_at]).sum(1), (w.soft_weight * s[w.soft_at]).sum(1), _instrument(s, w)
        good = w.mismatch <= max(3e-3, 3 * float(np.median(w.mismatch)))
        high = good & (np.abs(x) > np.abs(x).max() / 2)
        ratio = float(np.median(y[high] / x[high]))
        u = y - ratio * x
        expected = np.sqrt(level_h.noise**2 * (w.hard_weight**2).sum(1) + ratio**2 * level_s.noise**2 * (w.soft_weight**2).sum(1))
        scale = max(1.4826 * float(np.median(np.abs(u[good]))), float(np.median(expected)))
        bad = np.abs(u) > _LIMIT * scale
        if not bad.any():
            break
        eh = _energy(w.hard_at, w.hard_weight, u, len(h))
        es = _energy(w.soft_at, w.soft_weight, u, len(s))
        at = np.flatnonzero(bad)
        ih, is_ = np.flatnonzero(use_h), np.flatnonzero(use_s)
        for run in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1):
            hs, ss = np.unique(w.hard_at[run]), np.unique(w.soft_at[run])
            a, b = hs[np.argmax(eh[hs])], ss[np.argmax(es[ss])]
            if eh[a] >= es[b]:
                use_h[ih[a]] = False
            else:
                use_s[is_[b]] = False
            spikes += 1
    good &= ~bad
    if good.sum() < _FEWEST:
        return _none(touch, "too few")
    D = float((z * x)[good].sum())
    ratio = float((z * y)[good].sum()) / D
    u = y - ratio * x
    zg = np.where(good, z, 0)[:, None]
    c = np.bincount(w.hard_at.ravel(), (zg * w.hard_weight).ravel(), len(h))
    d = np.bincount(w.soft_at.ravel(), (zg * w.soft_weight).ravel(), len(s))
    own = (level_h.noise**2 * (c @ c) + ratio**2 * level_s.noise**2 * (d @ d)) / D**2
    g = (z * u)[good]
    B = min(_BATCHES, len(g) // 4)
    S = np.array([part.sum() for part in np.array_split(g, B)])
    scatter = float(S @ S) * B / (B - 1) / D**2
    vb, shift, vshift = 0.0, 0.0, 0.0
    for weight, t, level, k in ((c, hard.t[use_h], level_h, 1.0), (d, soft.t[use_s], level_s, -ratio)):
        C, P = weight.sum(), weight @ level.share(t)
        vb += k**2 * ((C - P) ** 2 * level.variance[0] + P**2 * level.variance[-1]) / D**2
        shift += k * P * (level.value[-1] - level.value[0]) / D
        vshift += k**2 * P**2 * (level.variance[-1] + level.variance[0]) / D**2
    opened = shift**2 / 16 if shift**2 > 9 * vshift else 0.0
    se = math.sqrt(max(own, scatter) + vb + opened)
    if _MISFITS & set(touch.flags):
        se = max(se, touch.standard_error)
    both = len(level_h.t) == 2 and len(level_s.t) == 2
    return OfflineTouch(ratio, se, METHOD, int(good.sum()), float(hard.t[0]), float(hard.t[-1]), spikes, "before and after" if both else "one", touch)


def _none(touch, why):
    return OfflineTouch(math.nan, math.nan, why, 0, math.nan, math.nan, 0, "", touch)


def _energy(at: Any, weight: Array, u: Array, size: int) -> Array:
    up = np.bincount(at.ravel(), (weight * u[:, None]).ravel(), size)
    squares = np.bincount(at.ravel(), (weight**2).ravel(), size)
    return up**2 / np.maximum(squares, 1e-12)


def _instrument(s: Array, w: Windows) -> Array:
    """Return the mean of the soft readings around those of each window."""
    sums = np.append(0, np.cumsum(s))
    reach = 8
    first, end = w.soft_at[:, 0], w.soft_at[:, -1] + 1
    a, b = np.maximum(first - reach, 0), np.minimum(end + reach, len(s))
    count = b - a - SOFT
    return (sums[b] - sums[a] - (sums[end] - sums[first])) / np.maximum(count, 1)
