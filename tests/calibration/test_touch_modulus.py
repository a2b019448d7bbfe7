"""From touches to a modulus: the union over the exponents, means, differences, learning."""

from collections.abc import Sequence
from dataclasses import replace
from math import exp, hypot, inf, log, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import Calibration, Touch
from palpate.calibration.evidence import EXPONENTS, evidence_of
from palpate.calibration.exponent_fits import POSSIBLE
from palpate.calibration.interval import bounds
from palpate.calibration.ranges import BEND, Range, Ranges
from palpate.calibration.specimen_fit import SpecimenTouches, error_share, fit_specimens
from palpate.calibration.touch_modulus import ratio_at, spread_of, union
from palpate.elasticity import Elasticity
from palpate.uncertainty import LEVEL_SCATTER, hold_ratio, level_ratio
from scipy import stats
from tilted_touch import growth, tilted_touch

Array = NDArray[np.float64]
PROBE = Elasticity()
MODULI = (0.15, 0.4, 1.0, 2.5, 6.0)
SCATTER = 0.002  # of the true ratio from touch to touch, for another reason than the tilt
LAST = len(EXPONENTS) - 1


def specimens_of(
    tilt: float,
    *,
    seed: int = 1,
    exponent: float = 1.5,
    measured: float = 1.5,
    touches: int = 4,
    kind: str = "level",
) -> list[SpecimenTouches]:
    """Return touches with tilts of this rms on specimens."""
    random = np.random.default_rng(seed)
    made = []
    for modulus in MODULI:
        own = []
        for _ in range(touches):
            ratio = PROBE.ratio(modulus) * exp(SCATTER * random.standard_normal())
            own.append(
                tilted_touch(
                    ratio,
                    tilt * random.standard_normal(),
                    exponent=exponent,
                    measured=measured,
                    depth_pF=random.uniform(0.5, 1.5),
                    rise_s=random.uniform(0.2, 0.5),
                )
            )
        ratio_of = level_ratio if kind == "level" else hold_ratio
        made.append(SpecimenTouches(f"{modulus} MPa", modulus, own, ratio_of=ratio_of))
    return made


@pytest.fixture(scope="module")
def on_stage() -> Calibration:
    """Return a calibration by level touches, which leaves all exponents open."""
    return fit_specimens(specimens_of(0.0005))


@pytest.fixture(scope="module")
def by_hand() -> Calibration:
    """Return a calibration by tilted touches of domes."""
    return fit_specimens(specimens_of(0.03))


def width(calibration: Calibration, touch: Touch, level: float = 0.95) -> float:
    """Return the logarithm of the quotient of the ends of the interval."""
    found = calibration.mean_modulus([touch], level=level)
    return log(found.high / found.low)


# The union


def test_a_stage_leaves_all_exponents_open(on_stage: Calibration, by_hand: Calibration) -> None:
    assert on_stage.possible_exponents == (1.0, 1.5)
    assert {fit.log_weight for fit in on_stage.exponent_fits} == {0.0}
    low, high = by_hand.possible_exponents
    assert low > 1.0
    assert high == 1.5


@pytest.mark.parametrize("exponent", [1.0, 1.2, 1.5])
def test_the_interval_holds_for_each_exponent(on_stage: Calibration, exponent: float) -> None:
    """A hand measures at up to 3 %, whatever the bumps are: its ratio has no other error."""
    for tilt in (-0.03, -0.01, 0.01, 0.03):
        for modulus in (0.2, 1.2, 5.0):
            touch = tilted_touch(PROBE.ratio(modulus), tilt, exponent=exponent)
            found = on_stage.modulus_of(touch)
            assert found.low < modulus < found.high


