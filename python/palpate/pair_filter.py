"""Design of the two filters that align the channels: coefficients for a pair period."""

from dataclasses import dataclass

import numpy as np

BAND_Hz = (0.2, 13.0)
"""Sway and tremor of a hand."""
_LINES_Hz = 3.0  # tremor from here on: weight 1; slower movements are matched almost by themselves: weight 0.3
_SLOW = 0.3
_NOISE = 1e-6  # weight of the power gain of white noise, against a mean square mismatch
_FAST_S = 0.0285  # up to here the coefficients have no prefix: settings of `palpate.Tracker`
_LONGEST_S = 0.04


@dataclass(frozen=True)
class PairFilter:
    """Two filters, one for each channel, with nearly the same response.

    With h and s on an even grid, s half a period after h:
    y(k) = (1 - 2 a1) h(k) + a1 (h(k-1) + h(k+1)), x(k) = (1/2 - b2) (s(k-1) + s(k)) + b2 (s(k-2) + s(k+1)).

    Attributes
    ----------
    period_s : float
        Of a pair.
    hard_side, soft_side : float
        The coefficients a1 and b2.
    mismatch : float
        ``|A - B|`` of the two responses, rms from 3 Hz to the end of the band: the part of a tremor that is left.
    """

    period_s: float
    hard_side: float
    soft_side: float
    mismatch: float

    @property
    def settings(self) -> dict[str, float]:
        """The coefficients as settings of `palpate.Tracker`: for pairs up to 28.5 ms, or from there to 40 ms."""
        prefix = "" if self.period_s <= _FAST_S else "slow_"
        return {f"{prefix}hard_side": self.hard_side, f"{prefix}soft_side": self.soft_side}


def matched_pair(period_s: float, *, band_Hz: tuple[float, float] = BAND_Hz) -> PairFilter:
    """Return the filters for a pair period.

    Least squares for ``|A - B|^2`` over the band (weight 1 from 3 Hz on, 0.3 below), plus 1e-6 times the power gain
    of white noise, A = 1 - 2 a1 (1 - cos w) and B = (1 - 2 b2) cos(w / 2) + 2 b2 cos(3 w / 2), w = 2 pi f period_s. The
    constants of the core are the results for 26 and 31.5 ms.

    Parameters
    ----------
    period_s : float, in (0, 0.04]
        Time from pair to pair. Above 40 ms the band does not fit: the tracker interpolates there.
    band_Hz : (float, float)
        Frequencies of the movements to match.

    Returns
    -------
    PairFilter

    Raises
    ------
    ValueError
        A period or band out of range.

    Examples
    --------
    >>> found = matched_pair(0.026)
    >>> round(found.hard_side, 5), round(found.soft_side, 5), round(found.mismatch, 5)
    (0.21048, 0.04482, 0.00125)
    >>> from palpate import Tracker
    >>> Tracker("handheld", **matched_pair(0.035).settings).settings["slow_hard_side"] > 0.22
    True
    """
    low, high = band_Hz
    if not 0 < period_s <= _LONGEST_S:
        raise ValueError(f"period_s: got {period_s}, allowed: 0 < period_s <= {_LONGEST_S}; the tracker interpolates")
    if not 0 < low < high < 1 / period_s:
        raise ValueError(f"band_Hz: got {band_Hz}, allowed: 0 < low < high < {1 / period_s:.4g}, the pair rate")
    f = np.linspace(low, high, 400)
    w = 2 * np.pi * f * period_s
    # A - B, with b1 = 1/2 - b2: 1 - cos(w/2) + a1 (2 cos w - 2) - b2 (2 cos(3w/2) - 2 cos(w/2)).
    terms = np.stack([2 * np.cos(w) - 2, 2 * np.cos(w / 2) - 2 * np.cos(1.5 * w)], axis=1)
    fixed = np.cos(w / 2) - 1
    weight = np.sqrt(np.where(f >= _LINES_Hz, 1.0, _SLOW) / len(f))
    root2 = np.sqrt(2)
    gain = np.sqrt(_NOISE) * np.array([[-2, 0], [root2, 0], [0, -root2], [0, root2]])
    gain_fixed = np.sqrt(_NOISE) * np.array([-1, 0, -root2 / 2, 0])
    a1, b2 = np.linalg.lstsq(
        np.vstack([terms * weight[:, None], gain]), np.concatenate([fixed * weight, gain_fixed]), rcond=None
    )[0]
    left = (terms @ [a1, b2] - fixed)[f >= min(_LINES_Hz, high)]
    return PairFilter(period_s, float(a1), float(b2), float(np.sqrt(np.mean(left**2))))
