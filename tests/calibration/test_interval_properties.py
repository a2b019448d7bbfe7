"""What holds for every calibration: units, order, containment, and that less knowledge gives a wider interval."""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, isfinite, isnan, log

import numpy as np
import pytest
from effort import examples
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import Calibration, CalibrationError
from palpate.elasticity import Elasticity

FEWEST = 8  # degrees of freedom: with fewer, Student's factor falls faster than a standard error widens
RELATIVE = 1e-5  # of the solver's minimum


@dataclass(frozen=True)
class Session:
    """Specimens over three decades around the half modulus, touched several times each."""

    rigid: float
    half: float
    specimens: int
    touches: int
    scatter: float
    seed: int

    def moduli(self) -> NDArray[np.float64]:
        return np.repeat(self.half * np.geomspace(0.05, 30, self.specimens), self.touches)

    def ratios(self) -> NDArray[np.float64]:
        random = np.random.default_rng(self.seed)
        true = np.array([Elasticity(self.rigid, self.half).ratio(E) for E in self.moduli()])
        return np.asarray(true * (1 + self.scatter * random.standard_normal(true.size)))

    def calibrated(self, factor: float = 1.0, gain: float = 1.0) -> Calibration:
        """Return the calibration with moduli in another unit, or with another gain of the hard channel."""
        try:
            return Calibration.fit(gain * self.ratios(), factor * self.moduli(), soft_ratio=gain)
        except CalibrationError:
            assume(False)
            raise


sessions = st.builds(
    Session,
    rigid=st.floats(2.0, 20.0),
    half=st.floats(0.1, 10.0),
    specimens=st.integers(FEWEST + 2, 14),
    touches=st.integers(1, 4),
    scatter=st.sampled_from([1e-3, 0.01, 0.03]),
    seed=st.integers(0, 2**31),
)
shares = st.floats(0.02, 0.98)  # of the way from the soft ratio to the rigid one


def at(calibration: Calibration, share: float) -> float:
    probe = calibration.probe
    return probe.soft_ratio + share * (probe.rigid_ratio - probe.soft_ratio)


def contains(wide: tuple[float, float], narrow: tuple[float, float]) -> bool:
    """Return whether an interval holds another, up to the rounding of its ends."""
    return wide[0] <= narrow[0] * (1 + 1e-9) and wide[1] >= narrow[1] * (1 - 1e-9)


@examples(60)
@given(sessions, st.sampled_from([2.0**-10, 0.145, 1e3]), shares)
def test_another_unit_of_the_modulus_changes_the_unit_alone(session: Session, factor: float, share: float) -> None:
    """Moduli times c: the half modulus and both ends times c; ratios stay."""
    one, other = session.calibrated(), session.calibrated(factor)
    assert other.probe.rigid_ratio == pytest.approx(one.probe.rigid_ratio, rel=RELATIVE)
    assert other.probe.half_modulus == pytest.approx(factor * one.probe.half_modulus, rel=RELATIVE)
    assert other.touch_spread == pytest.approx(one.touch_spread, rel=1e-3, abs=1e-6)
    ratio = at(one, share)
    a, b = one.modulus(ratio, 0.01), other.modulus(ratio, 0.01)
    assert (b.low, b.value) == pytest.approx((factor * a.low, factor * a.value), rel=1e-3)
    assert isfinite(a.high) == isfinite(b.high) or a.high > 1e4 * session.half
    if isfinite(a.high) and a.high < 100 * session.half:
        assert b.high == pytest.approx(factor * a.high, rel=1e-2)


@examples(60)
@given(sessions, st.sampled_from([0.5, 0.9, 4.0]), shares)
def test_another_gain_of_a_channel_changes_no_modulus(session: Session, gain: float, share: float) -> None:
    """Ratios and the soft ratio times g: the same moduli."""
    one, other = session.calibrated(), session.calibrated(gain=gain)
    assert other.probe.rigid_ratio == pytest.approx(gain * one.probe.rigid_ratio, rel=RELATIVE)
    assert other.probe.half_modulus == pytest.approx(one.probe.half_modulus, rel=RELATIVE)
    a, b = one.modulus(at(one, share), 0.01), other.modulus(gain * at(one, share), gain * 0.01)
    assert (b.low, b.value) == pytest.approx((a.low, a.value), rel=1e-3)


@examples(60)
@given(sessions, st.lists(shares, min_size=2, max_size=6), st.sampled_from([0.0, 0.01, 0.1]))
def test_a_larger_ratio_is_a_stiffer_object(session: Session, drawn: list[float], error: float) -> None:
    """Value and both ends rise with the ratio; the value is in its interval, and is the inverse of eq. (2)."""
    calibration = session.calibrated()
    found = [calibration.modulus(at(calibration, share), error) for share in sorted(drawn)]
    for share, one in zip(sorted(drawn), found, strict=True):
        assert one.low <= one.value <= one.high
        assert calibration.probe.ratio(one.value) == pytest.approx(at(calibration, share), rel=1e-9)
    for lower, higher in pairwise(found):
        assert lower.value <= higher.value
        assert lower.low <= higher.low * (1 + 1e-9)
        assert lower.high <= higher.high * (1 + 1e-9)


@examples(60)
@given(sessions, shares, st.floats(1e-3, 0.3), st.floats(1.1, 10.0))
def test_less_knowledge_is_a_wider_interval(session: Session, share: float, error: float, factor: float) -> None:
    """A larger standard error, a higher level, fewer touches."""
    calibration = session.calibrated()
    ratio = at(calibration, share)

    def interval(error: float, level: float = 0.95, touches: float = 1) -> tuple[float, float]:
        found = calibration.modulus(ratio, error, level=level, touches=touches)
        return found.low, found.high

    narrow = interval(error)
    assert contains(interval(factor * error), narrow)
    assert contains(interval(error, level=0.99), narrow)
    lower = interval(error, level=0.8)
    assert contains(narrow, lower)
    assert lower[0] > narrow[0] or narrow[0] == 0
    assert contains(narrow, interval(error, touches=factor))


@examples(40)
@given(sessions, shares, st.floats(2.0, 4.0))
def test_more_scatter_is_a_wider_interval(session: Session, share: float, factor: float) -> None:
    """The same deviations of each touch, larger: the spread grows with them, to the curvature of the curve."""
    calm = replace(session, scatter=0.003)
    wild = replace(calm, scatter=0.003 * factor)
    one, other = calm.calibrated(), wild.calibrated()
    assert other.touch_spread == pytest.approx(factor * one.touch_spread, rel=0.05)
    a, b = one.modulus(at(one, share)), other.modulus(at(one, share))
    assume(isfinite(a.high) and not isnan(b.value))
    widths = [log(m.high / m.low) if m.low > 0 and m.high < inf else inf for m in (a, b)]
    assert widths[1] > 0.8 * factor * widths[0]


def test_few_specimens_make_student_outweigh_a_standard_error() -> None:
    """What does not hold: with 1 degree of freedom a known error makes the sum better known, and the interval narrower."""
    few = Calibration.fit([1.5, 3.02, 6.9], [0.2, 1.0, 8.0])
    assert few.fitted.specimen_freedom == 1
    exact, scattered = few.modulus(3.0), few.modulus(3.0, 0.5 * few.touch_spread * 3.0)
    assert scattered.high - scattered.low < exact.high - exact.low