def test_the_union_contains_the_interval_of_each_exponent(by_hand: Calibration) -> None:
    touch = tilted_touch(4.0, 0.03, depth_pF=2.5, rise_s=0.8)
    evidence = [evidence_of(touch, "level", EXPONENTS)]
    share = by_hand.error_share
    ratios = []
    for number, fit in enumerate(by_hand.exponent_fits):
        ratios.append(
            ratio_at(evidence, fit, number, by_hand.ranges, kind="level", error_share=share)
        )
    value, low, high = union(ratios, 0.95)
    ends = np.array([bounds(one.fit.fitted, one.measured(0.95)) for one in ratios])
    assert low == ends[:, 0].min()
    assert high == ends[:, 1].max()
    assert low < value < high
    possible = [one for one in ratios if one.fit.is_possible]
    assert len(possible) < len(ratios)
    # The modulus has the possible ones only.
    assert exp(union(possible, 0.95)[1]) == by_hand.mean_modulus([touch]).low
    assert exp(union(possible, 0.95)[2]) == by_hand.mean_modulus([touch]).high


def test_the_value_weighs_the_exponents_by_their_likelihood(on_stage: Calibration) -> None:
    touch = tilted_touch(4.0, 0.03)
    values = []
    for number in range(len(EXPONENTS)):
        weights = np.full(len(EXPONENTS), -50.0)
        weights[number] = 0.0
        values.append(log(with_weights(on_stage, weights).modulus_of(touch).value))
    weights = np.array([-1.9, -1.5, -1.0, -0.5, -0.2, 0.0])
    expected = np.average(values, weights=np.exp(weights))
    found = with_weights(on_stage, weights).modulus_of(touch)
    assert log(found.value) == pytest.approx(expected, rel=1e-12)


def with_weights(calibration: Calibration, weights: Sequence[float] | Array) -> Calibration:
    fits = zip(calibration.exponent_fits, weights, strict=True)
    changed = tuple(replace(fit, log_weight=float(weight)) for fit, weight in fits)
    return replace(calibration, exponent_fits=changed)


def test_beyond_the_rigid_ratio_there_is_a_bound(on_stage: Calibration) -> None:
    found = on_stage.modulus_of(tilted_touch(10.01, 0.0))
    assert np.isnan(found.value)
    assert found.high == inf
    assert found.low > 20
    assert found.extrapolated
    assert "the ratio of a rigid object" in found.reason
    assert "larger than the uncertainty" in on_stage.modulus_of(tilted_touch(15.0)).reason


def test_the_spread_is_that_of_an_even_distribution(on_stage: Calibration) -> None:
    evidence = [evidence_of(tilted_touch(4.0, 0.03, error=1e-9), "level", EXPONENTS)]
    ratios = []
    for number, fit in enumerate(on_stage.exponent_fits):
        flat = replace(fit, depth_slope=0.0)
        ratios.append(ratio_at(evidence, flat, number, Ranges(), kind="level", error_share=1.0))
    # From 1 to 1.5 the ratio changes by .85 tilt.
    assert spread_of(ratios) == pytest.approx(0.85 * 0.03 / 12**0.5)


def test_the_budget_has_each_cause(on_stage: Calibration) -> None:
    like = {p.name: p.of_ratio for p in on_stage.budget_of([tilted_touch(4.0, 0.0003)])}
    away = {
        p.name: p.of_ratio
        for p in on_stage.budget_of([tilted_touch(4.0, 0.03, depth_pF=3.0, rise_s=1.5)])
    }
    for name in ("difference from the calibration", "open contact exponent"):
        assert away[name] > 3 * like[name]
    for budget in (like, away):
        *parts, together = budget.values()
        assert together == pytest.approx(hypot(*parts))
    assert away["open contact exponent"] == pytest.approx(100 * 0.85 * 0.03 / 12**0.5, rel=0.1)


# What differs


@given(st.floats(0.0, 0.07), st.floats(1.0, 3.0), st.sampled_from([-1, 1]))
@settings(max_examples=25)
def test_a_more_oblique_touch_has_a_wider_interval(tilt: float, factor: float, sign: int) -> None:
    """With one curve for all exponents, the level ratio being the same."""
    calibration = earlier("level")
    small = tilted_touch(4.0, sign * tilt)
    large = tilted_touch(4.0, sign * tilt * factor)
    inner = calibration.modulus_of(small)
    outer = calibration.modulus_of(large)
    assert outer.low <= inner.low * (1 + 1e-9)
    assert outer.high >= inner.high * (1 - 1e-9)


