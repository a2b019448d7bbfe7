"""The comparison with rivals: same alignment, fair settings, and a table that says where another row is better."""

import math
from dataclasses import replace

import numpy as np
import palpate
import pytest
from palpate import benchmark
from palpate.simulation import Simulation, scenarios
from project import need_package

from bench import rivals
from bench.accuracy import compared, stages, tune_walk
from bench.accuracy.must_hold import front
from bench.accuracy.must_hold.row import Row, line
from bench.aligned import aligned, contact
from bench.peers import PEERS

ROW = benchmark.Row("tremor", "handheld scene", 0.003, 0.0, 0.0, 0.95, math.nan, math.nan, 200.0, 0.004)


@pytest.fixture(scope="module")
def tremor() -> Simulation:
    return scenarios.run("strong-tremor", 3)


@pytest.mark.parametrize("name", ["strong-tremor", "lost-runs", "jitter", "slow-converter", "together", "host-stamps"])
def test_the_alignment_is_that_of_the_core(name: str) -> None:
    run = scenarios.run(name, 1)
    rows = palpate.Tracker("handheld").process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    pairs = aligned(run)
    inside = rows["touch"][pairs.at] == 1
    at = pairs.at[inside]
    hard, soft = pairs.hard[inside] - rows["hard_baseline"][at], pairs.soft[inside] - rows["soft_baseline"][at]
    assert len(at) > 100
    # The core's times are whole nanoseconds: a slope of 26 pF in a second, for half of one, is 1e-8 pF of 0.25.
    assert palpate.HandoverRls().process(hard, soft) == pytest.approx(rows["ratio"][at], rel=1e-7)


def test_a_rival_gets_changes_from_the_true_contact_on(tremor: Simulation) -> None:
    at, output, regressor = contact(tremor)
    start = tremor.presses[0].start_s
    assert start < tremor.t_hard_s[at[0]] < start + 2 * 0.026 + 0.001  # the first pair is complete one pair later
    assert tremor.t_hard_s[at[-1]] < start + benchmark.LENGTH_S
    assert output[-100:] / regressor[-100:] == pytest.approx(tremor.true_ratio[at[-100:]], rel=2e-3)


@pytest.mark.filterwarnings("ignore:Use KalmanFilter:DeprecationWarning")
@pytest.mark.parametrize("library", list(PEERS))
def test_other_libraries_are_least_squares_with_forgetting(tremor: Simulation, library: str) -> None:
    need_package(library)
    _, output, regressor = contact(tremor)
    expected = rivals.fixed(0.995)(output, regressor)[0]
    # P0 = 1e12 in a form that subtracts: eps P0 x^2 = 1e-5 of the first P, less with each sample.
    assert PEERS[library](output, regressor)[0][5:] == pytest.approx(expected[5:], rel=1e-6)


def test_the_first_covariance_does_not_matter_on_a_light_touch() -> None:
    _, output, regressor = contact(scenarios.run("light-touch", 2))
    expected = np.sum(0.995 ** np.arange(len(output))[::-1] * output * regressor)
    expected /= np.sum(0.995 ** np.arange(len(output))[::-1] * regressor**2)
    # 1 / P0 = 1e-12 of 200 x^2 = 8e-6 pF^2.
    assert rivals.fixed(0.995)(output, regressor)[0][-1] == pytest.approx(expected, rel=1e-6)


def test_a_walk_of_zero_is_least_squares(tremor: Simulation) -> None:
    _, output, regressor = contact(tremor)
    found = rivals.kalman_walk(output, regressor, np.array([0.0, 1.0, 1e9]))
    expected = np.cumsum(output * regressor) / np.cumsum(regressor**2)
    assert found[10:, 0] == pytest.approx(expected[10:], rel=1e-8)
    assert found[10:, 2] == pytest.approx(output[10:] / regressor[10:], rel=1e-6)  # it believes the last pair only
    assert rivals.kalman_walk(output, regressor, 1.0) == pytest.approx(found[:, 1], rel=1e-14)


