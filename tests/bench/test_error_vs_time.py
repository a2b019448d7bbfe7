"""Error against run time: fair pairs, right rivals, the front, the picture, and what the commands write."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import palpate
import pytest
from palpate.simulation import scenarios, simulate
from project import need_package

from bench import results_age
from bench.accuracy import comparison, error_picture, error_vs_time, rivals, stages
from bench.accuracy.scene_rows import scene_rows

ROW = comparison.Row(
    *("tremor", "handheld scene", 0.003, 0.004, 0.0, 0.0, 0.95, math.nan, math.nan, 0.002),
    cost=comparison.Cost(20.0, 180.0),
)
POINT = error_picture.Point("handheld", 20.0, 0.3, 0.4, 20.0)


@pytest.mark.parametrize("name", ["strong-tremor", "lost-runs", "slow-converter"])
def test_rivals_get_the_pairs_of_the_scene(name: str) -> None:
    run = scenarios.run(name, 1)
    rows = scene_rows(run)
    pairs = comparison.pairs_aligned(run)
    at = np.searchsorted(run.t_hard_s, pairs.since_s + run.presses[0].start_s - 1e-9)
    both = rows["touch"][at] == 1
    idle = run.t_hard_s < run.presses[0].start_s - comparison.EARLY_S
    hard = pairs.output[both] + np.nanmean(run.hard[idle]) - rows["hard_baseline"][at[both]]
    soft = pairs.regressor[both] + np.nanmean(run.soft[idle]) - rows["soft_baseline"][at[both]]
    assert both.sum() > 100
    # The first pairs of the touch may be before the true contact; their weight fades with 0.995^200 at most.
    found = palpate.HandoverRls().process(hard, soft)
    assert found[-1] == pytest.approx(rows["ratio"][at[both]][-1], rel=1e-5)


@pytest.mark.parametrize("library", list(rivals.LIBRARIES))
def test_other_libraries_are_least_squares_with_forgetting(library: str) -> None:
    need_package(library)
    pairs = comparison.pairs_aligned(scenarios.run("strong-tremor", 3))
    expected, _ = comparison.OWN["fixed 0.995"](pairs.output, pairs.regressor)
    # P0 = 1e12 in a form that subtracts: eps P0 x^2 = 1e-5 of the first P, less with each sample.
    assert rivals.LIBRARIES[library](pairs.output, pairs.regressor)[5:] == pytest.approx(
        expected[5:], rel=1e-6
    )


def test_the_front_has_no_point_that_another_beats() -> None:
    shown = [
        replace(POINT, ns=ns, error=error)
        for ns, error in [(5, 0.3), (50, 0.2), (60, 0.4), (90, 0.1), (1e4, 0.0995)]
    ]
    # 0.5 % better is no reason for 100 times the time.
    assert [point.ns for point in error_picture.front(shown)] == [5, 50, 90]


def row_of(estimator: str, rmse: float, ns: float) -> comparison.Row:
    return replace(ROW, estimator=estimator, rmse=rmse, cost=comparison.Cost(ns, 180.0))


def test_a_point_has_a_run_time_and_libraries_in_python_are_one() -> None:
    rows = [row_of(name + comparison.ALIGNED, 0.001, 5e3) for name in ("river", "scipy")]
    rows += [row_of("padasip +A", 0.001, 4e3), row_of("IMM +A", 0.001, math.nan), ROW]
    shown = error_picture.points(rows)
    assert [point.name for point in shown] == ["handheld", "scipy", "padasip\nriver"]
    assert (shown[2].ns, shown[2].slowest_ns) == (4e3, 5e3)
    assert (shown[0].ns, shown[0].error, shown[0].error_90) == pytest.approx((20, 0.3, 0.4))


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (0.6, "handheld is 2.0 times better than the next, IMM"),
        (0.31, "handheld is as good as the best other, IMM"),
        (0.1, "IMM is 3.0 times better than handheld"),
    ],
)
def test_the_title_says_where_handheld_stands(error: float, expected: str) -> None:
    others = [replace(POINT, name=name, error=error) for name in ("IMM", "DMA")]
    assert error_picture.verdict([POINT, *others]) == expected


def test_marks_that_cover_each_other_are_one_with_both_names() -> None:
    shown = [replace(POINT, name=name) for name in ("handheld", "IMM", "DMA")]
    at = np.array([(10.0, 10.0), (12.0, 10.0), (40.0, 10.0)])
    names = [point.name for point in error_picture.merged(shown, at, 1.0)]
    assert names == ["handheld\nIMM", "DMA"]


def test_a_name_covers_nothing_where_it_can() -> None:
    right = error_picture.Box(12.0, -50.0, 50.0, 50.0)
    box = error_picture.place(np.zeros(2), 20.0, 8.0, [3.0, 9.0], [right])
    assert box.overlap(right) == 0
    nearest = error_picture.place(np.zeros(2), 20.0, 8.0, [3.0, 9.0], [])
    assert nearest == error_picture.Box(3.0, -4.0, 23.0, 4.0)


def test_the_bench_draws_its_picture(tmp_path: Path) -> None:
    rows = [
        replace(row_of(name, 1e-3 * n, 100 * n), scenario=scenario)
        for scenario in comparison.PICTURED
        for n, name in enumerate(("handheld scene", "paper scene", "IMM +A", "river +A"), start=1)
    ]
    error_picture.plot(rows, tmp_path / "front.png")
    assert (tmp_path / "front.png").stat().st_size > 10_000


@pytest.mark.parametrize("name", list(rivals.COMPILED))
def test_a_compiled_rival_computes_what_it_says_in_python(name: str) -> None:
    need_package("numba")
    pairs = comparison.pairs_aligned(simulate(comparison.SINGLE["step-up"], 1))
    compiled = rivals.COMPILED[name]
    in_python = compiled.py_func(pairs.output, pairs.regressor)  # type: ignore[attr-defined]
    assert compiled(pairs.output, pairs.regressor) == pytest.approx(in_python, rel=1e-9)


@pytest.mark.parametrize("name", list(rivals.COMPILED))
def test_a_rival_finds_a_constant_ratio_and_a_step(name: str) -> None:
    estimate = rivals.COMPILED[name]
    random = np.random.default_rng(1)
    regressor = random.uniform(0.2, 0.3, 400)
    ratio = np.where(np.arange(400) < 200, 2.5, 3.5)
    output = ratio * regressor + rivals.NOISE * random.standard_normal(400)
    found = estimate(output, regressor)
    # a standard error of one sample is 2.5e-4
    assert found[150:200] == pytest.approx(2.5, abs=5e-4)
    assert found[350:] == pytest.approx(3.5, abs=5e-4)


def test_without_numba_the_loops_have_no_run_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rivals, "find_spec", lambda name: None)
    assert list(rivals.timed()) == ["sum / sum"]


def test_the_bench_makes_its_folder_and_names_who_is_ahead(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("handheld scene", *error_vs_time.COLUMNS[1:])
    rows = [
        replace(row_of(name, 1e-3 / n, 100 * n), scenario=scenario)
        for scenario in comparison.PICTURED
        for n, name in enumerate(names, start=1)
    ]
    monkeypatch.setattr(error_vs_time, "measure", lambda seeds: rows)
    out = tmp_path / "new" / "folder"
    monkeypatch.setattr("sys.argv", ["error_vs_time", "--seeds", "2", "--out", str(out)])
    error_vs_time.main()
    assert {path.name for path in out.iterdir()} == {"error_vs_time.png", "error_vs_time.json"}
    assert f"{names[-1]} is better." in capsys.readouterr().out


def test_the_bench_writes_a_summary_that_names_the_commit(tmp_path: Path) -> None:
    rows = [row for name in ("spikes", "slow-drift") for row in comparison.on_scenario(name, 1, {})]
    found = json.loads(error_vs_time.summary(rows, 1).replace("NaN", "null"))
    assert found["columns"][-1] == "handheld / best"
    assert found["spikes"][-1] < 1 < found["slow-drift"][-1]
    # Each result is revised: handheld's first cell is better than at the end, where half of the drift is not known.
    assert found["slow-drift, revised"][0] < 0.5 * found["slow-drift"][0]
    assert found["headers"] == results_age.headers_hash()
    assert found["commit"]
    assert error_vs_time.BETTER["slow-drift"] in error_vs_time.table(rows)
    assert {line.removesuffix(error_vs_time.REVISED) for line in error_vs_time.BETTER} <= set(
        comparison.SINGLE
    )


def test_well_set_detectors_follow_a_step_at_once() -> None:
    """docs/numbers.md: the paper's thresholds take ten times the pairs of the scene, those from the noise twice."""
    bare = comparison.bare_estimators(libraries=False)
    wanted = {name: bare[name] for name in ("paper", "paper tuned", "restarted")}
    rows = {row.estimator: row for row in comparison.on_scenario("step-up", 8, {}, wanted)}
    pairs = {name: row.pairs_to_3_percent for name, row in rows.items()}
    assert pairs["handheld scene"] == pytest.approx(4, abs=1)
    assert pairs["paper +A"] == pytest.approx(10 * pairs["handheld scene"], rel=0.1)
    assert pairs["paper tuned +A"] == 2 * pairs["handheld scene"]
    assert pairs["restarted +A"] < pairs["handheld scene"]
    assert rows["restarted +A"].rmse < 1.2 * rows["handheld scene"].rmse


def test_alignment_is_most_of_the_gain_on_a_tremor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stages, "SHOWN", ("strong-tremor",))
    found = stages.gains(1)
    assert found["strong-tremor"]["paper"] > 20 * found["strong-tremor"]["+ alignment"]
    assert stages.gains_table(found).count("\n") == stages.KEY.count("\n") + 2


def test_results_say_with_which_headers_they_were_measured(tmp_path: Path) -> None:
    hashes = []
    for text in ("int limit = 8;  // samples\n", "\nint  limit = 8;\n", "int limit = 9;\n"):
        (tmp_path / "one.hpp").write_text(text)
        hashes.append(results_age.headers_hash(tmp_path))
    assert hashes[0] == hashes[1] != hashes[2]
    for code, headers in enumerate([results_age.headers_hash(), hashes[0]]):
        (tmp_path / f"{code}.json").write_text(json.dumps({"headers": headers}))
        assert results_age.main(tmp_path) == code
