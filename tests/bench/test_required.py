"""The required results and the study of several touches: how they judge, and a small run of each."""

import math

import pandas as pd
import pytest
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.scenarios import PROBE

from bench.accuracy import must_hold, presses, reliability
from bench.accuracy.must_hold import Row
from bench.accuracy.reliability import FREE, STAGE, level_ratio
from bench.accuracy.slides import SLIDES, Slide, after_slides, largest_error


@pytest.mark.parametrize(
    ("value", "at_least", "reason", "verdict"),
    [(1.1, False, "", "FAILS"), (1.0, True, "", "holds"), (0.9, True, "", "FAILS"), (math.nan, False, "", "FAILS"),
     (1.1, False, "Why.", "known"), (0.9, False, "Why.", "holds")],
)  # fmt: skip
def test_verdicts(value: float, at_least: bool, reason: str, verdict: str) -> None:
    row = Row("name", value, 1.0, at_least=at_least, reason=reason)
    assert str(row).startswith(f"{verdict} name")
    assert str(row).endswith("Why.") == (verdict == "known")


def test_the_lowest_coverage_counts() -> None:
    rows = [
        Row("good", 0, 1, coverage=0.95, intervals=200),
        Row("bad", 0, 1, coverage=0.8, intervals=20),
    ]
    few = Row("few", 0, 1, coverage=0.0, intervals=19)
    worst = must_hold.lowest_coverage("theme", [*rows, few])
    assert (worst.verdict, worst.beside) == ("FAILS", "bad; 2 rows")


@pytest.mark.parametrize(
    ("error", "standard_error", "flags", "silent"),
    [
        (-0.01, 1e-4, (), True),
        (0.01, 1e-4, ("offset",), False),
        (0.01, 3e-3, (), False),  # within 4 standard errors
        (0.0015, 1e-4, (), False),  # within 0.2 %
        (0.01, math.nan, (), True),  # no interval does not excuse a wrong ratio
    ],
)
def test_silent(error: float, standard_error: float, flags: tuple[str, ...], silent: bool) -> None:
    assert presses.Result(error, standard_error, frozenset(flags)).silent == silent


@pytest.mark.parametrize(
    "theme", [name for name in must_hold.THEMES if name not in ("touches", "offline")]
)
def test_themes_have_rows(theme: str) -> None:
    rows = must_hold.rows_of(theme, 1)
    assert all(math.isfinite(row.value) for row in rows if "coverage" not in row.name)
    assert rows[-1].name.startswith(f"{theme}: lowest coverage") == (theme in must_hold.COVERED)


@pytest.mark.parametrize(
    "slide", SLIDES, ids=lambda slide: f"{slide.share} in {slide.duration_s} s"
)
def test_a_slide_is_followed_with_an_interval_that_holds(slide: Slide) -> None:
    """`Slide.limit` derives the limit; five pairs until a hand-over exceed it."""
    largest, share, _ = largest_error(slide, presses.DEPTH_PF, 8)
    assert largest <= slide.limit(presses.DEPTH_PF)
    assert share >= 0.6


@pytest.mark.parametrize("lag_s", [0.026, 0.052, 0.1])
def test_a_gauge_that_lags_is_not_silent_where_the_probe_is_lifted(lag_s: float) -> None:
    found = list(after_slides(Slide(0.0, 1.5, 0.0), 8, lag_s))
    assert not any(result.silent for result in found)
    assert all("lag" in result.flags for result in found)


def study(name: str) -> tuple["pd.Series[float]", "pd.Series[float]"]:
    """Return rank correlations, and errors of the modulus, from 8 sessions of a hand."""
    found = reliability.study([name], 8)
    return found["rank correlation"].loc[name], found["rms error of the modulus, %"].loc[name]


def test_nothing_knows_an_independent_factor() -> None:
    known, modulus = study("factor 10 %")
    # 80 specimens; the correlation of four random ranks scatters by 1 / sqrt(3): 0.065 in the mean; 4 of it.
    assert known[["P", "std. error", "unlevel"]].abs().max() < 0.26
    # Half the error of one touch; over 8 seeds an rms error scatters by 25 %, the same touches are in both.
    assert modulus["mean"] < 0.8 * modulus["covariance"]
    assert modulus["level"] == pytest.approx(modulus["mean"], rel=0.05)


def test_the_fit_knows_a_tilt_and_smallest_p_some_of_it() -> None:
    known, modulus = study("tilt, trembling")
    assert known["unlevel"] > 0.7
    assert 0.05 < known["P"] < 0.6
    assert modulus["level"] < 0.7 * modulus[["mean", "covariance"]].min()


def test_on_a_stage_the_scatter_is_gone() -> None:
    assert study("stage")[0]["error, %"] < 0.05
    # Gauges with the same curve: on the stage, too, the ratio differs from the quotient of the forces.
    ratio = PROBE.ratio(SORBOTHANE_MPA["40 A"])
    assert level_ratio(STAGE, ratio) == level_ratio(FREE, ratio) > 1.03 * ratio
