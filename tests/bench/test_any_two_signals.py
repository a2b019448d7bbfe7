"""The bench of any two signals: its rows, how it judges estimators that are right or wrong by design, its rivals and worlds."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from project import need_package

from bench.accuracy import any_two_signals, signal_followers, signal_rows, signal_worlds
from bench.accuracy.signal_followers import Follower, Trace
from bench.accuracy.signal_rows import Row
from bench.accuracy.signal_worlds import Signals

ROWS = {"late": 3, "early": 4, "small": 7, "drift": 8, "slides": 3, "slow-noise": 5, "white": 4, "grown": 3, "width": 8,
        "constant-200": 15, "constant-40": 15}  # fmt: skip
OTHER_SEED = 2


def right(signals: Signals) -> Trace:
    """Know the truth, and the standard error of least squares; an alarm is where the ratio changes."""
    information = np.maximum(np.cumsum(signals.regressor**2), 1e-9)
    alarm = np.diff(signals.ratio, prepend=signals.ratio[0]) != 0
    return Trace(signals.ratio, signals.noise / np.sqrt(information), alarm)


def biased(signals: Signals) -> Trace:
    return replace(right(signals), ratio=1.2 * signals.ratio + 20 * signals.noise)


def unknowing(signals: Signals) -> Trace:
    return replace(right(signals), error=np.full(len(signals.ratio), math.nan))


def silent(signals: Signals) -> Trace:
    return replace(right(signals), alarm=np.zeros(len(signals.ratio), bool))


def nervous(signals: Signals) -> Trace:
    return replace(right(signals), alarm=np.arange(len(signals.ratio)) % 100 == 0)


def rows_with(monkeypatch: pytest.MonkeyPatch, follow: Follower, theme: str) -> list[Row]:
    """Return the rows of a theme with an estimator in place of HandoverRls, without those of VectorRls."""
    monkeypatch.setattr(signal_rows, "RIVALS", {})
    monkeypatch.setattr(signal_rows, "handover", follow)
    rows = any_two_signals.rows_of(theme, 1)
    return [row for row in rows if "VectorRls" not in row.name and "designed" not in row.name]


def test_each_theme_has_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signal_rows, "RIVALS", {"Rls .98": signal_followers.plain})
    rows = [row for theme in ROWS for row in any_two_signals.rows_of(theme, 1)]
    assert Counter(row.theme for row in rows) == ROWS
    assert ROWS.keys() == signal_rows.THEMES.keys()
    assert len({row.title for row in rows}) == len(rows)
    for row in rows:
        assert str(row).startswith(f"{row.verdict} {row.title} ")
        assert row.rivals.keys() == ({"Rls .98"} if row.rivals else set())


@pytest.mark.parametrize("theme", ROWS)
def test_an_estimator_that_knows_the_truth_holds(
    monkeypatch: pytest.MonkeyPatch, theme: str
) -> None:
    rows = rows_with(monkeypatch, right, theme)
    assert [row.title for row in rows if not row.holds] == []
    assert not any_two_signals.any_fails(rows)


@pytest.mark.parametrize(
    ("follow", "theme", "failing"),
    [
        (biased, "late", 3),
        (biased, "early", 1),
        (biased, "small", 4),
        (biased, "drift", 4),
        (biased, "slides", 3),
        (biased, "grown", 1),
        (biased, "constant-40", 15),
        (unknowing, "late", 3),
        (unknowing, "small", 4),
        (unknowing, "drift", 4),
        (unknowing, "slides", 3),
        (unknowing, "grown", 1),
        (unknowing, "width", 8),
        (unknowing, "constant-200", 15),
        (silent, "early", 3),
        (nervous, "slow-noise", 2),
        (nervous, "white", 1),
        (nervous, "grown", 1),
    ],
)
def test_a_planted_fault_fails(
    monkeypatch: pytest.MonkeyPatch, follow: Follower, theme: str, failing: int
) -> None:
    rows = rows_with(monkeypatch, follow, theme)
    assert sum(not row.holds for row in rows) == failing
    assert any_two_signals.any_fails(rows)


def test_a_row_with_a_reason_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    row = Row("late", "sine", "2", "3", holds=False)
    assert row.verdict == "FAILS"
    monkeypatch.setitem(signal_rows.KNOWN, "late: sine", "Why.")
    assert str(row).startswith("known late: sine")
    assert str(row).endswith("\n      Why.")
    assert replace(row, holds=True).verdict == "holds"


def test_alarms_that_last_count_once() -> None:
    alarm = np.array([1, 1, 0, 1, 0, 0, 1], bool)
    assert signal_rows.begun(alarm) == 3


def test_bad_seeds_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["any_two_signals", "--seeds", "0"])
    with pytest.raises(SystemExit, match="2"):
        any_two_signals.main()
    assert "--seeds is 0; give 1 or more" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["VectorRls(1)", "Rls .98", *signal_followers.COMPILED])
def test_rivals_are_right_in_any_unit(name: str) -> None:
    if name in signal_followers.COMPILED:
        need_package("numba")
    follow = signal_followers.RIVALS[name]
    signals = signal_worlds.constant(OTHER_SEED, 200, "uniform .5-1.5", "white")
    found = follow(signals)
    ideal = signals.noise / math.sqrt(float(np.sum(signals.regressor**2)))
    # 4 of their standard errors, none of which is below the ideal one or above three of it
    assert 0.99 * ideal < found.error[-1] < 3 * ideal
    assert abs(found.ratio[-1] - signal_worlds.CONSTANT) < 4 * found.error[-1]
    scaled = Signals(1e6 * signals.output, 1e-3 * signals.regressor, 1e9 * signals.ratio, 1e6 * signals.noise)  # fmt: skip
    again = follow(scaled)
    # an initial ratio of 0 or 1 with a variance of 1e12 or more of the noise, in double
    assert again.ratio[20:] == pytest.approx(1e9 * found.ratio[20:], rel=1e-6)
    assert again.error[-1] == pytest.approx(1e9 * found.error[-1], rel=1e-6)


@pytest.mark.parametrize("name", [name for name in signal_worlds.NOISES if name != "t3"])
def test_noises_have_their_standard_deviation(name: str) -> None:
    # AR .95: 20,000 samples are worth 1,000 of white noise for the variance, 4 of its errors are .09 of the standard
    # deviation. t3 has no fourth moment. Outliers of 10 in 5 %: sqrt(.95 + 5).
    known = {"quantised": 1.14, "5 % outliers": math.sqrt(5.95)}
    noise = signal_worlds.NOISES[name](np.random.default_rng(OTHER_SEED), 20_000)
    if name != "1/f":
        assert noise.std() == pytest.approx(known.get(name, 1.0), rel=0.1)
        assert abs(noise.mean()) < 4 * math.sqrt(39 / 20_000)
    assert noise.shape == (20_000,)


def test_a_slide_begins_and_ends_as_it_says() -> None:
    signals = signal_worlds.slide(OTHER_SEED, 0.4, 1.5)
    begin = math.floor(signal_worlds.PAIRS_PER_S * signal_worlds.SLIDE_AT_S)
    assert signals.ratio[begin] == 2.5
    assert signals.ratio[begin + 2] > 2.5
    after = math.ceil(signal_worlds.PAIRS_PER_S * 1.5)
    assert signals.ratio[begin + after - 2] < 3.5
    assert signals.ratio[begin + after + 2 :] == pytest.approx(3.5)
    # .5 s after it, but for the part of a pair by which it is delayed
    assert len(signals.ratio) - begin - after == pytest.approx(19, abs=1)
