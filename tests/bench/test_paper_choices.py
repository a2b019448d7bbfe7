"""What the settings of the paper's algorithm change: the bench's table is that of the page, and says what the page says."""

import re

import pytest
from project import ROOT

from bench.accuracy import paper_choices
from bench.accuracy.paper_choices import Row, Settings

PAGE = ROOT / "docs" / "paper.md"
SEEDS = 40  # those of the page


@pytest.fixture(scope="module")
def groups() -> list[list[Row]]:
    measured = paper_choices.measure(SEEDS)
    return [[measured(settings) for settings in group] for group in paper_choices.choices()]


def of(groups: list[list[Row]], **settings: float) -> Row:
    [row, *_] = [row for group in groups for row in group if row.settings == settings]
    return row


def test_the_page_shows_what_the_bench_prints(groups: list[list[Row]]) -> None:
    [shown] = re.findall(r"^```text\n(error %.*?)^```$", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert shown == paper_choices.table(groups) + "\n", "paste what python -m bench.accuracy.paper_choices prints"


@pytest.mark.parametrize("more", [{}, {"threshold": 0.2}, {"drift": 0.02}])
def test_an_alarm_that_is_cleared_at_0_lasts_longer(groups: list[list[Row]], more: Settings) -> None:
    late = of(groups, **more).scenarios
    early = of(groups, **more, clear_level=more.get("threshold", paper_choices.THRESHOLD)).scenarios
    assert all(late[name].alarm >= early[name].alarm for name in late)
    assert late["step-up"].rmse < early["step-up"].rmse
    assert late["slow-drift"].rmse < early["slow-drift"].rmse
    assert late["light-touch"] == early["light-touch"]


def test_a_small_initial_covariance_keeps_a_light_touch_near_1(groups: list[list[Row]]) -> None:
    errors = {p: of(groups, initial_covariance=p).scenarios["light-touch"].rmse for p in (1e4, 1e8)}
    default = of(groups).scenarios["light-touch"].rmse
    assert errors[1e4] > 10 * default
    assert errors[1e8] == pytest.approx(default, rel=0.02)


def test_without_contact_only_a_small_bound_keeps_the_ratio(groups: list[list[Row]]) -> None:
    assert of(groups).wander > 2
    assert of(groups, initial_covariance=1e6, max_covariance=1e6).wander > 2
    assert of(groups, initial_covariance=1e3, max_covariance=1e3).wander < 0.1


def test_no_drift_is_best_for_all(groups: list[list[Row]]) -> None:
    rows = {d: of(groups, drift=d).scenarios for d in (0.005, 0.02, 0.05)}
    best = {name: min(rows, key=lambda d: rows[d][name].rmse) for name in ("step-up", "tremor", "stiff-steady")}
    assert best == {"step-up": 0.005, "tremor": 0.02, "stiff-steady": 0.05}
