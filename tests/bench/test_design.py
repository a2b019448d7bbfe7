"""The bench of the design: its columns are those of palpate.design, its shifts and delays are as it says."""

import math
from concurrent.futures import ThreadPoolExecutor
from math import inf

import numpy as np
import palpate
import pytest
from palpate.design import cusum, run_length

from bench.accuracy import design
from bench.accuracy.design import DEFAULT, NOISES, QUICK, Choice, Delays, FalseAlarms
from bench.accuracy.signal_worlds import Array, generator

WHITE, CORRELATED, LAPLACE, _ = NOISES
CHAIN = 0.02  # error of run_length, as its documentation says
SEED = 1


def delays_row(choice: Choice, shift: float, delays: list[float]) -> Delays:
    return Delays(choice, WHITE, 60, shift, np.array(delays))


@pytest.mark.parametrize("choice", [DEFAULT, QUICK])
@pytest.mark.parametrize("shift", design.SHIFTS)
def test_the_designed_delays_are_those_of_the_design(choice: Choice, shift: float) -> None:
    goal = {
        "false_alarm_interval": choice.false_alarm_interval,
        "smallest_shift": choice.smallest_shift,
    }
    designed = cusum(**goal)
    threshold = palpate.HandoverRls(**goal).threshold
    row = delays_row(choice, shift, [3.0])
    assert row.of_design == run_length(designed.drift, designed.threshold, shift=shift, clip=3.0)
    assert row.of_threshold == run_length(designed.drift, threshold, shift=shift, clip=3.0)
    assert str(row).split()[-2:] == [f"{row.of_design:.1f}", f"{row.of_threshold:.1f}"]
    if shift == choice.smallest_shift:
        assert row.of_design == pytest.approx(designed.delay, rel=CHAIN)


@pytest.mark.parametrize("choice", design.RECORDS)
def test_the_designed_false_alarms_are_those_of_the_design(choice: Choice) -> None:
    """HandoverRls gives its CUSUM 5.363 times the interval; its default threshold is rounded up to 11."""
    row = FalseAlarms(choice, WHITE, 1000, np.array([2]), 1)
    wanted = 5.363 * choice.false_alarm_interval
    assert row.designed_of_cusum == pytest.approx(wanted, rel=CHAIN)
    assert str(row).split()[-1] == design.rounded(row.designed_of_cusum)


def test_false_alarms_are_those_of_the_estimator() -> None:
    choice = Choice(1e4)
    row = design.false_alarms(choice, LAPLACE, 20_000, 1)
    made = design.signals(
        LAPLACE, np.full(20_000, design.RATIO), generator(0, design.FALSE_ALARMS_WORLD)
    )
    estimator = choice.estimator()
    alarms = 0
    of_cusum = 0
    alarm = False
    for output, regressor in zip(made.output, made.regressor, strict=True):
        estimator.update(output, regressor)
        begins = estimator.alarm and not alarm
        alarm = estimator.alarm
        alarms += begins
        of_cusum += begins and estimator.statistic > estimator.threshold
    assert (row.samples, row.alarms, row.of_cusum) == (20_000, alarms, of_cusum)
    assert 0 < of_cusum < alarms
    assert row.interval == 20_000 / alarms


@pytest.mark.parametrize(("alarms", "fewest", "most"), [(0, 0.0, 3.689), (10, 4.795, 18.390)])
def test_limits_are_those_of_a_poisson_count(alarms: int, fewest: float, most: float) -> None:
    """Garwood 1936, to four digits."""
    low, high = FalseAlarms(DEFAULT, WHITE, 1000, np.array([alarms]), 0).limits
    assert low == pytest.approx(1000 / most, rel=1e-3)
    assert high == (pytest.approx(1000 / fewest, rel=1e-3) if fewest else inf)


def test_limits_are_wider_if_alarms_follow_each_other() -> None:
    """Forty alarms with a dispersion of 13 are worth three; their limits are beyond those of four."""
    single = FalseAlarms(DEFAULT, WHITE, 4000, np.array([4]), 0)
    grouped = FalseAlarms(DEFAULT, WHITE, 40_000, np.array([20, 0, 20, 0]), 0)
    assert grouped.dispersion == pytest.approx(400 / 3 / 10)
    low, high = grouped.limits
    assert low < single.limits[0] * grouped.interval / single.interval
    assert high > single.limits[1] * grouped.interval / single.interval
    even = FalseAlarms(DEFAULT, WHITE, 40_000, np.array([10, 10, 10, 10]), 0)
    assert even.dispersion == 1.0


