"""Reference of the revision: what the baseline after the release says about a touch."""

from typing import NamedTuple

import numpy as np

SURE, SIGNIFICANT = 3.0, 8.0  # standard deviations: the baselines drifted; the ratio is known to be wrong
FALLEN = 0.05  # share of the touch
RECOVERY_VALUES = 16  # over which a recovery is seen, between two medians of as many values
RECOVERED = 4.0  # standard errors of the change
RECOVERED_NOISE = 1.77  # of the move in noises: 4 sqrt(pi / 2) sqrt(2 / 16)


class Known(NamedTuple):
    """What is known of the baseline of a channel.

    Attributes
    ----------
    level, variance : float, pF, pF^2
        Level, and its variance.
    age : float, readings
        Mean age of its values.
    noise : float, pF
        Standard deviation of a value.
    slope : float, pF
        Change from value to value.

    Examples
    --------
    >>> Known(0.62).age
    15.5
    """

    level: float
    variance: float = 1e-11
    age: float = 15.5
    noise: float = 4e-5
    slope: float = 0.0


class Revised(NamedTuple):
    """The result of a revision.

    Attributes
    ----------
    kind : str
        "drift": the ratio is corrected; "creep", "baseline": it is not.
    shift : float
        Of the ratio.
    variance : float, pF^2
        Of the two baselines at the mean time of the samples, as a variance of C1 - r C2.
    open : float
        Variance of the ratio that is left open.
    significant : bool
        Whether the baselines moved by more than 8 standard deviations.

    Examples
    --------
    >>> Revised("drift", 0.01, 1e-11, 0.0, False).kind
    'drift'
    """

    kind: str
    shift: float
    variance: float
    open: float
    significant: bool


def line_share(middle: float, start: float, end: float, ages: tuple[float, float]) -> float:
    """Return where on the line between two baselines the middle of a touch is: 0, at the first one, to 1; times in readings."""
    first, second = start - ages[0], end - ages[1]
    return (middle - first) / (second - first) if middle < second else 1.0


def revised(
    before: tuple[Known, Known],
    after: tuple[Known, Known],
    *,
    ratio: float,
    mean: float,
    share: float,
    changed: bool = False,
) -> Revised:
    """Return what the change of the baselines did to a ratio.

    Parameters
    ----------
    before, after : (Known, Known)
        Baselines of the hard and the soft channel before and after the touch.
    ratio : float
        Of the touch.
    mean : float, pF
        Mean regressor.
    share : float
        `line_share` of the touch.
    changed : bool
        Whether the ratio changed during the touch: a jump of a baseline does that.

    Returns
    -------
    Revised

    Notes
    -----
    With D the change from the first baselines to those at the mean time of the samples, the true ratio is
    r - (D_hard - r D_soft) / mean. D is a share of the whole change: by the line, if the change is more than 3
    standard deviations; otherwise by the mean of both baselines with the smallest variance.

    Examples
    --------
    >>> first, second = (Known(0.62), Known(-0.41)), (Known(0.6204), Known(-0.41))
    >>> round(revised(first, second, ratio=2.5, mean=0.2, share=0.5).shift, 6)
    -0.001
    """
    hard, soft = (later.level - earlier.level for earlier, later in zip(before, after, strict=True))
    first, second = (known[0].variance + ratio**2 * known[1].variance for known in (before, after))
    change, error = hard - ratio * soft, np.sqrt(first + second)
    drifted = abs(change) > SURE * error
    part = share if drifted else first / (first + second)
    shift = -part * change / mean
    significant = bool(abs(change) > SIGNIFICANT * error)
    if -(hard + soft) > FALLEN * (ratio + 1) * mean:
        return Revised("baseline", shift, first, shift**2, significant)
    if any(_recovers(*channel) for channel in zip(before, after, strict=True)):
        return Revised("creep", shift, first, shift**2, significant)
    # Half of the correction is open for a jump, a quarter for an exponential.
    left_open = (shift / (2 if changed else 4)) ** 2 if drifted else 0.0
    return Revised("drift", shift, (1 - part) ** 2 * first + part**2 * second, left_open, significant)


def _recovers(before: Known, after: Known) -> bool:
    """Return whether a channel moves back after the release, by more than 4 standard errors of the move and the change."""
    change, move = after.level - before.level, RECOVERY_VALUES * after.slope
    moves_back = move * change < 0 and abs(move) > RECOVERED_NOISE * before.noise
    return moves_back and change**2 > RECOVERED**2 * (before.variance + after.variance)
