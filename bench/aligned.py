"""The pairs of a simulated press, aligned as in the scene handheld, for estimators that have no alignment of their own."""

from dataclasses import dataclass

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.benchmark import LENGTH_S
from palpate.simulation import Simulation

Array = NDArray[np.float64]
FAST_S, LONGEST_S, GAP_S = 0.0285, 0.04, 1.0  # longest pair for the fast filters, for the slow ones; longest gap
PATIENCE = 8  # windows one after the other that are not even, until the soft channel is interpolated
EARLY_S = 0.1  # the baseline ends so long before the press


@dataclass(frozen=True)
class Pairs:
    """Aligned pairs.

    Attributes
    ----------
    at : numpy.ndarray of int, shape (n,)
        Index of the pair of readings that completes each: one later than the hard reading that is aligned.
    centre : numpy.ndarray of int, shape (n,)
        Index of that hard reading.
    hard, soft : numpy.ndarray, shape (n,), pF
    """

    at: NDArray[np.intp]
    centre: NDArray[np.intp]
    hard: Array
    soft: Array


def aligned(run: Simulation) -> Pairs:
    """Return what palpate::MatchedPair makes of the readings of a simulation: plain numpy, windows side by side."""
    hard_at, soft_at = (np.flatnonzero(np.isfinite(values)) for values in (run.hard, run.soft))
    th, h, ts, s = run.t_hard_s[hard_at], run.hard[hard_at], run.t_soft_s[soft_at], run.soft[soft_at]
    last = np.arange(3, len(ts))  # the newest soft reading of each window of four
    i = np.searchsorted(th, ts[last - 1], "right") - 1  # the newest hard one between the two in the middle
    known = (i >= 0) & (th[i] > ts[last - 2])
    last, i = last[known], i[known]
    four = last[:, None] + np.arange(-3, 1)
    at_once = th[i] == ts[last - 1]
    three = np.clip(i[:, None] + np.arange(-1, 2), 0, len(th) - 1)
    whole = (i >= 1) & (i + 1 < len(th)) & (hard_at[three[:, 2]] <= soft_at[last])
    period = (ts[last] - ts[last - 3]) / 3
    hard_off = th[three] - th[i, None] - period[:, None] * np.arange(-1, 2)
    soft_off = ts[four] - th[i, None] - period[:, None] * np.arange(-1.5, 2)
    near = np.abs(np.hstack([hard_off, soft_off])).max(axis=1) < period / 4
    even = whole & near & (period <= LONGEST_S)
    hard, soft = _filtered(h[three], s[four], hard_off, soft_off, period)
    hard = np.where(at_once | ~even, h[i], hard)
    soft = np.where(at_once, s[last - 1], np.where(even, soft, _cubic(ts[four], s[four], th[i])))
    patient = _since(even[~at_once]) >= PATIENCE
    valid = even | at_once
    valid[~at_once] |= patient & (ts[last - 1] - ts[last - 2] <= GAP_S)[~at_once]
    return Pairs(soft_at[last[valid]], hard_at[i[valid]], hard[valid], soft[valid])


def contact(run: Simulation) -> tuple[NDArray[np.intp], Array, Array]:
    """Return the aligned changes of both channels in the first press: index of each pair, output, regressor.

    The beginning of the press is known, and each baseline is the mean of the readings before it.
    """
    start = run.presses[0].start_s
    pairs = aligned(run)
    idle = run.t_hard_s < start - EARLY_S
    used = np.isfinite(run.true_ratio[pairs.at]) & (run.t_hard_s[pairs.centre] >= start)
    used &= run.t_hard_s[pairs.at] < start + LENGTH_S
    output, regressor = pairs.hard[used] - np.nanmean(run.hard[idle]), pairs.soft[used] - np.nanmean(run.soft[idle])
    return pairs.at[used], output, regressor


def _filtered(h: Array, s: Array, hard_off: Array, soft_off: Array, period: Array) -> tuple[Array, Array]:
    """Return both channels filtered with the same response; rows are windows of 3 hard and 4 soft readings.

    y = (1 - 2 a1) h[1] + a1 (h[0] + h[2]), x = (1/2 - b2) (s[1] + s[2]) + b2 (s[0] + s[3]), each reading first moved to
    its place in an even grid along the slope beside it.
    """
    settings, fast = palpate.Tracker("handheld").settings, period <= FAST_S
    a1, b2 = (np.where(fast, settings[side], settings[f"slow_{side}"]) for side in ("hard_side", "soft_side"))
    rise = np.diff(h, axis=1)
    h0, h2 = (h[:, k] - hard_off[:, k] / period * rise[:, k // 2] for k in (0, 2))
    slope = np.stack([s[:, 1] - s[:, 0], (s[:, 2] - s[:, 0]) / 2, (s[:, 3] - s[:, 1]) / 2, s[:, 3] - s[:, 2]], axis=1)
    moved = s - soft_off / period[:, None] * slope
    x = (0.5 - b2) * (moved[:, 1] + moved[:, 2]) + b2 * (moved[:, 0] + moved[:, 3])
    return (1 - 2 * a1) * h[:, 1] + a1 * (h0 + h2), x


def _cubic(t: Array, s: Array, at: Array) -> Array:
    """Return the cubic through the four readings of each row at one time."""
    value = np.zeros(len(at))
    for i in range(4):
        others = [j for j in range(4) if j != i]
        value += s[:, i] * np.prod([(at - t[:, j]) / (t[:, i] - t[:, j]) for j in others], axis=0)
    return value


def _since(event: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return how many places ago each last event was; from the first place without one, 1, 2, ..."""
    place = np.arange(1, len(event) + 1)
    return place - np.maximum.accumulate(np.where(event, place, 0))
