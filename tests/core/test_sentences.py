"""A sentence for each flag: sizes from simulated scenarios, whose truth is known."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from palpate.simulation import scenarios, simulate
from palpate.simulation.bumps import Bumps, Gauge
from palpate.simulation.converter import Stamps
from palpate.simulation.effects import EFFECTS
from palpate.simulation.faults import Faults

LEVEL = EFFECTS["not-level"]


def told(name: str, seed: int = 1) -> dict[str, str]:
    """Return the sentences about the first touch of a scenario, by flag."""
    return of(palpate.touches(scenarios.run(name, seed))[0])


def of(touch: palpate.Touch) -> dict[str, str]:
    sentences = palpate.advice(touch)
    by_flag = dict(sentence.split(": ", 1) for sentence in sentences)
    assert tuple(by_flag) == touch.flags
    return by_flag


def parts(pattern: str, sentence: str) -> tuple[str, ...]:
    found = re.search(pattern, sentence)
    assert found, sentence
    return found.groups()


def size(sentence: str) -> float:
    """Return the first percentage of a sentence, as a share."""
    [number] = parts(r"([-+]?[\d.]+) %", sentence)
    return float(number) / 100


def test_a_healthy_touch_has_no_sentence() -> None:
    assert told("stiff-steady") == {}


@pytest.mark.parametrize("offset", [0.02, 0.05, -0.03])
def test_an_offset_is_told_with_its_size_its_side_and_the_ratio_without_it(offset: float) -> None:
    [touch] = palpate.touches(simulate(replace(LEVEL, bumps=Bumps(offset=offset)), seed=2))
    sentence = of(touch)["offset"]
    # The share is of the mean depth, a little less than the deepest, and the fit's error is some parts in a thousand.
    assert size(sentence) == pytest.approx(abs(offset), rel=0.15)
    first, second = ("soft", "hard") if offset > 0 else ("hard", "soft")
    assert f"the {first} bump is reached" in sentence
    assert f"before the {second} one (bumps not level)" in sentence
    value, error = parts(r"ratio is ([\d.]+) ± ([\d.]+)$", sentence)
    truth = EFFECTS["not-level"].presses[0].ratios[0][1]
    assert abs(float(value) - truth) < 4 * float(error)


@pytest.mark.parametrize("name", ["drift-soft", "drift-hard", "jump", "thermal"])
def test_a_drift_of_a_baseline_is_told_with_the_correction_that_was_made(name: str) -> None:
    [touch] = palpate.touches(scenarios.run(name, seed=1))
    sentence = of(touch)["drift"]
    assert "a baseline changed during the touch" in sentence
    assert "(revised)" in sentence
    made = touch.ratio / touch.first_ratio - 1
    assert size(sentence) == pytest.approx(made, abs=0.006 * abs(made) + 5e-5)  # two digits


@pytest.mark.parametrize("name", ["tilt-ramp", "relaxing"])
def test_a_ratio_that_changed_is_not_blamed_on_the_baselines(name: str) -> None:
    assert "the ratio changed during the touch" in told(name)["drift"]


def test_a_drift_before_the_release_is_told_as_not_known_yet() -> None:
    run, tracker = scenarios.run("drift-soft", seed=1), palpate.Tracker(seconds=4.5)
    pressed = run.t_hard_s < 7.5
    tracker.process(run.t_hard_s[pressed], run.t_soft_s[pressed], run.hard[pressed], run.soft[pressed])
    [touch] = tracker.touches
    assert not touch.revised
    sentence = of(touch)["drift"]
    assert "which one is not known yet" in sentence
    assert "lift the probe" in sentence


@pytest.mark.parametrize("lag_s", [0.1, -0.05])
def test_a_lag_is_told_in_milliseconds_and_as_the_cause_of_the_rest(lag_s: float) -> None:
    lag = Gauge(lag_s=abs(lag_s))
    gauges = (Gauge(), lag) if lag_s > 0 else (lag, Gauge())
    [touch] = palpate.touches(simulate(replace(EFFECTS["lag"], gauges=gauges), seed=1))
    by_flag = of(touch)
    late, ms = parts(r"the (\w+) channel is ([\d.]+) ms late", by_flag["lag"])
    assert late == ("soft" if lag_s > 0 else "hard")
    assert float(ms) == pytest.approx(1000 * abs(lag_s), rel=0.3)
    assert all(sentence.endswith("because of the lag") for flag, sentence in by_flag.items() if flag != "lag")


def test_swapped_times_are_told_as_a_lag() -> None:
    [touch] = palpate.touches(simulate(replace(EFFECTS["skew"], stamps=Stamps(skew_s=0.005)), seed=1))
    assert "the soft channel is 5." in of(touch)["lag"] or "the soft channel is 4." in of(touch)["lag"]


@pytest.mark.parametrize("name", ["bottoms-out", "power-gauge", "quadratic-gauge"])
def test_a_curve_is_told_and_the_offset_that_it_makes_is_not_a_bump_that_is_not_level(name: str) -> None:
    by_flag = told(name)
    assert "a bump bottoms out, or a gauge is not linear" in by_flag["curve"]
    assert by_flag["offset"].endswith("because of the curve")


def test_an_effect_larger_than_the_signal_has_no_number() -> None:
    assert "more than 100 %" in told("bottoms-out")["curve"]


def test_creep_is_told_with_about_the_error_that_is_left() -> None:
    [touch] = palpate.touches(scenarios.run("creep", seed=1))
    sentence = of(touch)["creep"]
    truth = EFFECTS["creep"].presses[0].ratios[0][1]
    assert size(sentence) == pytest.approx(abs(touch.ratio / truth - 1), rel=0.5)
    assert "not corrected" in sentence


def test_a_baseline_measured_in_contact_is_told() -> None:
    # Pressed a little from the start, then deeper, then released.
    [touch] = pressed(np.repeat([0.05, 0.25, 0.0], [80, 120, 100])).touches
    assert touch.flags[-1] == "baseline"
    assert "it was measured in contact" in of(touch)["baseline"]
    assert "touch again" in of(touch)["baseline"]


def test_short_saturated_and_refused_are_told_with_their_counts() -> None:
    [touch] = palpate.touches(scenarios.run("stiff-steady", seed=1), seconds=60)
    assert str(touch.samples) in of(touch)["short"]
    assert "hold the probe longer" in of(touch)["short"]
    [touch] = palpate.touches(scenarios.run("saturating", seed=1))
    assert of(touch)["saturated"].startswith(f"{touch.saturated} readings are outside")
    [touch] = palpate.touches(simulate(replace(EFFECTS["lost-10"], faults=Faults(lost=0.6)), seed=1))
    assert of(touch)["refused"].startswith(
        f"{touch.refused} of {touch.refused + touch.samples} readings gave no sample"
    )


def test_a_touch_without_a_standard_error_and_one_that_moved_nothing_are_told() -> None:
    [touch] = pressed(np.repeat([0.0, 0.25, 0.0], [60, 60, 60]), full_scale=9.5).touches
    assert {"saturated", "unsettled"} <= set(touch.flags)
    assert touch.samples == 0  # not told to press less deep, nor deeper
    assert of(touch)["saturated"].startswith(
        f"all {touch.saturated} readings are outside the range of the converter: look"
    )
    assert "press" not in "".join(of(touch).values())
    assert of(touch)["unsettled"] == "0 samples are too few for a standard error"
    [touch] = pressed(np.repeat([0.0, 0.25, 0.0], [60, 60, 60]), initial_covariance=1e-9).touches
    assert "press deeper" in of(touch)["unexcited"]


def pressed(change_pF: NDArray[np.float64], **settings: Any) -> palpate.Tracker:
    """Return a tracker that has got readings of two channels with these changes of the soft one, ratio 2.5."""
    t, noise = np.arange(len(change_pF)) * 0.026, 40e-6 * np.random.default_rng(1).standard_normal((2, len(change_pF)))
    tracker: palpate.Tracker = palpate.Tracker("handheld", **settings)
    tracker.process(t, t + 0.013, 9 + 2.5 * change_pF + noise[0], 8 + change_pF + noise[1])
    return tracker
