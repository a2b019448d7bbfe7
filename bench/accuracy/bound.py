"""The Gaussian Fisher bound of the ratio: no estimator without a bias has a smaller error at that time.

    python -m bench.accuracy.bound [--tremor 0.08]

What is known to the estimator of the bound: the shape of the press, the spectrum of the tremor and the noise. What it has
to find: the ratio, the depth, and the two baselines, of which it has the mean of some pairs before the contact.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
PHASES = 4  # of the first reading after the contact, over one pair


@dataclass(frozen=True)
class Line:
    """A line of a tremor's spectrum: centre and standard deviation in Hz, and its share of the variance."""

    centre_hz: float
    width_hz: float
    share: float


TREMOR = (Line(4.0, 0.4, 0.5), Line(9.0, 0.4, 0.5), Line(0.55, 0.26, 0.25))
"""The default of `palpate.simulation.tremor.Lines`: two lines, and sway in addition."""


@dataclass(frozen=True)
class Setup:
    """A press and its readings.

    Attributes
    ----------
    ratio : float
    depth_pF, rise_s : float
        Change of the soft channel in the hold; duration of the rise, half a cosine.
    noise_pF : float
        Of one reading, rms.
    pair_s : float
        Time from pair to pair; the soft reading comes half of it after the hard one.
    baseline : int
        Pairs before the contact.
    tremor : float
        rms, relative to the force.
    lines : sequence of Line
        Spectrum of the tremor; a share of 1 is the square of `tremor`.
    """

    ratio: float = 2.8
    depth_pF: float = 0.25
    rise_s: float = 0.3
    noise_pF: float = 40e-6
    pair_s: float = 0.026
    baseline: int = 76
    tremor: float = 0.0
    lines: Sequence[Line] = TREMOR


def bound(setup: Setup, since_s: ArrayLike) -> Array:
    """Return the smallest relative standard deviation of the ratio at times since contact.

    The force is a Gaussian process F with mean A p(t) and covariance A^2 p(t) p(t') T(t - t'), where p is the shape of
    the press, A its unknown depth and T the covariance of the tremor. The readings h = r F + b_h + noise and
    s = F + b_s + noise have mean m and covariance C, which depend on (r, A); the Fisher information is

        J_ij = m_i' C^-1 m_j + tr(C^-1 C_i C^-1 C_j) / 2,    with m_i, C_i the derivatives

    (Kay, Estimation Theory, 1993, eq. 3.31). A baseline adds the variance of its mean to C, common to its channel.

    Parameters
    ----------
    setup : Setup
    since_s : array_like, shape (n,), s
        Pairs that are whole at this time are used; 3 pairs at least.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Quadratic mean over the phase of the readings.

    Examples
    --------
    >>> (100 * bound(Setup(), [0.5, 6.0])).round(4)
    array([0.0054, 0.0022])
    """
    moments = np.atleast_1d(np.asarray(since_s, float))
    phases = (np.arange(PHASES) + 0.5) / PHASES * setup.pair_s
    variances = [[_variance(setup, phase, moment) for moment in moments] for phase in phases]
    return np.asarray(np.sqrt(np.mean(variances, axis=0)))


def _variance(setup: Setup, phase_s: float, until_s: float) -> float:
    soft = np.arange(phase_s, until_s, setup.pair_s)  # the end of a pair: a pair counts when it is whole
    hard = soft - setup.pair_s / 2
    return float(np.linalg.inv(information(setup, hard[hard > 0], soft))[0, 0]) / setup.ratio**2


def information(setup: Setup, hard_s: Array, soft_s: Array) -> Array:
    """Return the Fisher information of (ratio, depth) in readings at these times since contact, shape (2, 2)."""
    times = np.concatenate([hard_s, soft_s])
    is_hard = np.arange(len(times)) < len(hard_s)
    shape = 0.5 * (1 - np.cos(np.pi * np.minimum(times / setup.rise_s, 1)))
    mean = np.where(is_hard, setup.ratio, 1.0) * setup.depth_pF * shape
    force = _tremor(setup, times) * np.outer(mean, mean)
    common = (is_hard[:, None] == is_hard) / setup.baseline
    inverse = np.linalg.inv(force + setup.noise_pF**2 * (np.eye(len(times)) + common))
    by = np.stack([is_hard / setup.ratio, np.full(len(times), 1 / setup.depth_pF)])  # d log(mean) by ratio and depth
    slopes = by * mean
    turned = [inverse @ (force * (each[:, None] + each)) for each in by]
    traces = [[np.sum(one * other.T) for other in turned] for one in turned]
    return np.asarray(slopes @ inverse @ slopes.T + 0.5 * np.array(traces))


def _tremor(setup: Setup, times: Array) -> Array:
    """Return the covariance of the tremor, relative: a Gaussian line is a cosine that fades as a Gaussian."""
    apart = 2 * np.pi * (times[:, None] - times)
    total = sum(
        line.share * np.cos(line.centre_hz * apart) * np.exp(-((line.width_hz * apart) ** 2) / 2)
        for line in setup.lines
    )
    return np.asarray(setup.tremor**2 * total)


def main() -> None:
    """Print the bound."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--tremor", type=float, nargs="*", default=[0.0, 0.05, 0.08, 0.12], help="rms, relative")
    moments = (0.2, 0.5, 1.0, 3.0, 6.0)
    print("tremor " + "".join(f"{moment:8} s" for moment in moments))
    for tremor in parser.parse_args().tremor:
        print(f"{100 * tremor:4.0f} % " + "".join(f"{100 * b:8.4f} %" for b in bound(Setup(tremor=tremor), moments)))


if __name__ == "__main__":
    main()