def earlier(kind: str) -> Calibration:
    """Return a calibration as from a file of an earlier version: one curve, no ranges."""
    ratios = [PROBE.ratio(modulus) * (1 + away) for modulus in MODULI for away in (-0.003, 0.003)]
    found = Calibration.fit(ratios, np.repeat(MODULI, 2))
    exponents = EXPONENTS if kind == "level" else [1.0]
    fits = tuple(replace(found.exponent_fits[0], contact_exponent=float(p)) for p in exponents)
    measured = float(exponents[-1])
    return replace(found, ratio=kind, contact_exponent=measured, exponent_fits=fits)


@pytest.mark.parametrize(
    ("touch", "sentence"),
    [
        (tilted_touch(4.0, 0.03), "held more obliquely"),
        (tilted_touch(4.0, depth_pF=4.0), "pressed deeper"),
        (tilted_touch(4.0, depth_pF=0.05), "pressed more lightly"),
        (tilted_touch(4.0, rise_s=4.0), "pressed more slowly"),
        (tilted_touch(4.0, rise_s=0.02), "pressed faster"),
    ],
)
def test_a_difference_widens_and_is_named(
    on_stage: Calibration, touch: Touch, sentence: str
) -> None:
    like = tilted_touch(4.0)
    assert on_stage.differences(like) == []
    assert on_stage.differences(touch) == [f"{sentence} than in the calibration"]
    assert width(on_stage, touch) > 1.1 * width(on_stage, like)


def test_a_touch_that_does_not_count_has_no_differences(on_stage: Calibration) -> None:
    flat = tilted_touch(4.0, 0.1, measured=1.0)
    assert on_stage.differences(flat) == []
    assert "measured with contact_exponent 1, " in on_stage.modulus_of(flat).reason
    oblique = tilted_touch(4.0, 0.3)
    assert on_stage.differences(oblique) == []
    assert "held too obliquely" in on_stage.modulus_of(oblique).reason
    with pytest.raises(ValueError, match="touches: got 2 without a ratio for this calibration"):
        on_stage.mean_modulus([flat, oblique])


def test_a_touch_whose_hold_is_below_0_has_no_modulus(on_stage: Calibration) -> None:
    found = on_stage.modulus_of(replace(tilted_touch(4.0), ratio=-0.1))
    assert found.reason == "no ratio"


def test_unknown_ranges_widen(on_stage: Calibration) -> None:
    without = replace(on_stage, ranges=Ranges())
    touch = tilted_touch(4.0, 0.01, depth_pF=1.2)
    assert width(without, touch) > width(on_stage, touch)


# Means


def test_a_mean_of_equal_touches_has_their_differences(on_stage: Calibration) -> None:
    """Readings and scatter shrink with the number; the errors by a difference are in all of them."""
    touch = tilted_touch(4.0, 0.03, depth_pF=2.0)
    fit = on_stage.exponent_fits[0]
    one, four = (
        ratio_at(
            [evidence_of(touch, "level", EXPONENTS)] * count,
            fit,
            0,
            on_stage.ranges,
            kind="level",
            error_share=1.0,
        )
        for count in (1, 4)
    )
    assert one.touches == pytest.approx(1)
    assert four.touches == pytest.approx(4)
    assert four.noise == pytest.approx(one.noise / 2)
    assert four.ratio == pytest.approx(one.ratio)
    assert four.differences == pytest.approx(one.differences)
    narrow = on_stage.mean_modulus([touch] * 4)
    wide = on_stage.mean_modulus([touch])
    assert wide.low < narrow.low < narrow.high < wide.high