def test_the_walk_was_tuned_on_other_recordings() -> None:
    found = tune_walk.scores(1)
    best = min(found, key=lambda walk: found[walk])
    assert rivals.WALK in found
    assert 0.5 < best / rivals.WALK < 2  # a neighbour on the grid at most, with one seed of ten
    assert tune_walk.FIRST_SEED >= 1000


def test_rival_rows(tremor: Simulation) -> None:
    rows = {row.estimator: row for row in rivals.rival_rows("tremor", 2)}
    assert set(rows) == {*rivals.RIVALS, rivals.OFFLINE}
    assert all(0 < row.rmse < 2e-4 for row in rows.values())
    assert len(set(rivals.spline_trace(tremor).error)) == 1  # one ratio, a constant truth


def test_alignment_is_most_of_the_gain_on_a_tremor() -> None:
    found = stages.gains(1)
    assert set(found) == set(stages.SHOWN)
    assert all(list(errors) == list(stages.STEPS) for errors in found.values())
    errors = found["strong-tremor"]
    assert errors["paper"] > 20 * errors["+ alignment"]
    [scene] = (r for r in benchmark.on_scenario("step-up", 1, {}) if r.estimator == "handheld scene")
    assert found["step-up"]["the scene"] == scene.rmse
    assert found["step-up"]["+ instrument"] > 100 * found["step-up"]["+ detector"]
    shown = stages.gains_table({"tremor": {"paper": 0.01, "+ alignment": 0.002}}).splitlines()
    assert shown[-1].split() == ["tremor", "1.0000", "0.2000", "(5.00)"]


@pytest.mark.parametrize(
    ("times", "reason", "verdict", "words"),
    [
        (1.2, "", "holds", "the best; then paper +A 0.36 %"),
        (0.95, "", "holds", "best: paper +A 0.29 %, handheld is 1.05 times that"),
        (0.5, "", "FAILS", "handheld is 2.00 times that"),
        (0.5, "It moves.", "known", "\n      It moves."),
    ],
)
def test_the_row_says_which_is_best(times: float, reason: str, verdict: str, words: str) -> None:
    best = replace(ROW, estimator="paper +A", rmse=times * ROW.rmse)
    row = front.row_of(front.compare([ROW, best]), reason)
    assert row.verdict == verdict
    assert line(row).startswith(f"{verdict} tremor: ")
    assert words in line(row)
    assert "rms over all seeds: 1 times" in line(row)


def test_what_is_offline_our_own_or_another_library_is_no_rival() -> None:
    others = [replace(ROW, estimator=name, rmse=rmse) for name, rmse in
              (("sliding scene", 1e-3), (rivals.OFFLINE, 1e-3), ("river", 1e-3), ("paper +A", 3e-3))]  # fmt: skip
    [row] = front.of_table([ROW, *others])
    assert row.value == pytest.approx(1.0)
    assert "paper +A" in row.beside


def test_a_lost_press_counts_in_the_rms() -> None:
    found = front.compare([replace(ROW, rms=0.07), replace(ROW, estimator="paper +A", rms=0.007)])
    assert found.times == pytest.approx(1)
    assert found.rms_times == pytest.approx(10)


def test_a_reason_does_not_change_what_holds() -> None:
    assert Row("name", 1.0, 2.0, reason="why").verdict == "holds"
    assert line(Row("name", 1.0, 2.0, reason="why")).count("\n") == 0
    assert set(front.REASONS) <= set(benchmark.SINGLE)


def test_the_table_marks_the_least() -> None:
    rows = [replace(ROW, estimator=name, rmse=0.01) for name in (*compared.COLUMNS, rivals.OFFLINE)]
    rows = [replace(row, rmse=0.002, rms=0.002) if row.estimator == "fixed 0.9 +A" else row for row in rows]
    shown = compared.table(rows).splitlines()[-1]
    assert shown.count("*") == 1
    assert "0.2000*" in shown
    assert shown.split()[-5:] == ["2.00", "fixed", "0.9", "+A", "1.0000"]
    assert shown.split()[-6] == "5.00"
