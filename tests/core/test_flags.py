"""A sentence for each flag: sizes from simulated scenarios, whose truth is known."""

import re
from dataclasses import replace

import numpy as np
import palpate
import pytest
from palpate.flags import Suspicion, advice_at_end
from palpate.simulation import scenarios, simulate
from palpate.simulation.mechanics import Bumps, Gauge
from palpate.simulation.readings import Faults
from palpate.simulation.scenarios import EFFECTS
from project import FOUR


def of(touch: palpate.Touch) -> dict[str, str]:
    """Return the sentences about a touch, by flag."""
    texts = {each.flag: each.text for each in palpate.advice(touch)}
    assert tuple(texts) == touch.flags
    return {str(flag): text for flag, text in texts.items()}


def size(sentence: str) -> float:
    """Return the first percentage of a sentence, as a share."""
    return float(re.findall(r"([-+]?[\d.]+) %", sentence)[0]) / 100


@pytest.mark.parametrize("offset", [0.05, -0.03])
def test_an_offset_is_told_with_its_size_its_side_and_the_ratio_without_it(offset: float) -> None:
    [touch] = palpate.touches(
        simulate(replace(EFFECTS["not-level"], bumps=Bumps(offset=offset)), seed=2)
    )
    sentence = of(touch)["offset"]
    # The share is of the mean depth, a little less than the deepest, and the fit's error is some parts in a thousand.
    assert size(sentence) == pytest.approx(abs(offset), rel=0.15)
    first, second = ("soft", "hard") if offset > 0 else ("hard", "soft")
    assert re.search(f"the {first} bump is reached .* before the {second} one", sentence)
    [(value, error)] = re.findall(r"ratio is ([\d.]+) ± ([\d.]+) \(assumed\)$", sentence)
    assert abs(float(value) - EFFECTS["not-level"].presses[0].ratios[0][1]) < 4 * float(error)


def test_a_drift_of_a_baseline_is_told_with_the_correction_that_was_made() -> None:
    run = scenarios.run("drift-soft", seed=1)
    tracker = palpate.Tracker(seconds=4.5)
    columns = run.t_hard_s, run.t_soft_s, run.hard, run.soft
    pressed = run.t_hard_s < 7.5
    tracker.process(*(column[pressed] for column in columns))
    assert "which one is not known yet" in of(tracker.touches[0])["drift"]
    tracker.process(*(column[~pressed] for column in columns))
    [touch] = tracker.touches
    made = touch.ratio / touch.first_ratio - 1
    # two digits
    assert size(of(touch)["drift"]) == pytest.approx(made, abs=0.006 * abs(made) + 5e-5)


@pytest.mark.parametrize("lag_s", [0.1, -0.05])
def test_a_lag_is_told_in_milliseconds_and_as_the_cause_of_the_rest(lag_s: float) -> None:
    lag = Gauge(lag_s=abs(lag_s))
    gauges = (Gauge(), lag) if lag_s > 0 else (lag, Gauge())
    [touch] = palpate.touches(simulate(replace(EFFECTS["lag"], gauges=gauges), seed=1))
    by_flag = of(touch)
    [(late, ms)] = re.findall(r"the (\w+) channel is ([\d.]+) ms late", by_flag.pop("lag"))
    assert late == ("soft" if lag_s > 0 else "hard")
    assert float(ms) == pytest.approx(1000 * abs(lag_s), rel=0.3)
    assert all(sentence.endswith("because of the lag") for sentence in by_flag.values())


@pytest.mark.parametrize(
    ("name", "flag", "said"),
    [
        ("tilt-ramp", "drift", "the ratio changed during the touch"),
        ("power-gauge", "curve", "a bump bottoms out, or a gauge is not linear"),
        ("bottoms-out", "offset", "because of the curve"),
        # an effect larger than the signal has no number
        ("bottoms-out", "curve", "more than 100 %"),
        ("creep", "creep", "not corrected"),
        ("saturating", "saturated", "TOUCH.saturated readings are outside"),
        ("lost-10", "refused", "TOUCH.refused of"),
    ],
)
def test_the_cause_and_the_count_are_told(name: str, flag: str, said: str) -> None:
    scenario = scenarios.SCENARIOS[name]
    faults = Faults(lost=0.6) if name == "lost-10" else scenario.faults
    [touch] = palpate.touches(simulate(replace(scenario, faults=faults), seed=1))
    assert said.replace(f"TOUCH.{flag}", str(getattr(touch, flag, ""))) in of(touch)[flag]


def test_a_touch_without_samples_is_told_to_press_neither_less_nor_more() -> None:
    change = np.repeat([0.0, 0.25, 0.0], 60)
    noise = 40e-6 * np.random.default_rng(1).standard_normal((2, 180))
    t = np.arange(180) * 0.026
    tracker = palpate.Tracker("handheld", full_scale=9.5)
    tracker.process(t, t + 0.013, 9 + 2.5 * change + noise[0], 8 + change + noise[1])
    [touch] = tracker.touches
    assert touch.samples == 0
    assert of(touch)["saturated"].startswith(
        f"all {touch.saturated} readings are outside the range of the converter"
    )
    assert "press" not in "".join(of(touch).values())


@pytest.mark.parametrize("samples", [9, 12, 19, 20])
def test_swapped_inputs_of_short_touches_are_told_where_three_agree(samples: int) -> None:
    right = palpate.read(FOUR)
    columns = {"time": right.t_hard_s, "hard": right.soft, "soft": right.hard}
    exchanged = palpate.touches(columns, samples=samples)

    def count(touches: list[palpate.Touch]) -> int:
        last = [advice[-1] for advice in advice_at_end(touches) if advice]
        return sum(each.flag is Suspicion.SWAPPED for each in last)

    assert count(exchanged) == (4 if samples >= 10 else 0)
    assert count(exchanged[:2]) == (2 if samples >= 20 else 0)
    assert count([*exchanged[:3], *palpate.touches(right)[:1]]) == (3 if samples >= 20 else 0), (
        "one contradicts"
    )
