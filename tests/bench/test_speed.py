"""The benches of speed run, and docs/numbers.md shows what they wrote. No time is tested: the machine is shared."""

import json
from pathlib import Path

import pytest
from palpate.ad7746.registers import CONVERSION_S
from project import ROOT, need_package

from bench.results_age import RESULTS
from bench.speed import __main__ as speed
from bench.speed import calls, files, latency

PAGE = ROOT / "docs" / "numbers.md"


def test_calls_are_timed_and_judged() -> None:
    """native.cpp runs in `python -m bench.speed` only; `.ci/checks analyse` compiles it."""
    found = calls.measure_python(1)
    figures = json.loads((RESULTS / "speed.json").read_text()) | found
    assert all(0 < row["min"] <= row["median"] for row in found.values())
    errors = [row["error"] for row in found.values() if "error" in row]
    assert len(errors) >= 8
    assert all(0 < error < 1e-4 for error in errors), found
    assert json.loads(speed.summary(figures))["AdaptiveRls"] == figures["AdaptiveRls"]
    assert "not measured" not in speed.limits(figures)
    assert speed.replace_table(
        f"a\n{speed.MARK}\nold\n{speed.END}\nb", speed.MARK, "new"
    ).split() == (f"a {speed.MARK} new {speed.END} b".split())


def test_the_page_shows_the_last_results() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert speed.short_table(json.loads((RESULTS / "speed.json").read_text())) in page
    assert latency.table(json.loads((RESULTS / "latency.json").read_text())) in page


def test_files_are_timed_and_their_touches_are_equal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    need_package("pandas")
    files.rows_of_a_file(tmp_path, 5000, 1)
    files.many(tmp_path, 2)
    shown = capsys.readouterr().out
    assert all(
        name in shown for name in ("palpate.read", "through a stream, recorded", "2 files, jobs=")
    )


def test_the_stages_of_the_latency_are_complete_and_add_up() -> None:
    ages, together = latency.live_ages("stiff-steady", pairs=40, seed=1, real_time=False)
    assert list(ages) == list(latency.STAGES)
    assert len(together) >= 40 - latency.LAG
    # Each stage is a difference of two integers, ns: rounded once to ms, as their sum is.
    assert sum(ages.values()) == pytest.approx(together, rel=1e-12)
    assert all((times >= 0).all() for times in ages.values())
    # On the simulated chip a conversion takes its nominal time; the other stages are at least what they contain.
    assert ages["conversion"] == pytest.approx(1e3 * CONVERSION_S[0] / 2, rel=1e-9)
    assert (ages["second channel"] > 1e3 * CONVERSION_S[0]).all()
    assert (ages["alignment"] > 2e3 * CONVERSION_S[0]).all()


def test_the_ratio_is_of_the_pair_before_those_that_the_screen_waits_for() -> None:
    assert latency.alignment_pairs() == latency.LAG


def test_a_press_is_found_with_as_few_pairs_as_the_gate_allows() -> None:
    """4 values of at most 6 - 1.5 standard deviations reach the limit of 16; the first one may be too small.

    Two more are those for which a reading waits in the screen.
    """
    pairs, times = latency.gate("stiff-steady", 4)
    assert set(pairs) <= {6, 7}
    assert ((times > 26 * 5) & (times < 26 * 7)).all()
