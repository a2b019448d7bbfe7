"""What the differences between touches show: the tilt of the probe, a trend, or neither."""

import math

import numpy as np
import palpate
import pytest
from example_touch import example_touch
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator
from palpate.differences import DOUBT, Cause, trend_of
from palpate.distributions import student_outside
from palpate.repeatability import Agreement, agreement
from palpate.uncertainty import level_ratio
from scipy import special

SOFTENING = (1.0, 0.96, 0.94, 0.93)  # 4, 2, 1 %


def tilted(
    ratios: list[float],
    tilts: list[float],
    *,
    factor: float = 1.0,
    level_errors: list[float] | None = None,
) -> list[palpate.Touch]:
    """Return touches: each tilt shifts log ratio by `factor` times what hold and level differ by."""
    touches = []
    for number, (ratio, tilt) in enumerate(zip(ratios, tilts, strict=True)):
        level = ratio * math.exp((factor - 1) * tilt)
        if level_errors:
            level *= math.exp(level_errors[number])
        touch = example_touch(
            start_s=9.0 * number,
            ratio=ratio * math.exp(factor * tilt),
            level_ratio=level,
            level_standard_error=0.002 * level,
        )
        touches.append(touch)
    return touches


def in_row(ratios: list[float]) -> list[palpate.Touch]:
    """Return touches without level ratios, one after the other."""
    return [example_touch(start_s=9.0 * i, ratio=ratio) for i, ratio in enumerate(ratios)]


def by_hand(random: Generator, ratios: list[float], factor: float = 1.0) -> list[palpate.Touch]:
    """Return touches by a hand of 1.5 degrees: hold and level ratio differ by 5.5 % (rms)."""
    count = len(ratios)
    tilts = 0.055 * random.standard_normal(count)
    errors = 0.002 * random.standard_normal(count)
    return tilted(ratios, tilts.tolist(), factor=factor, level_errors=errors.tolist())


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 9, 10, 199])
def test_student(degrees: int) -> None:
    for t in (0.0, 1e-6, 0.5, 3.0, 14.0, 1000.0, math.inf):
        expected = 2 * float(special.stdtr(degrees, -t))
        assert student_outside(t, degrees) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("count", [4, 6, 10])
def test_how_often_chance_is_called_a_trend(count: int) -> None:
    # 3,000 sessions: the share is at most DOUBT, by Bonferroni; 4 standard deviations are 0.73 %.
    random = np.random.default_rng(49)
    found = 0
    for _ in range(3000):
        ratios = 4 * np.exp(0.03 * random.standard_normal(count))
        found += trend_of(ratios.tolist()) is not None
    assert found / 3000 <= DOUBT + 0.0073


@pytest.mark.parametrize(("count", "scatter"), [(4, 0.0005), (6, 0.005), (10, 0.01)])
def test_an_object_that_softens_is_called(count: int, scatter: float) -> None:
    """By 4, 2, 1 ... % from touch to touch; of four touches only if they hardly scatter."""
    random = np.random.default_rng(50)
    softened = 0.92 + 0.08 * 0.5 ** np.arange(count)
    found = 0
    for _ in range(200):
        ratios = 4 * softened * np.exp(scatter * random.standard_normal(count))
        trend = trend_of(ratios.tolist())
        found += trend is not None and trend.change < 0
    assert found >= 0.9 * 200


@given(
    st.lists(st.floats(0.5, 20), min_size=2, max_size=12),
    st.floats(0.01, 100),
)
@settings(max_examples=100, derandomize=True, deadline=None)
def test_a_trend_is_relative_and_has_a_direction(ratios: list[float], scale: float) -> None:
    """Other units change nothing; the reversed order of touches has a straight trend reversed."""
    found = trend_of(ratios)
    scaled = trend_of([scale * ratio for ratio in ratios])
    assert len(ratios) >= 4 or found is None
    if found and 1e-12 < found.probability < 0.99 * DOUBT:
        assert scaled is not None
        assert scaled.change == pytest.approx(found.change, rel=1e-6, abs=1e-9)


def test_a_trend_has_two_shapes_and_two_directions() -> None:
    steep = trend_of([4 * share for share in SOFTENING])
    assert steep is not None
    assert steep.change == pytest.approx(-0.07, abs=0.002)
    straight = trend_of([4.0, 4.041, 4.079, 4.121])
    assert straight is not None
    assert str(straight) == (
        "the ratio rises by 3.0 % from the first touch to the last (trend, p < 0.001): the object "
        "stiffens, or the probe drifts"
    )
    assert trend_of([4.0, 4.0, 4.0, 4.0]) is None
    # One touch that differs from all others is no trend.
    assert trend_of([4.4, 4.0, 4.0, 4.0]) is None


def test_the_trend_follows_the_mean() -> None:
    found = agreement(in_row([4 * share for share in SOFTENING]))
    assert found.agree
    assert "; the ratio falls by 7.1 % from the first touch to the last (trend, " in str(found)
    assert found.as_dict()["trend"]["change"] == pytest.approx(-0.071, abs=0.001)


