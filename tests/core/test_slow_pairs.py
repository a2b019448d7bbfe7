"""Loggers with 2 to 25 pairs a second: the first baseline takes a second, and the standard error covers the alignment."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import palpate
import pytest
from palpate.simulation import ConverterModel, Press, Scenario, Simulation, simulate

RATIO = 2.86
SEEDS = range(20)
Z95 = 1.96


def logger(pairs_per_s: float) -> ConverterModel:
    """Return a converter that is fast, and read seldom: nothing in it averages a tremor."""
    step_s = 0.5 / pairs_per_s
    return ConverterModel(conversion_s=0.011, bus_s=step_s - 0.011, noise_pF=40e-6)


def chip(capf: int) -> ConverterModel:
    return ConverterModel(capf=capf)


def scenario(converter: ConverterModel, rest_s: float, tremor: float = 0.03) -> Scenario:
    """Return two presses, the first one after a rest."""
    first = Press(rest_s, [(0.0, RATIO)])
    second = replace(first, start_s=first.stop_s + 4.0)
    return Scenario(
        presses=[first, second],
        duration_s=second.stop_s + 1.0,
        tremor=tremor,
        converter=converter,
    )


def touches_of(run: Simulation) -> tuple[list[palpate.Touch], palpate.Tracker]:
    tracker = palpate.Tracker("handheld")
    t_hard, t_soft = (np.rint(1e9 * t).astype(np.int64) for t in (run.t_hard_s, run.t_soft_s))
    tracker.process(t_hard, t_soft, run.hard, run.soft)
    tracker.finish()
    return list(tracker.touches), tracker


def all_touches(scene: Scenario) -> Iterator[list[palpate.Touch]]:
    for seed in SEEDS:
        yield touches_of(simulate(scene, seed))[0]


def covered(touches: list[palpate.Touch]) -> float:
    """Return the share of touches whose 95 % interval has the true ratio."""
    off = np.array([touch.ratio - RATIO for touch in touches])
    errors = np.array([touch.standard_error for touch in touches])
    return float(np.mean(np.abs(off) <= Z95 * errors))


@pytest.mark.parametrize(
    ("converter", "rest_s"),
    [
        (chip(4), 2.0),
        (chip(4), 8.0),
        (chip(7), 5.5 * chip(7).period_s),
        (chip(7), 8.0),
        (replace(chip(4), bus_s=0.042), 2.0),
        (logger(2.0), 3.0),
        (logger(3.0), 2.0),
        (logger(4.8), 2.0),
        (logger(7.5), 2.0),
        (logger(10.0), 2.0),
        (logger(15.0), 2.0),
        (logger(22.0), 2.0),
        (logger(25.0), 2.0),
    ],
    ids=lambda value: f"{value.period_s:.3f}" if isinstance(value, ConverterModel) else None,
)
def test_slow_pairs_lose_no_touch_and_cover_the_ratio(
    converter: ConverterModel, rest_s: float
) -> None:
    """85 % of the intervals have the true ratio: the tremor of a hand aliases, and each seed has its own."""
    runs = list(all_touches(scenario(converter, rest_s)))
    assert [len(touches) for touches in runs] == [2] * len(runs)
    assert covered([touch for touches in runs for touch in touches]) >= 0.85


@pytest.mark.parametrize("pairs_per_s", [22.0, 24.0, 25.0])
def test_the_filters_of_slow_pairs_leave_little_of_a_tremor(pairs_per_s: float) -> None:
    """Interpolation of one channel leaves .01 %; without a tremor .002 % are left."""
    runs = all_touches(scenario(logger(pairs_per_s), 2.0, tremor=0.05))
    errors = [touch.ratio / RATIO - 1 for touches in runs for touch in touches]
    assert np.sqrt(np.mean(np.square(errors))) < 5e-5


def test_few_samples_of_an_alias_have_no_standard_error() -> None:
    """Two samples, whose innovations are those of the first ratio: their scatter is not known."""
    press = Press(3.0, [(0.0, RATIO)], hold_s=1.5)
    run = simulate(Scenario(presses=[press], duration_s=8.0, tremor=0.03, converter=logger(2.0)))
    [touch], _ = touches_of(run)
    assert 0 < touch.samples <= 3
    assert np.isnan(touch.standard_error)


def idle(period_s: float, seconds: float, drift_pF_per_s: float, seed: int) -> palpate.Tracker:
    """Return a tracker after a rest with little noise, of which a drift is many in a pair."""
    random = np.random.default_rng(seed)
    count = int(seconds / period_s)
    t = period_s * np.arange(count)
    t_ns = np.rint(1e9 * t).astype(np.int64)
    noise = 4e-6 * random.standard_normal((2, count))
    tracker = palpate.Tracker("handheld")
    drift = drift_pF_per_s * t
    later = t_ns + round(5e8 * period_s)
    tracker.process(t_ns, later, 0.62 + drift + noise[0], -0.41 - drift / 2 + noise[1])
    tracker.finish()
    return tracker


@pytest.mark.parametrize("period_s", [0.5, 0.223, 0.128, 0.04])
@pytest.mark.parametrize("drift_pF_per_s", [0.0, 3e-4, -3e-4])
def test_a_slow_rest_is_no_touch(period_s: float, drift_pF_per_s: float) -> None:
    """With a baseline of five values, whose noise is not well known."""
    for seed in SEEDS:
        tracker = idle(period_s, 60.0, drift_pF_per_s, seed)
        assert (len(tracker.touches), tracker.retaken) == (0, 0)


@pytest.mark.parametrize(
    ("period_s", "values"), [(0.5, 5), (0.223, 5), (0.128, 8), (0.05, 20), (0.03, 32), (0.01, 32)]
)
def test_a_first_baseline_takes_a_second_and_five_pairs_at_least(
    period_s: float, values: int
) -> None:
    random = np.random.default_rng(3)
    count = 40
    t_ns = np.rint(1e9 * period_s * np.arange(count)).astype(np.int64)
    tracker = palpate.Tracker("handheld")
    noise = 1e-5 * random.standard_normal((2, count))
    rows = tracker.process(t_ns, t_ns, 0.62 + noise[0], -0.41 + noise[1])
    known = np.flatnonzero(np.isfinite(rows["hard_baseline"]))
    ahead = 2  # readings that the screen looks at before it passes one on
    assert known[0] + 1 == values + ahead


def test_a_press_while_the_baseline_is_measured_does_not_become_it() -> None:
    """At 3 pairs a second five values take as long as the rise of a press and the pause before it."""
    for pause_s in (2.5, 2.8, 3.1, 3.4, 3.7):
        first = Press(3.0, [(0.0, RATIO)], hold_s=6.0)
        second = replace(first, start_s=first.stop_s + pause_s)
        scene = Scenario(
            presses=[first, second],
            duration_s=second.stop_s + 1.0,
            tremor=0.0,
            converter=logger(3.0),
        )
        touches, tracker = touches_of(simulate(scene))
        assert (len(touches), tracker.retaken) == (2, 0)
        assert all(abs(touch.ratio / RATIO - 1) < 1e-3 for touch in touches)
