"""The study of several touches, small: what must not turn over between its hands."""

import math

import numpy as np
import pytest
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.scenarios import PROBE

from bench.accuracy import reliability, touch_ranks
from bench.accuracy.hands import FREE, HANDS, STAGE, level_ratio, recorded
from bench.accuracy.reliability import Outcome, Row

SEEDS = 8


def study(name: str) -> tuple[touch_ranks.RankRow, dict[str, Row]]:
    runs = [reliability.judged(HANDS[name], seed) for seed in range(SEEDS)]
    rows = {by: reliability.summarise(name, by, (found[by] for _, found in runs)) for by in reliability.METHODS}
    return touch_ranks.rank_row(name, (known for known, _ in runs)), rows


def test_nothing_knows_an_independent_factor() -> None:
    ranks, rows = study("factor 10 %")
    # 80 specimens; the correlation of four random ranks scatters by 1 / sqrt(3): 0.065 in the mean; 4 of it.
    for name in ("P", "std. error", "unlevel"):
        assert abs(ranks.correlations[name]) < 0.26, name
    # Half the error of one touch; over 8 seeds an rms error scatters by 25 %, the same touches are in both.
    assert rows["mean"].rms_error < 0.8 * rows["covariance"].rms_error
    assert rows["level"].rms_error == pytest.approx(rows["mean"].rms_error, rel=0.05)
    assert len(reliability.table(rows.values()).splitlines()) == 1 + len(rows)
    assert touch_ranks.rank_table([ranks]).splitlines()[1].startswith("factor 10 %")


def test_the_fit_knows_a_tilt_and_smallest_p_some_of_it() -> None:
    ranks, rows = study("tilt, trembling")
    assert ranks.correlations["unlevel"] > 0.7
    assert 0.05 < ranks.correlations["P"] < 0.6
    assert rows["level"].rms_error < 0.7 * rows["mean"].rms_error
    assert rows["level"].rms_error < 0.7 * rows["covariance"].rms_error


def test_on_a_stage_the_scatter_is_gone() -> None:
    def errors(name: str) -> float:
        return touch_ranks.rank_row(name, [touch_ranks.known(recorded(HANDS[name], seed)) for seed in (0, 1)]).rms_error

    assert errors("stage") < 0.01 * errors("all of tilt and gauges")
    # Gauges with the same curve: on the stage, too, the ratio is not that of the forces.
    ratio = PROBE.ratio(SORBOTHANE_MPA["40 A"])
    assert level_ratio(STAGE, ratio) == level_ratio(FREE, ratio) > 1.03 * ratio


@pytest.mark.parametrize(
    ("values", "expected"),
    [([1.0, 1.0, 1.0], math.nan), ([1.0, math.nan, 1.0], math.nan), ([1.0, 5.0, 7.0], 1.0), ([7.0, 5.0, 1.0], -1.0)],
)
def test_what_has_a_correlation(values: list[float], expected: float) -> None:
    errors = np.array([0.1, 0.2, 0.9])
    assert touch_ranks.correlation(values, errors) == pytest.approx(expected, nan_ok=True)
    assert math.isnan(touch_ranks.correlation(values[:2], errors[:2]))


def test_a_session_without_a_result_is_left_out() -> None:
    kept = Outcome(True, 0.1, True, 0.5)
    row = reliability.summarise("hand", "mean", [kept, None, Outcome(True, math.nan, False, math.inf)])
    assert row.left_out == 2
    assert row.rms_error == pytest.approx(0.1)
    assert math.isnan(reliability.summarise("hand", "mean", [None]).rms_error)