def test_a_trend_within_a_third_of_the_uncertainty_is_not_mentioned() -> None:
    """A third of 3 % / sqrt(4) is .5 %."""
    for change, is_shown in ((0.004, False), (0.006, True)):
        found = agreement(in_row([4 * (1 - change * step / 3) for step in range(4)]))
        assert found.trend is not None
        assert ("falls" in str(found)) is is_shown


def test_touches_that_are_not_in_order_show_no_trend() -> None:
    touches = in_row([4 * share for share in SOFTENING])
    assert agreement(touches).trend is not None
    assert agreement(touches[1:] + touches[:1]).trend is None
    without_times = [touch.without_times() for touch in touches]
    assert agreement(without_times).trend is not None


def test_touches_that_differ_by_a_trend_do_not_ask_for_objects() -> None:
    found = agreement(in_row([4.0, 3.8, 3.7, 3.63]), scatter=0.01)
    assert (found.agree, found.cause) == (False, Cause.TREND)
    assert "several objects" not in str(found)
    assert str(found).endswith("the object softens, or the probe drifts. No mean is given")


def test_objects_in_the_order_of_their_moduli_are_no_trend() -> None:
    """Four specimens whose ratios rise in even steps: a strong trend, and too large for one object."""
    found = agreement(in_row([1.6, 2.8, 4.9, 8.4]))
    assert (found.agree, found.cause) == (False, None)
    assert found.trend is not None
    assert "several objects?" in str(found)
    assert "rises" not in str(found)
    hardly_known = agreement(in_row([1.6, 2.8, 4.9, 8.4]), scatter=0.3, freedom=2)
    assert hardly_known.agree
    assert str(hardly_known).endswith("(trend, p < 0.001): several objects?")


def named(found: Agreement) -> str:
    """Return the cause that an agreement names; "" if the touches agree."""
    return "" if found.agree else str(found.cause)


@pytest.mark.parametrize("factor", [0.6, 1.0, 1.9])
@pytest.mark.parametrize("count", [2, 4, 8])
def test_a_hand_is_not_several_objects(count: int, factor: float) -> None:
    """One object by a hand of 1.5 degrees; factor 1.9 are domes measured with the exponent 1."""
    random = np.random.default_rng([51, count])
    names = [named(agreement(by_hand(random, [4.0] * count, factor))) for _ in range(300)]
    assert names.count("None") == 0
    assert names.count("tilt") > 0


def test_a_hand_is_not_several_objects_by_level_ratios() -> None:
    """Domes measured with the exponent 1: the level ratios differ, too."""
    random = np.random.default_rng(52)
    names = []
    for _ in range(300):
        touches = by_hand(random, [4.0] * 4, 1.9)
        names.append(named(agreement(touches, ratio_of=level_ratio)))
    assert names.count("None") == 0
    assert names.count("tilt") > 30


@pytest.mark.parametrize(("tilt", "objects"), [(0.004, 0.06), (0.017, 0.1), (0.055, 0.5)])
def test_several_objects_are_not_a_hand(tilt: float, objects: float) -> None:
    """By a stage, by hands of .5 and 1.5 degrees, with objects that differ by more than the hand."""
    random = np.random.default_rng(53)
    names = []
    for _ in range(300):
        ratios = 4 * np.exp(objects * random.standard_normal(4))
        tilts = tilt * random.standard_normal(4)
        names.append(named(agreement(tilted(ratios.tolist(), tilts.tolist()))))
    assert names.count("None") > 100
    assert names.count("tilt") + names.count("trend") <= 0.05 * 300


def test_the_tilt_is_named_with_its_evidence() -> None:
    found = agreement(tilted([4.0] * 4, [0.1, -0.08, 0.02, -0.04]))
    assert (found.agree, found.cause) == (False, Cause.TILT)
    assert found.without_tilt == pytest.approx(0, abs=1e-12)
    text = str(found)
    assert "spread by 7.9 %, as with a probe that is held at different angles" in text
    assert text.endswith("hold it upright. No mean is given")
    assert found.as_dict()["cause"] == "tilt"


def test_a_touch_without_a_level_ratio_leaves_the_question() -> None:
    touches = tilted([4.0] * 4, [0.1, -0.08, 0.02, -0.04])
    without = example_touch(start_s=50.0, ratio=4.0)
    found = agreement([*touches, without])
    assert math.isnan(found.without_tilt)
    assert (found.cause, found.as_dict()["without_tilt"]) == (None, None)
    assert "several objects?" in str(found)


def test_an_object_that_softens_under_an_oblique_hand() -> None:
    """The tilt explains why the touches differ, and the level ratios still show the trend."""
    ratios = [4 * share for share in SOFTENING]
    found = agreement(tilted(ratios, [0.2, -0.2, -0.15, 0.17]))
    assert found.cause == Cause.TILT
    assert "different angles" in str(found)
    assert "the ratio falls by 7.1 %" in str(found)
