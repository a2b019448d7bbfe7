"""The reviser against its formula: the line between the baselines before and after, at the mean time of the samples."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import palpate
import pytest
from driving import drive
from palpate.simulation import Faults, scenarios, simulate

NONE, DRIFT, CREEP, BASELINE = range(4)


@dataclass(frozen=True)
class Known:
    """A baseline: level and variance of it, mean age of its values, noise of a value, slope from value to value."""

    level: float
    variance: float = 1e-11
    age: float = 15.5
    noise: float = 4e-5
    slope: float = 0.0

    def numbers(self) -> list[float]:
        return [self.level, self.variance, self.age, self.noise, self.slope]


@dataclass(frozen=True)
class Case:
    """A touch of `samples` readings from `start`, of which a hand-over at `change` keeps `kept`."""

    before: tuple[Known, Known] = (Known(0.62), Known(-0.41))
    after: tuple[Known, Known] = (Known(0.6203), Known(-0.4101))
    start: int = 100
    samples: int = 250
    forgetting: float = 0.995
    change: int = -1
    kept: float = 12.0
    reading: int = 400
    ratio: float = 2.8
    mean: float = 0.25

    def revised(self, real: str = "double") -> dict[str, Any]:
        head = [self.start, self.samples, self.forgetting, self.change, self.kept, self.reading, self.ratio, self.mean]
        lines = [n for known in (*self.before, *self.after) for n in known.numbers()]
        kind, shift, variance, left_open, significant = drive("revise", [*head, *lines], 5, real)[0]
        return {"kind": kind, "shift": shift, "variance": variance, "open": left_open, "significant": significant}

    def part(self) -> float:
        """Return the share of the line at the mean time of the samples, with their weights."""
        ages = np.arange(self.samples)
        weights = self.forgetting ** ages.astype(float)
        if self.change >= 0:  # the samples that the hand-over kept have the same weight
            since = self.samples - 1 - self.change
            recent, kept = weights[:since], np.full(int(self.kept), weights[since])
            weights = np.concatenate([recent, kept])
            ages = np.arange(len(weights))
        touch = self.start + self.samples - 1 - (weights @ ages) / weights.sum()
        begin, end = self.start - self.before[0].age, self.reading - self.after[0].age
        return float((touch - begin) / (end - begin))


@pytest.mark.parametrize("forgetting", [1.0, 0.995, 0.95])
@pytest.mark.parametrize("change", [-1, 60, 200])
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-9), ("float", 1e-3)])
def test_the_shift_is_that_of_the_line(forgetting: float, change: int, real: str, tolerance: float) -> None:
    case = Case(forgetting=forgetting, change=change)
    rises = [after.level - before.level for before, after in zip(case.before, case.after, strict=True)]
    line = [case.part() * rise for rise in rises]
    found = case.revised(real)
    assert found["kind"] == DRIFT
    assert found["shift"] == pytest.approx(-(line[0] - case.ratio * line[1]) / case.mean, rel=tolerance)
    share, both = case.part(), 1e-11 * (1 + case.ratio**2)
    assert found["variance"] == pytest.approx(((1 - share) ** 2 + share**2) * both, rel=tolerance)
    assert found["open"] == pytest.approx(found["shift"] ** 2 / (4 if change >= 0 else 16), rel=tolerance)
    assert found["significant"]


def test_a_baseline_that_stayed_leaves_nothing_open() -> None:
    case = Case(after=(Known(0.620002), Known(-0.41)))
    found = case.revised()
    assert (found["kind"], found["open"], found["significant"]) == (DRIFT, 0, 0)
    assert found["variance"] < 1e-11 * (1 + case.ratio**2)  # two baselines are better than one


def test_a_baseline_measured_in_contact_is_not_corrected() -> None:
    """Both channels are lower after the release, by more than 5 % of the touch."""
    found = Case(after=(Known(0.62 - 0.06), Known(-0.41))).revised()
    assert found["kind"] == BASELINE
    assert found["open"] == pytest.approx(found["shift"] ** 2)
    assert Case(after=(Known(0.62 - 0.04), Known(-0.41))).revised()["kind"] == DRIFT  # 4.2 % of 3.8 * 0.25 pF


@pytest.mark.parametrize("channel", [0, 1])
def test_a_channel_that_recovers_creeps(channel: int) -> None:
    """The slope after the touch is against the rise: more than 4 standard errors of both."""
    plain = Case()
    for slope, rise, kind in ((-2e-5, 3e-4, CREEP), (2e-5, 3e-4, DRIFT), (-2e-6, 3e-4, DRIFT), (-2e-5, 1e-5, DRIFT)):
        after = list(plain.before)
        after[channel] = replace(after[channel], level=after[channel].level + rise, slope=slope)
        found = replace(plain, after=(after[0], after[1])).revised()
        assert found["kind"] == kind, (slope, rise)
        if kind == CREEP:
            assert found["open"] == pytest.approx(found["shift"] ** 2)
            assert found["variance"] == pytest.approx(1e-11 * (1 + plain.ratio**2))


def test_a_baseline_that_is_known_with_a_reading_of_one_channel_revises() -> None:
    """The last value of the soft baseline comes alone: its hard reading is lost."""
    run = scenarios.run("drift-soft", 1)
    rows = palpate.Tracker().process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    [at] = np.flatnonzero(rows["revised"])
    hard, soft = run.hard.copy(), run.soft.copy()
    soft[at - 5] = hard[at + 1] = np.nan  # the soft baseline is one value behind
    later = palpate.Tracker().process(run.t_hard_s, run.t_soft_s, hard, soft)
    assert np.flatnonzero(later["revised"]).tolist() == [at + 1]


def test_lost_readings_do_not_shift_the_mean_time_of_a_touch() -> None:
    """A steady drift is corrected as well with a fifth of the conversions lost: ages count readings, not samples."""
    scenario = scenarios.SCENARIOS["drift-soft"]
    truth, errors = scenario.presses[0].ratios[0][1], []
    for seed in range(12):
        run = simulate(replace(scenario, faults=Faults(lost=0.2)), seed)
        tracker = palpate.Tracker()
        tracker.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
        [touch] = tracker.touches
        assert touch.revised
        errors.append(abs(touch.ratio / truth - 1))
    assert np.median(errors) < 8e-4  # 4e-4; by samples 16e-4
