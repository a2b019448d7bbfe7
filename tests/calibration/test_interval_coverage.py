"""Nominal 95 % intervals of the modulus hold the truth in 95 % of the cases, up to the rigid end, where one end is left."""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
import palpate
import pytest
from effort import NIGHTLY
from numpy.typing import NDArray
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from tally import Tally

Array = NDArray[np.float64]
PROBE = Elasticity()
MODULI = np.array(list(SORBOTHANE_MPA.values()))
PROBES = 2000 if NIGHTLY else 500
SHARES = (0.5, 0.9, 0.98)
"""Of the rigid ratio: objects of 1.6, 16 and 88 MPa, the specimens ending at 8.68."""

# Hits of probability 0.95 scatter by sqrt(0.95 * 0.05 / PROBES), one sigma: 0.5 % for 2,000, 1 % for 500. Four are allowed.
NOMINAL = 0.95
ALLOWED = 4 * sqrt(NOMINAL * (1 - NOMINAL) / PROBES)


@dataclass(frozen=True)
class Scatter:
    """How touches scatter, relative to the ratio, and what is known of it."""

    oblique: float
    error: float  # and its standard error, known
    specimen: float = 0.0
    touches: int = 4  # on each specimen
    probing: int = 1  # on the object that is measured, whose mean is taken

    def ratios(self, moduli: Array, touches: int, random: np.random.Generator) -> Array:
        """Return a row of touches for each object."""
        true = np.array([PROBE.ratio(E) for E in moduli])[:, None]
        own = 1 + self.specimen * random.standard_normal((len(moduli), 1))
        shape = (len(moduli), touches)
        scattered = true * own * (1 + self.oblique * random.standard_normal(shape))
        return np.asarray(scattered + true * self.error * random.standard_normal(shape))

    def calibrated(self, random: np.random.Generator) -> palpate.Calibration:
        """Return a calibration on the ten specimens."""
        ratios = self.ratios(MODULI, self.touches, random)
        return palpate.Calibration.fit(
            ratios.ravel(), np.repeat(MODULI, self.touches), standard_errors=self.error * ratios.ravel()
        )


def coverage(scatter: Scatter) -> dict[float, tuple[float, float]]:
    """Return for each share of the rigid ratio: how often the interval holds the truth, and how often it is one-sided."""
    random = np.random.default_rng(2026)
    held, open_ended = dict.fromkeys(SHARES, 0), dict.fromkeys(SHARES, 0)
    for _ in range(PROBES):
        calibration = scatter.calibrated(random)
        for share in SHARES:
            modulus = PROBE.modulus(share * PROBE.rigid_ratio)
            ratio = float(scatter.ratios(np.array([modulus]), scatter.probing, random).mean())
            error = scatter.error * ratio / scatter.probing**0.5
            found = calibration.modulus(ratio, error, touches=scatter.probing)
            held[share] += found.low <= modulus <= found.high
            open_ended[share] += found.high == inf
    return {share: (held[share] / PROBES, open_ended[share] / PROBES) for share in SHARES}


@pytest.mark.parametrize(
    ("scatter", "often_open"),
    [
        pytest.param(Scatter(oblique=0.03, error=0.001), {0.98}, id="oblique contact dominates"),
        pytest.param(Scatter(oblique=0.01, error=0.01), {0.98}, id="half oblique, half noise"),
        pytest.param(Scatter(oblique=0.03, error=0.001, touches=1), {0.98}, id="one touch on each specimen"),
        pytest.param(Scatter(oblique=0.03, error=0.001, probing=4), {0.98}, id="the mean of four touches"),
        pytest.param(Scatter(oblique=0.01, error=0.001, specimen=0.02), {0.98}, id="moduli that are off"),
        pytest.param(Scatter(oblique=0.001, error=0.001), set(), id="a test stage"),
    ],
)
def test_coverage(scatter: Scatter, often_open: set[float], tally: Tally, request: pytest.FixtureRequest) -> None:
    found = coverage(scatter)
    shares = (f"{100 * held:.1f} % ({100 * one:.0f} % one-sided)" for held, one in found.values())
    tally.say(f"95 % intervals, {request.node.callspec.id}: " + ", ".join(shares))
    for share, (held, one_sided) in found.items():
        # The specimens' variance, 0 here, is never estimated below 0: beside a mean of touches that is not small.
        more = 0.0 if scatter.probing == 1 else 0.01
        assert -ALLOWED <= held - NOMINAL <= ALLOWED + more, f"{share}: {held}"
        assert (one_sided > 0.5) == (share in often_open), f"{share}: {one_sided}"
