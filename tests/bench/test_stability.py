"""The tables of bench.accuracy.stability: rivals have the settings of each case, and the printed form ends as it says."""

from importlib.util import find_spec
from typing import Any

import numpy as np
import palpate
import pytest
from project import need_package

from bench.accuracy.as_printed import after_a_step, as_set, exact_ratio, printed
from bench.accuracy.coverage import NOISES, coverage, touch_coverage
from bench.accuracy.extremes import Case, ending, exact_cases, powers, settings_for
from bench.accuracy.near_rigid import EPS, PROBE, near_rigid
from bench.peers import PEERS

CASES = {case.name: case for case in exact_cases(np.float64)}
MODERATE = [case for case in CASES.values() if case.ends == "right" and "square" not in case.name]
INSTALLED = [name for name in PEERS if find_spec(name)]


def loss(name: str, case: Case) -> float:
    """Return the relative rounding error of a library: padasip's P - P x x P / (lambda + x P x) loses P0 x^2 eps."""
    covariance = settings_for(np.float64, palpate.AdaptiveRls, case)["initial_covariance"]
    cancelled = covariance * float(np.max(case.regressor**2)) * float(np.finfo(float).eps)
    return max(1e-9, 10 * cancelled if name == "padasip" else 0)


PAIRS = [
    pytest.param(name, case, id=f"{name}-{case.name}")
    for name in INSTALLED
    for case in MODERATE
    if loss(name, case) < 1e-2
]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("name", "case"), PAIRS)
def test_other_libraries_with_the_settings_of_a_case_agree(name: str, case: Case) -> None:
    """Least squares with the same forgetting, initial ratio and covariance: the same ratio, up to rounding."""
    error = loss(name, case)
    assert as_set(PEERS[name], case) == pytest.approx(exact_ratio(case, detector=False), rel=error, abs=error)


def test_a_rival_that_keeps_the_printed_form_fails_as_it_does() -> None:
    need_package("padasip")
    case = CASES["initial covariance 1e18, a step"]
    assert abs(as_set(PEERS["padasip"], case) / exact_ratio(case, detector=False) - 1) > 0.1
    assert abs(printed(case, np.float64) / exact_ratio(case) - 1) > 0.1


@pytest.mark.parametrize(
    ("kind", "lost", "kept"), [(np.float32, 1e9, 1e8), (np.float32, 1e12, 1e7), (np.float64, 1e18, 1e15)]
)
def test_the_printed_covariance_is_lost_to_cancellation(kind: Any, lost: float, kept: float) -> None:
    """P - P x^2 P / (lambda + x^2 P) is 0 where lambda / (lambda + x^2 P) is below half an eps: then no gain, for good."""
    assert lost * 0.25**2 > 2 / np.finfo(kind).eps
    covariance, ratio = after_a_step(lost, kind)
    assert covariance == 0
    assert ratio == pytest.approx(2.5, rel=1e-3)
    assert after_a_step(kept, kind)[1] == pytest.approx(3, rel=1e-3)


@pytest.mark.parametrize("power", range(2, 21, 2))
@pytest.mark.parametrize("kind", [palpate.AdaptiveRls, palpate.AdaptiveRls32])
def test_the_information_form_follows_from_every_initial_covariance(kind: Any, power: int) -> None:
    covariance, ratio = after_a_step(10.0**power, kind)
    assert 0 < covariance <= 16.1
    assert ratio == pytest.approx(3, rel=1e-3)


RANGE = {  # powers of ten: right up to at least the first, refused from the second on
    palpate.Rls: (152, 155),
    palpate.AdaptiveRls: (152, 155),
    palpate.HandoverRls: (139, 141),
    palpate.Rls32: (18, 20),
    palpate.AdaptiveRls32: (18, 20),
    palpate.HandoverRls32: (15, 17),
}


@pytest.mark.parametrize("kind", RANGE)
def test_the_range_of_each_estimator_is_the_documented_one(kind: Any) -> None:
    """From 1 pF up to 1e139 pF (float32: 1e15) every estimator is right, as the docstrings say; none is ever wrong."""
    largest, refused = RANGE[kind]
    ends = {power: ending(kind, 10.0**power) for power in powers(kind)}
    assert "wrong" not in ends.values()
    assert all(end == "right" for power, end in ends.items() if 0 <= power <= largest)
    assert all(end == "refused" for power, end in ends.items() if power >= refused)
    assert all(end in ("right", "unexcited") for power, end in ends.items() if power < 0)


NOISE = {noise.name: noise for noise in NOISES}
SEEDS = 200
"""The share of 200 seeds that a right 95 % interval holds is 0.95 +- 0.015: 0.89 is 4 standard deviations below."""


@pytest.mark.parametrize("kind", [palpate.HandoverRls, palpate.HandoverRls32])
@pytest.mark.parametrize("name", ["press, added 0.0001 pF", "press, added 1e-05 pF", "depth moves 100-fold, added"])
def test_the_interval_holds_the_ratio_if_the_noise_is_the_same_at_all_depths(kind: Any, name: str) -> None:
    assert coverage(kind, NOISE[name], SEEDS) > 0.89


@pytest.mark.parametrize("name", ["depth falls over 2 decades, a share", "any depth of 3 decades, a share"])
def test_it_does_not_if_the_noise_grows_with_the_depth_but_with_the_quotient_it_does(name: str) -> None:
    """docs/untried.md says so: the standard error takes the noise for equally large at all depths."""
    assert coverage(palpate.HandoverRls, NOISE[name], SEEDS) < 0.7
    assert coverage(palpate.HandoverRls, NOISE[name], SEEDS, divided=True) > 0.89


@pytest.mark.parametrize("kind", [palpate.HandoverRls, palpate.HandoverRls32])
@pytest.mark.parametrize("added", [1e-6, 1e-7])
def test_it_holds_the_ratio_if_the_noise_is_of_the_size_of_the_rounding(kind: Any, added: float) -> None:
    """1e-6 pF are 13 eps of the output in float32: the rounding of the ratio is larger than what the noise leaves."""
    assert coverage(kind, NOISE[f"press, added {added:g} pF"], SEEDS) > 0.89


def test_a_touch_is_at_one_depth() -> None:
    """The gate ends a touch at half its depth: a noise that is a share of the signal hardly differs within it."""
    assert touch_coverage("stiff-steady", 1e-2, 60) > 0.83


def test_near_the_rigid_ratio_only_the_ratio_matters() -> None:
    """The difference to the rigid ratio is exact (Sterbenz), the rest as in test_elasticity.py: 4 and 6 times half an eps.

    What remains is the condition of eq. (2): half an eps of the ratio becomes any error of the modulus.
    """
    rows = near_rigid()
    for row in rows:
        assert row.modulus <= 4 / 2
        assert row.slope <= 6 / 2
        assert row.back <= 1
        rigid, _, soft = PROBE
        ratio = rigid - row.left
        condition = ratio * (rigid - soft) / ((ratio - soft) * row.left)
        assert row.given == pytest.approx(condition / 2, rel=0.01)
    for kind, eps in EPS.items():
        assert max(row.given for row in rows if row.type == kind) * eps > 0.05