def test_half_of_opposite_differences_stays(on_stage: Calibration) -> None:
    fit = on_stage.exponent_fits[0]
    found = []
    for tilts in ([0.03], [0.03, -0.03]):
        evidence = [evidence_of(tilted_touch(4.0, tilt), "level", EXPONENTS) for tilt in tilts]
        found.append(ratio_at(evidence, fit, 0, on_stage.ranges, kind="level", error_share=1.0))
    one, two = (each.differences for each in found)
    assert abs(two.tilt) == pytest.approx(abs(one.tilt) / 2)
    assert abs(two.contact_exponent) == pytest.approx(abs(one.contact_exponent) / 2)
    # At a wrong exponent both ratios are wrong, in opposite directions.
    assert found[1].ratio == pytest.approx(4.0, rel=0.01)
    assert abs(log(found[0].ratio / 4.0)) > 0.01


@given(st.permutations(range(4)))
@settings(max_examples=8)
def test_the_order_of_touches_does_not_matter(order: list[int]) -> None:
    calibration = earlier("level")
    touches = [tilted_touch(4.0, tilt, error=1e-3 + tilt**2) for tilt in (0.0, 0.01, -0.03, 0.05)]
    expected = calibration.mean_modulus(touches)
    found = calibration.mean_modulus([touches[number] for number in order])
    assert [*found] == pytest.approx([*expected], rel=1e-9)


# Learned


def groups_of(tilt: float, exponent: float = 1.5, *flags: str) -> list[list[Touch]]:
    random = np.random.default_rng(9)
    groups = []
    for ratio in (2.0, 3.0, 4.5, 6.0):
        tilts = tilt * random.standard_normal(4)
        groups.append([tilted_touch(ratio, own, *flags, exponent=exponent) for own in tilts])
    return groups


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_hand_shows_the_exponent(on_stage: Calibration, exponent: float) -> None:
    found = on_stage.learned(groups_of(0.04, exponent))
    low, high = found.possible_exponents
    assert low <= exponent <= high
    assert high - low < 0.5
    touch = tilted_touch(4.0, 0.05, exponent=exponent)
    assert width(found, touch) < 0.8 * width(on_stage, touch)
    inside = found.modulus_of(touch)
    assert inside.low < PROBE.modulus(4.0) < inside.high
    assert on_stage.possible_exponents == (1.0, 1.5)


def test_level_touches_teach_nothing(on_stage: Calibration) -> None:
    found = on_stage.learned(groups_of(0.001))
    assert found.exponent_fits == on_stage.exponent_fits


def test_touches_that_do_not_count_teach_nothing(on_stage: Calibration) -> None:
    assert on_stage.learned(groups_of(0.04, 1.5, "step")) is on_stage
    singles = [[group[0]] for group in groups_of(0.04)]
    assert on_stage.learned(singles) is on_stage
    assert on_stage.learned([]) is on_stage


def test_a_calibration_of_the_hold_has_no_exponent() -> None:
    found = fit_specimens(specimens_of(0.0005, kind="hold"))
    assert found.learned(groups_of(0.04)) is found
    assert found.possible_exponents == (1.0, 1.0)


def test_evidence_of_a_hand_adds_to_that_of_the_calibration(by_hand: Calibration) -> None:
    found = by_hand.learned(groups_of(0.04))
    for before, after in zip(by_hand.exponent_fits, found.exponent_fits, strict=True):
        assert after.log_weight <= before.log_weight
    assert found.exponent_fits[LAST].log_weight == 0


def test_stated_bumps_stay_whatever_is_learned() -> None:
    flat = fit_specimens(specimens_of(0.0005), exponents=[1.0])
    assert flat.possible_exponents == (1.0, 1.0)
    assert flat.learned(groups_of(0.05)).possible_exponents == (1.0, 1.0)


# The whole chain by brute force: numpy, the equations of the docstrings, and a grid


