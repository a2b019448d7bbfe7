"""Several touches: which ones count, whether they agree, and the most reliable one."""

import math
from dataclasses import dataclass
from typing import cast

import numpy as np
import palpate
import pytest
from palpate import several
from palpate.calibration import Calibration
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.several import TOUCH_SCATTER, agreement, objections, usable
from palpate.simulation import scenarios
from palpate.simulation.hand import Hand, session
from scipy import special, stats


@dataclass(frozen=True)
class Touched:
    """What the rules read of a touch."""

    ratio: float
    standard_error: float = 1e-4
    flags: tuple[str, ...] = ()
    revised: bool = False
    covariance: float = 0.1
    samples: int = 250


def touched(*arguments: object, **named: object) -> palpate.Touch:
    return cast(palpate.Touch, Touched(*arguments, **named))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("touch", "against"),
    [
        (touched(4.0), ()),
        (touched(4.0, math.nan), ()),  # a scene without standard errors
        (touched(4.0, 0.1, ("short",)), ()),
        (touched(4.0, math.nan, ("short",)), ("short",)),
        (touched(4.0, 0.1, ("short",), samples=16), ()),
        (touched(4.0, 0.1, ("short",), samples=15), ("short",)),
        (touched(4.0, 0.1, ("short", "saturated")), ("saturated",)),
        (touched(4.0, math.nan, ("short", "unsettled")), ("short", "unsettled")),
        (touched(4.0, 0.1, ("drift",)), ("drift",)),
        (touched(4.0, 0.1, ("drift",), revised=True), ()),
        (touched(4.0, 0.1, ("drift", "curve"), revised=True), ("curve",)),
        *(
            (touched(4.0, 0.1, (flag,)), (flag,))
            for flag in ("refused", "unexcited", "one-sided", "offset", "lag", "curve", "creep")
        ),
    ],
)
def test_flags_that_exclude(touch: palpate.Touch, against: tuple[str, ...]) -> None:
    assert objections(touch) == against
    assert objections(touch, accept=touch.flags) == ()


def test_usable_touches() -> None:
    good, short, bent = touched(4.0), touched(4.1, 0.2, ("short",)), touched(5.0, 0.1, ("curve",))
    assert usable([good, short, bent]) == [good, short]
    assert usable([bent], ["curve"]) == [bent]
    with pytest.raises(ValueError, match=r"touches: got no usable touch \(curve\), allowed: at least one"):
        usable([bent])
    with pytest.raises(ValueError, match="no touches"):
        usable([])


def test_touches_of_one_object_and_of_several() -> None:
    specimens = palpate.touches(scenarios.run("four-specimens", 1))
    found = agreement(specimens)
    assert not found.agree
    assert str(found).startswith("the 4 touches differ: their ratios spread by 69 %")
    assert (found.as_dict()["ratio"], found.as_dict()["standard_error"]) == (None, None)
    one = palpate.touches(session(0, moduli={"gel": 1.1})["gel"])
    found = agreement(one)
    assert found.agree
    assert found.as_dict()["ratio"] == found.ratio == pytest.approx(np.mean([t.ratio for t in one]), rel=1e-3)
    # The scatter is a hundred times the standard errors: that of the mean of four is half of it.
    assert found.standard_error == pytest.approx(TOUCH_SCATTER * found.ratio / 2, rel=5e-3)
    assert str(found).startswith("mean of 4 touches: 4.27")
    assert str(agreement(one[:1])).startswith("1 touch: ")


def test_two_touches_differ_beyond_the_quantile() -> None:
    # Two touches a and b have (a - b)^2 / (2 scatter^2 m^2) as chi-squared with one degree of freedom.
    limit = stats.norm.isf(several.DOUBT / 2) * math.sqrt(2) * 0.02
    for factor, agrees in ((0.98, True), (1.02, False)):
        reach = factor * limit / 2
        pair = [touched(4 * (1 - reach), 0.0), touched(4 * (1 + reach), 0.0)]
        median = pair[1].ratio / 4  # the scatter is relative to the upper one of two
        assert agreement(pair, scatter=0.02 / median).agree == agrees
    far = [touched(4.0), touched(5.0)]
    assert not agreement(far).agree
    assert agreement(far, scatter=0.2).agree