@pytest.mark.parametrize("noise", [WHITE, CORRELATED])
def test_a_shift_is_that_of_the_whitened_innovations(noise: design.Noise) -> None:
    made = design.signals(noise, np.full(100, design.RATIO), np.random.default_rng(SEED))
    stepped = design.with_step(made, 60, design.ratio_step(noise, 1.5))
    change = (stepped - made.output) / made.regressor / design.SD
    whitened = change[1:] - noise.rho * change[:-1]
    # 1e-12: an output of 2 has a rounding error of 4e-16, in units of .01 4e-14.
    assert whitened[:59] == pytest.approx(0.0, abs=1e-12)
    assert whitened[59] == pytest.approx(1.5 / (1 - noise.rho), abs=1e-12)
    assert whitened[60:] == pytest.approx(1.5, abs=1e-12)


@pytest.mark.parametrize("noise", NOISES)
def test_innovations_have_their_standard_deviation(noise: design.Noise) -> None:
    values = noise.make(np.random.default_rng(SEED), 50_000)
    innovations = values[1:] - noise.rho * values[:-1]
    # White: .0032 is its error, and 5 of them are the limit; Laplace .005; t3 has no fourth moment.
    assert innovations.std() == pytest.approx(1.0, abs=0.1 if noise.name == "t3" else 0.025)
    assert abs(np.corrcoef(innovations[1:], innovations[:-1])[0, 1]) < 5 / math.sqrt(50_000)


def test_a_shift_beyond_the_clip_is_found_at_its_fifth_sample(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As computed: 5 (3 - .75) is more than 11. A CUSUM that was above 2 needs four samples."""
    monkeypatch.setattr(design, "SHIFTS", (20.0,))
    monkeypatch.setattr(design, "RUNS", 5)
    [row] = design.delays(DEFAULT, WHITE, 300, 1)
    assert len(row.delays) == 5
    assert row.median == 5
    assert row.of_threshold == pytest.approx(5.0, rel=CHAIN)


def test_a_run_with_an_alarm_before_the_shift_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def shifted_before(noise: design.Noise, ratio: Array, random: np.random.Generator) -> object:
        made = steady(noise, ratio, random)
        made.output[50:] *= 2
        return made

    steady = design.signals
    monkeypatch.setattr(design, "signals", shifted_before)
    monkeypatch.setattr(design, "RUNS", 1)
    rows = design.delays(DEFAULT, WHITE, 60, 1)
    assert [len(row.delays) for row in rows] == [0] * len(design.SHIFTS)
    assert all(math.isnan(row.mean) and math.isnan(row.lost) for row in rows)


def test_a_shift_that_is_not_found_counts_in_median_and_share() -> None:
    row = delays_row(DEFAULT, 1.0, [2.0, 4.0, inf, inf, inf])
    assert (row.mean, row.median, row.lost) == (3.0, inf, 0.6)
    assert "> 300" in str(row)
    assert design.first(np.array([False, True, True])) == 2
    assert design.first(np.array([False])) == inf


def test_each_table_has_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(design, "RECORDS", {Choice(1e4): 500, DEFAULT: 1000})
    monkeypatch.setattr(design, "RUNS", 1)
    with ThreadPoolExecutor(1) as pool:
        alarms = list(design.false_alarm_rows(pool, SEED))
        delays = [row for rows in design.delay_rows(pool, QUICK, SEED) for row in rows]
    assert [row.samples for row in alarms] == [500] * 4 + [1000] * 4
    assert [row.noise for row in alarms] == [*NOISES, *NOISES]
    cells = {(row.noise, row.after, row.shift) for row in delays}
    assert len(cells) == len(delays) == len(NOISES) * len(design.AFTER) * len(design.SHIFTS)


def test_the_title_has_the_design() -> None:
    assert "threshold 9.91, delay 14.4 for a shift of 1.5" in design.title(DEFAULT)
    assert "false_alarm_interval=1e4, smallest_shift=1\n" in design.title(QUICK)


def test_bad_seeds_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["design", "--seeds", "0"])
    with pytest.raises(SystemExit, match="2"):
        design.main()
    assert "--seeds is 0; give 1 or more" in capsys.readouterr().err