def derived(touches: Sequence[Touch], exponent: float) -> Array:
    """Return the logarithm of the level ratio at an exponent."""
    hold = np.array([touch.ratio for touch in touches])
    level = np.array([touch.level_ratio for touch in touches])
    tilt = np.log(hold / level) / growth(1.5)
    return np.asarray(np.log(hold) - tilt * growth(exponent))


def flat_tilts(touches: Sequence[Touch]) -> Array:
    hold = np.array([touch.ratio for touch in touches])
    level = np.array([touch.level_ratio for touch in touches])
    return np.asarray(np.log(hold / level) / growth(1.5))


def errors_of(touches: Sequence[Touch], exponent: float, share: float) -> Array:
    """Return the relative standard errors of touches that calibrate."""
    own = [touch.level_standard_error / touch.level_ratio for touch in touches]
    of_tilt = 0.02 * growth(exponent) * flat_tilts(touches)
    of_growth = 0.1 * (derived(touches, exponent) - derived(touches, 1.5))
    return np.sqrt((share * np.array(own)) ** 2 + of_tilt**2 + of_growth**2)


def depths_of(touches: Sequence[Touch]) -> Array:
    return np.array([touch.depth_pF * (1 + touch.ratio) for touch in touches])


def within(values: Array, size: int = 4) -> Array:
    """Return the values minus the mean of their specimen."""
    table = values.reshape(-1, size)
    return np.asarray((table - table.mean(axis=1, keepdims=True)).ravel())


def possible_by(touches: Sequence[Touch], share: float) -> Array:
    """Return which exponents the scatter leaves, by the likelihood of its variance."""
    freedom = len(touches) - len(MODULI)
    own = np.median([touch.level_standard_error / touch.level_ratio for touch in touches])
    variances = []
    for exponent in EXPONENTS:
        pooled = (within(derived(touches, exponent)) ** 2).sum() / freedom
        variances.append(pooled + (share * own) ** 2 + LEVEL_SCATTER**2)
    log_likelihood = -freedom / 2 * np.log(np.array(variances) / min(variances))
    if max(variances) / min(variances) < stats.f.ppf(0.99, freedom, freedom):
        return np.full(len(EXPONENTS), True)
    return np.asarray(log_likelihood >= POSSIBLE)


