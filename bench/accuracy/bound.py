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
"""The default of `palpate.simulation.signals.Lines`: two lines, and sway in addition."""


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
    return np.asarray(
        np.sqrt(np.mean([_variances(setup, phase, moments) for phase in phases], axis=0))
    )


def _variances(setup: Setup, phase_s: float, moments: Array) -> Array:
    """Return the squared bounds if the first soft reading, the end of a pair, comes at `phase_s`."""
    soft = np.arange(phase_s, moments.max(), setup.pair_s)
    hard = soft - setup.pair_s / 2
    hard = hard[hard > 0]
    times = np.concatenate([hard, soft])
    order = np.argsort(times)
    found = information(setup, times[order], order < len(hard))
    whole = np.flatnonzero(order >= len(hard))[np.searchsorted(soft, moments, "right") - 1]
    return np.asarray(np.linalg.inv(found[whole])[:, 0, 0] / setup.ratio**2)


def information(setup: Setup, times: Array, is_hard: NDArray[np.bool_]) -> Array:
    """Return the Fisher information of (ratio, depth) after each reading, shape (n, 2, 2).

    With C = L L', z_i = L^-1 m_i and A_i = L^-1 C_i L^-T, J_ij = z_i' z_j + sum(A_i A_j) / 2. L^-1 is triangular, so the
    first n readings need the first n rows and columns of these only.

    Parameters
    ----------
    setup : Setup
    times : numpy.ndarray, shape (n,), s
        Of the readings since contact, increasing.
    is_hard : numpy.ndarray of bool, shape (n,)
        Channel of each reading.

    Returns
    -------
    numpy.ndarray, shape (n, 2, 2)
    """
    shape = 0.5 * (1 - np.cos(np.pi * np.minimum(times / setup.rise_s, 1)))
    mean = np.where(is_hard, setup.ratio, 1.0) * setup.depth_pF * shape
    force = _tremor(setup, times) * np.outer(mean, mean)
    common = (is_hard[:, None] == is_hard) / setup.baseline
    root = np.linalg.cholesky(force + setup.noise_pF**2 * (np.eye(len(times)) + common))
    inverse = np.linalg.inv(root)
    # d log(mean) by ratio and depth
    by = np.stack([is_hard / setup.ratio, np.full(len(times), 1 / setup.depth_pF)])
    z = inverse @ (by * mean).T
    turned = [inverse @ (force * (each[:, None] + each)) @ inverse.T for each in by]
    found = np.cumsum(z[:, :, None] * z[:, None, :], axis=0)
    for i, one in enumerate(turned):
        for j, other in enumerate(turned):
            found[:, i, j] += 0.5 * np.diag(np.cumsum(np.cumsum(one * other, axis=0), axis=1))
    return np.asarray(found)


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
    parser.add_argument(
        "--tremor", type=float, nargs="*", default=[0.0, 0.05, 0.08, 0.12], help="rms, relative"
    )
    moments = (0.2, 0.5, 1.0, 3.0, 6.0)
    print("tremor " + "".join(f"{moment:8} s" for moment in moments))
    for tremor in parser.parse_args().tremor:
        print(
            f"{100 * tremor:4.0f} % "
            + "".join(f"{100 * b:8.4f} %" for b in bound(Setup(tremor=tremor), moments))
        )


if __name__ == "__main__":
    main()
