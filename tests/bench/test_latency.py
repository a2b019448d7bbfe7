"""The stages of the latency are complete and add up; those that do not depend on the machine have their values."""

import json
from pathlib import Path

import numpy as np
import pytest
from palpate.ad7746.datasheet import CONVERSION_S
from palpate.pair_filter import matched_pair
from project import ROOT

from bench.speed import latency
from bench.speed.live_ages import STAGES, board_ages, live_ages


def test_the_stages_are_complete_and_add_up() -> None:
    ages, together = live_ages("stiff-steady", pairs=40, seed=1)
    assert list(ages) == list(STAGES)
    assert 5 < len(together) <= 39  # a busy computer loses pairs
    # Each stage is a difference of two integers, ns: rounded once to ms, as their sum is.
    assert sum(ages.values()) == pytest.approx(together, rel=1e-12)
    assert all((times >= 0).all() for times in ages.values())
    # On the simulated chip a conversion takes its nominal time; the other stages are at least what they contain.
    assert ages["conversion"] == pytest.approx(1e3 * CONVERSION_S[0] / 2, rel=1e-9)
    assert (ages["second channel"] > 1e3 * CONVERSION_S[0]).all()
    assert (ages["alignment"] > 2e3 * CONVERSION_S[0]).all()
    assert (ages["bus"] > 0).all()


def test_the_times_of_the_board_do_not_depend_on_the_machine() -> None:
    one, other = (board_ages("stiff-steady", pairs=20, seed=1) for _ in range(2))
    assert list(one) == list(STAGES)[:4]
    assert all((one[name] == other[name]).all() for name in one)
    conversion = 1e3 * CONVERSION_S[0]
    assert one["conversion"] == pytest.approx(conversion / 2, rel=1e-9)
    # Between two conversions the bus at 85 kHz and its transfers take 4.6 ms.
    assert (np.abs(one["second channel"] - conversion - 4.6) < 0.3).all()
    assert (np.abs(one["alignment"] - 2 * (conversion + 4.6)) < 0.5).all()
    assert (one["bus"] < 3).all()


def test_the_ratio_is_that_of_the_pair_before() -> None:
    assert latency.alignment_pairs() == 1.0
    # To the hard reading of the last pair, and from there to its soft one, half a period later.
    assert matched_pair(0.026).delay_s == pytest.approx(1.5 * 0.026)


def test_a_press_is_found_with_as_few_pairs_as_the_gate_allows() -> None:
    """4 values of at most 6 - 1.5 standard deviations reach the limit of 16; the first one may be too small."""
    pairs, times = latency.gate("stiff-steady", 4)
    assert pairs.min() == 4
    assert pairs.max() <= 5
    assert (times > 26 * 3).all()
    assert (times < 26 * 5).all()
    light, _ = latency.gate("light-touch", 4)
    assert light.min() > 5


def test_it_prints_and_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "latency.json"
    monkeypatch.setattr("sys.argv", ["latency", "--pairs", "5", "--touches", "1", "--out", str(out)])
    latency.main()
    found = json.loads(out.read_text())
    assert list(found["stages"]) == list(STAGES)
    assert capsys.readouterr().out.endswith(latency.table(found) + "\n")


def test_the_page_shows_the_last_results() -> None:
    found = json.loads(latency.RESULTS.read_text())
    assert latency.table(found) in (ROOT / "docs" / "speed.md").read_text(encoding="utf-8")