@pytest.mark.parametrize("tilt", [0.0005, 0.03])
def test_the_whole_chain_by_brute_force(tilt: float) -> None:
    """The modulus of a touch by a grid of E for each exponent, from the touches that calibrated.

    The step of the grid is 1e-4 of E.
    """
    specimens = specimens_of(tilt, seed=11)
    touches = [touch for specimen in specimens for touch in specimen.touches]
    calibration = fit_specimens(specimens)
    share = calibration.error_share
    groups = [[evidence_of(t, "level", EXPONENTS) for t in one.touches] for one in specimens]
    assert share == error_share(groups, LAST)
    measured = tilted_touch(4.2, 0.02, error=3e-3, depth_pF=2.0, rise_s=0.7)
    middle = np.median(depths_of(touches))
    usual = np.quantile(abs(flat_tilts(touches)), 0.9)
    deepest = depths_of(touches).max()
    slowest = max(touch.rise_s for touch in touches)
    possible = possible_by(touches, 1.0)
    assert [fit.is_possible for fit in calibration.exponent_fits] == possible.tolist()
    x = np.arange(log(0.3), log(6.0), 1e-4)
    agree = np.zeros(len(x), bool)
    for exponent, fit, is_possible in zip(
        EXPONENTS, calibration.exponent_fits, possible, strict=True
    ):
        # The curve, through the ratios at the median depth.
        logs = derived(touches, exponent)
        errors = errors_of(touches, exponent, share)
        rest = within(logs)
        depths = within(depths_of(touches))
        lost = len(touches) / (len(touches) - len(MODULI))
        variances = errors**2 + lost * (1.4826 * np.median(abs(rest))) ** 2
        precision = (depths**2 / variances).sum() + 1 / BEND**2
        slope = (depths * rest / variances).sum() / precision
        assert fit.depth_slope == pytest.approx(slope, rel=1e-6)
        ratios = np.exp(logs - slope * (depths_of(touches) - middle))
        moduli = np.repeat(MODULI, 4)
        again = Calibration.fit(ratios, moduli, standard_errors=ratios * errors).fitted
        np.testing.assert_allclose(fit.fitted.parameters, again.parameters, rtol=1e-7)
        np.testing.assert_allclose(fit.fitted.covariance, again.covariance, rtol=1e-4, atol=1e-15)
        if not is_possible:
            continue
        # The touch: its ratio, and everything that makes it uncertain.
        [depth] = depths_of([measured])
        [log_ratio] = derived([measured], exponent) - slope * (depth - middle)
        ratio = exp(log_ratio)
        [own_tilt] = flat_tilts([measured])
        beyond = max(abs(own_tilt) - usual, 0)
        by_cause = [
            share * 3e-3,
            growth(exponent) * hypot(0.02 * own_tilt, 0.05 * beyond),
            0.1 * own_tilt * (growth(1.5) - growth(exponent)),
            hypot((depth - middle) / precision**0.5, BEND * (depth - deepest)),
            0.005 * log(measured.rise_s / slowest),
        ]
        square = (ratio * hypot(*by_cause)) ** 2
        rigid, log_half, soft = again.parameters
        share_x = 1 / (1 + np.exp(log_half - x))
        predicted = soft + (rigid - soft) * share_x
        by_curve = np.array([share_x, -(rigid - soft) * share_x * (1 - share_x), 1 - share_x])
        parts = {
            "touch": again.touch_variance * predicted**2,
            "specimen": again.specimen_variance * predicted**2,
            "curve": np.einsum("ix,ij,jx->x", by_curve, again.covariance, by_curve),
        }
        whole = square + sum(parts.values())
        by_specimen = parts["specimen"] + again.specimen_share * parts["curve"]
        by_touch = sum(parts.values()) - by_specimen
        freedom = whole**2 / (
            by_touch**2 / again.touch_freedom + by_specimen**2 / again.specimen_freedom
        )
        t = stats.t.ppf(0.975, freedom)
        agree |= abs(ratio - predicted) <= t * np.sqrt(whole)
    found = calibration.modulus_of(measured)
    assert log(found.low) == pytest.approx(x[agree][0], abs=2e-4)
    assert log(found.high) == pytest.approx(x[agree][-1], abs=2e-4)
    assert np.diff(np.flatnonzero(agree)).max() == 1  # no gap in the union
    assert found.low < PROBE.modulus(4.2) < found.high


def test_ranges_of_the_calibration_are_those_of_its_touches(on_stage: Calibration) -> None:
    touches = [touch for one in specimens_of(0.0005) for touch in one.touches]
    assert on_stage.ranges.depth_pF == pytest.approx(
        (min(depths_of(touches)), max(depths_of(touches)))
    )
    rises = [touch.rise_s for touch in touches]
    assert on_stage.ranges.rise_s == Range(min(rises), max(rises))
    assert on_stage.ranges.tilt == pytest.approx(np.quantile(abs(flat_tilts(touches)), 0.9))
    assert on_stage.ranges.middle_pF == pytest.approx(np.median(depths_of(touches)))


def test_touches_without_a_depth_calibrate() -> None:
    """As those of an earlier file: the slope is not known, and each depth costs."""
    specimens = specimens_of(0.0005)
    for number, one in enumerate(specimens):
        touches = [replace(touch, depth_pF=nan, rise_s=nan) for touch in one.touches]
        specimens[number] = replace(one, touches=touches)
    found = fit_specimens(specimens)
    assert found.ranges.unknown == ["depth", "rise"]
    assert {(fit.depth_slope, fit.depth_slope_error) for fit in found.exponent_fits} == {
        (0.0, BEND)
    }
    deep = tilted_touch(4.0, depth_pF=2.0)
    assert width(found, deep) > width(found, replace(deep, depth_pF=nan))
