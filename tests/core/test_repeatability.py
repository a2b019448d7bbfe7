"""Several touches: which ones count, whether they agree, and the most reliable one."""

import math
from typing import Any

import numpy as np
import palpate
import pytest
from example_touch import example_touch
from palpate import distributions
from palpate.calibration import Calibration
from palpate.differences import DOUBT
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.repeatability import agreement, objections, usable
from palpate.simulation import scenarios
from palpate.uncertainty import level_ratio
from scipy import special


def touched(
    ratio: float, standard_error: float = 1e-4, flags: tuple[str, ...] = (), **others: Any
) -> palpate.Touch:
    return example_touch(*flags, ratio=ratio, standard_error=standard_error, **others)


@pytest.mark.parametrize(
    ("flags", "against", "others"),
    [
        ((), (), {}),
        ((), (), {"standard_error": math.nan}),  # a scene without standard errors
        (("short",), (), {}),
        (("short",), ("short",), {"standard_error": math.nan}),
        (("short",), (), {"samples": 16}),
        (("short",), ("short",), {"samples": 15}),
        (("short", "saturated"), ("saturated",), {}),
        (("short", "unsettled"), ("short", "unsettled"), {"standard_error": math.nan}),
        (("drift",), ("drift",), {}),
        (("drift", "curve"), ("curve",), {"revised": True}),
        (("refused", "lag"), ("refused", "lag"), {}),
        (("late",), (), {"samples": 16}),
        (("late",), ("late",), {"samples": 15}),
        (("tilt", "changed"), (), {}),
        (("creep",), ("creep",), {"age_s": 0.0}),
        (("creep", "drift"), (), {"age_s": 1.3}),
        (("short",), ("short",), {"age_s": 1.3}),
    ],
)
def test_flags_that_exclude(
    flags: tuple[str, ...], against: tuple[str, ...], others: dict[str, Any]
) -> None:
    touch = touched(4.0, flags=flags, **others)
    assert objections(touch) == against
    assert objections(touch, accept=flags) == ()


ERRORS = {"offset": "offset", "drift": "drift", "curve": "curve", "creep": "shift"}
"""Flags with the effect that has the size of their error."""


@pytest.mark.parametrize("flag", ERRORS)
@pytest.mark.parametrize("scatter", [None, 0.03, 0.006, 0.1])
def test_an_error_below_a_third_of_the_scatter_does_not_exclude(
    flag: str, scatter: float | None
) -> None:
    """The scatter of a hand is 3 %, unless another one is known."""
    limit = (0.03 if scatter is None else scatter) / 3
    for sign in (-1, 1):
        below = example_touch(flag, effects={ERRORS[flag]: sign * 0.999 * limit})
        above = example_touch(flag, effects={ERRORS[flag]: sign * 1.001 * limit})
        assert objections(below, scatter=scatter) == ()
        assert objections(above, scatter=scatter) == (flag,)
        assert objections(above, (flag,), scatter=scatter) == ()


@pytest.mark.parametrize("flag", ERRORS)
def test_an_error_of_unknown_size_excludes(flag: str) -> None:
    for effects in ({}, {ERRORS[flag]: math.nan}, {ERRORS[flag]: math.inf}):
        assert objections(example_touch(flag, effects=effects), scatter=1.0) == (flag,)


def test_a_small_error_does_not_excuse_another_flag() -> None:
    touch = example_touch("curve", "step", effects={"curve": 1e-4})
    assert objections(touch) == ("step",)


def test_level_ratios_scatter_less() -> None:
    """By .6 %: an error of .3 % counts for them, and not for a hold."""
    touch = example_touch("curve", level_ratio=4.0, effects={"curve": 0.003})
    assert objections(touch) == ()
    assert objections(touch, ratio_of=level_ratio) == ("curve",)
    small = example_touch("curve", level_ratio=4.0, effects={"curve": 0.0019})
    assert objections(small, ratio_of=level_ratio) == ()


def test_usable_touches() -> None:
    good = touched(4.0)
    short = touched(4.1, 0.2, ("short",))
    bent = touched(5.0, 0.1, ("curve",))
    assert usable([good, short, bent]) == [good, short]
    assert usable([bent], ["curve"]) == [bent]
    with pytest.raises(
        ValueError, match=r"touches: got no usable touch \(curve\), allowed: at least one"
    ):
        usable([bent])
    with pytest.raises(ValueError, match="no touches"):
        usable([])


def test_the_order_of_touches_changes_nothing() -> None:
    """The scatter is relative to the median ratio, not to the ratio of the first touch."""
    known = [(3.0, 0.3), (4.0, 0.01), (4.1, 0.02), (4.2, 0.05), (6.0, 0.5)]
    touches = [touched(ratio, error) for ratio, error in known]
    expected = agreement(touches)
    for first in range(1, len(touches)):
        found = agreement(touches[first:] + touches[:first])
        assert found.ratio == pytest.approx(expected.ratio, rel=1e-12)
        assert found.effective == pytest.approx(expected.effective, rel=1e-12)
        assert found.probability == pytest.approx(expected.probability, rel=1e-9)


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
            assert number / 2000 == pytest.approx(DOUBT, abs=0.009)


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 9, 10, 199, 1000])
def test_chi_squared(degrees: int) -> None:
    for squares in (0.0, 1e-9, 0.5, 3.0, 20.0, 100.0, 1500.0, 1e4):
        expected = float(special.chdtrc(degrees, squares))
        assert distributions.chi_squared_above(squares, degrees) == pytest.approx(
            expected, rel=1e-9, abs=1e-13
        )


@pytest.mark.parametrize("by", ["agreement", "standard_error", "covariance"])
def test_the_most_reliable_is_refused_where_touches_differ(by: str) -> None:
    specimens = palpate.touches(scenarios.run("four-specimens", 1))
    with pytest.raises(
        ValueError, match=r"touches: the 4 touches differ: .* allowed: touches on one object"
    ):
        palpate.most_reliable(specimens, by=by)
    assert palpate.most_reliable(specimens, by=by, scatter=None) in specimens
    assert palpate.most_reliable(specimens, by=by, scatter=1.0) in specimens


def test_a_calibration_brings_its_own_scatter() -> None:
    moduli = np.repeat(list(SORBOTHANE_MPA.values()), 4)
    ratios = np.array([Elasticity().ratio(E) for E in moduli])
    found = Calibration.fit(
        ratios * (1 + 0.10 * np.random.default_rng(2).standard_normal(40)), moduli
    )
    assert found.touch_spread == pytest.approx(0.10, rel=0.3)  # 30 degrees of freedom: 13 %
    pair = [touched(4.0), touched(4.6)]
    assert not agreement(pair).agree
    assert found.agreement(pair).agree


def test_the_spread_is_relative_and_of_two_touches_at_least() -> None:
    assert agreement([touched(2.9), touched(3.1)]).spread == pytest.approx(
        np.std([2.9, 3.1], ddof=1) / 3.0
    )
    assert agreement([touched(3.0)]).spread == 0.0