def test_without_scatter_the_standard_errors_decide() -> None:
    assert agreement([touched(4.0, 0.1), touched(4.1, 0.1)], scatter=0.0).agree
    assert not agreement([touched(4.0, 0.01), touched(4.1, 0.01)], scatter=0.0).agree
    assert agreement([touched(4.0, 0.0), touched(4.0, 0.0)], scatter=0.0).agree
    assert not agreement([touched(4.0, 0.0), touched(4.1, 0.0)], scatter=0.0).agree


def test_a_short_touch_weighs_less() -> None:
    found = agreement([touched(4.0, 1e-4), touched(5.0, 2.0, ("short",))])
    weight = (2.0**2 + (0.03 * 5.0) ** 2) / (1e-8 + (0.03 * 5.0) ** 2)
    assert found.agree
    assert found.ratio == pytest.approx((weight * 4.0 + 5.0) / (weight + 1))
    assert 1 < found.effective < 1.02


def test_how_often_touches_of_one_object_are_said_to_differ() -> None:
    # 2,000 pairs and fours of one object: the share is DOUBT, within 4 standard deviations sqrt(p (1 - p) / n) = 0.9 %.
    random = np.random.default_rng(15)
    freedom = 10
    for count in (2, 4):
        differ = {math.inf: 0, freedom: 0}
        for _ in range(2000):
            ratios = 4 * (1 + 0.03 * random.standard_normal(count))
            measured = [touched(float(ratio)) for ratio in ratios]
            estimated = 0.03 * math.sqrt(random.chisquare(freedom) / freedom)
            differ[math.inf] += not agreement(measured).agree
            differ[freedom] += not agreement(measured, scatter=estimated, freedom=freedom).agree
        for number in differ.values():
            assert number / 2000 == pytest.approx(several.DOUBT, abs=0.009)


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 9, 10, 199, 1000])
def test_chi_squared(degrees: int) -> None:
    for squares in (0.0, 1e-9, 0.5, 3.0, 20.0, 100.0, 1500.0, 1e4):
        expected = float(special.chdtrc(degrees, squares))
        assert several._chi_squared_above(squares, degrees) == pytest.approx(expected, rel=1e-9, abs=1e-13)


def test_arguments() -> None:
    for scatter in (-0.1, math.nan, math.inf):
        with pytest.raises(ValueError, match="scatter: got"):
            agreement([touched(4.0)], scatter=scatter)
    with pytest.raises(ValueError, match="freedom: got 0"):
        agreement([touched(4.0)], freedom=0)


@pytest.mark.parametrize("by", ["agreement", "standard_error", "covariance"])
def test_the_most_reliable_is_refused_where_touches_differ(by: str) -> None:
    specimens = palpate.touches(scenarios.run("four-specimens", 1))
    with pytest.raises(ValueError, match=r"touches: the 4 touches differ: .* allowed: touches on one object"):
        palpate.most_reliable(specimens, by=by)
    assert palpate.most_reliable(specimens, by=by, scatter=None) in specimens
    assert palpate.most_reliable(specimens, by=by, scatter=1.0) in specimens


def test_a_calibration_brings_its_own_scatter() -> None:
    moduli = list(SORBOTHANE_MPA.values())
    random = np.random.default_rng(2)
    true = [Elasticity().ratio(E) for E in moduli for _ in range(4)]
    ratios = np.array(true) * (1 + 0.10 * random.standard_normal(len(true)))
    found = Calibration.fit(ratios, [E for E in moduli for _ in range(4)])
    assert found.touch_spread == pytest.approx(0.10, rel=0.3)  # 30 degrees of freedom: 13 %
    assert "scatter from touch to touch (" in found.scatter
    pair = [touched(4.0), touched(4.6)]
    assert not agreement(pair).agree
    assert found.agreement(pair).agree
    assert found.uncertainty(4.0, 0.3) == pytest.approx(math.hypot(0.3, 4.0 * found.touch_spread))
    assert math.isnan(found.uncertainty(4.0, math.nan))
    low, high = list(found.modulus(4.0, 1e-4))[1:]
    assert high / low > 1 + found.touch_spread  # the interval holds the scatter: far more than 1e-4
    one_each = Calibration.fit(ratios[::4], moduli)
    assert "touches and specimens together" in one_each.scatter


def test_hands_agree_by_their_own_scatter() -> None:
    steady = palpate.touches(session(1, hand=Hand(oblique=0.01), moduli={"gel": 1.1}, touches=3)["gel"])
    assert agreement(steady, scatter=0.01).agree
