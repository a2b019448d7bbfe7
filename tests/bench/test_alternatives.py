"""The bench of the alternatives: the libraries agree, and the page has the table that it prints."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.accuracy import alternatives
from bench.accuracy.alternatives import Figures

SEEDS = 40  # of the table of the page
COVARIANCE_FORM = 1e-4
"""padasip subtracts covariances near 1e12, so it keeps 16 - 12 digits of the first ones."""
OF_PALPATE = [name for name in alternatives.estimators() if name.startswith("palpate")]


def test_every_library_is_least_squares_with_the_same_forgetting() -> None:
    """So the table compares run times of one method, not settings; P0 is far from any sample."""
    signals = alternatives.two_signals(1, step=alternatives.STEP)
    ratio, _ = alternatives.plain_rls(signals.output, signals.regressor)
    for name, estimate in alternatives.estimators().items():
        if name not in OF_PALPATE:
            other, error = estimate(signals.output, signals.regressor)
            np.testing.assert_allclose(other[10:], ratio[10:], rtol=COVARIANCE_FORM, err_msg=name)
            assert error is None


@pytest.mark.parametrize("name", OF_PALPATE)
def test_the_page_has_the_errors_that_the_bench_prints(name: str) -> None:
    figures = alternatives.figures_of(alternatives.estimators()[name], SEEDS)
    row = alternatives.table({name: figures}).splitlines()[-1]
    without_time = row.rsplit("|", 2)[0]
    assert without_time in alternatives.PAGE.read_text(encoding="utf-8")


def test_each_figure_is_of_the_ratio() -> None:
    signals = alternatives.two_signals(1, step=alternatives.STEP)
    assert alternatives.delay_of(signals.ratio, signals) == 0
    late = signals.ratio.copy()
    late[alternatives.STEP_AT : alternatives.STEP_AT + 7] = alternatives.RATIO
    assert alternatives.delay_of(late, signals) == 7
    assert alternatives.rms_error(1.02 * signals.ratio, signals) == pytest.approx(2.0)
    assert alternatives.share_covered(late, 0.1 * late, signals) == 100.0
    assert math.isnan(alternatives.share_covered(late, None, signals))


def test_times_have_two_digits_and_no_exponent() -> None:
    figures = Figures(0.0321, 4, 0.0311, 97.4, 14321.0)
    row = "| x | 0.032 | 4 | 0.031 | 97 | 14,000 |"
    assert alternatives.table({"x": figures}).splitlines()[-1] == row
    bare = replace(figures, covered=math.nan, sample_ns=9.8)
    assert alternatives.table({"x": bare}).endswith("| no error bar | 10 |")
