"""What is judged of the readings is on the page: as an event, once, and as the line while it lasts."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from faulty_tables import (
    END_PF,
    JUMP_PF,
    JUMP_S,
    PRESSES_S,
    at_the_lower_end,
    falling,
    healthy,
    jumped,
    saturated,
)
from live_bench import Played
from live_browser import Browser
from live_server import Live
from palpate.live.annotations import Annotations
from palpate.live.commands import FileWorkbench
from palpate.live.file_review import RecordedMeasurement
from palpate.live.judged import NEWS_S
from palpate.live.protocol import ShownJudgement, StatusState
from recording_bench import soon


def played(path: Path, **settings: Any) -> tuple[Played, list[ShownJudgement]]:
    """Play a table; return the measurement, and the judgements that its page has."""
    measurement = Played(str(path), **settings)
    events = Annotations(measurement)
    measurement.play()
    return measurement, events.document().judgements


def lines(measurement: Played, what: str) -> list[tuple[float, StatusState]]:
    """Return when a line was told, and the states."""
    return [(at_s, one) for at_s, one in measurement.told if one.line.what == what]


def test_a_jump_is_an_event_and_for_a_while_the_line(tmp_path: Path) -> None:
    measurement, judged = played(jumped(tmp_path))
    [jump] = judged
    assert (jump.channel, jump.name) == ("hard", "jumped")
    assert jump.t_s == pytest.approx(JUMP_S, abs=0.1)
    assert f"jumped by +{JUMP_PF} pF" in jump.text
    told = lines(measurement, "news")
    assert told[0][1].line.text == f"T{jump.text[1:]}."
    assert told[-1][0] - told[0][0] == pytest.approx(NEWS_S, abs=0.3)
    assert len(measurement.touches) == 4


def test_a_channel_at_the_end_of_its_range_is_said_while_it_is_there(tmp_path: Path) -> None:
    measurement, judged = played(saturated(tmp_path))
    assert [each.name for each in judged] == ["saturated"] * len(PRESSES_S)
    for at_s, state in lines(measurement, "at its end"):
        assert any(begin_s < at_s < begin_s + 7 for begin_s in PRESSES_S)
        assert f"end of its range, {END_PF} pF" in state.line.text
        assert (state.now.word, state.line.level) == ("Repeat", "caution")
    assert len(lines(measurement, "at its end")) > 4 * 5


def test_a_channel_that_is_always_at_its_end_is_a_fault(tmp_path: Path) -> None:
    measurement, judged = played(at_the_lower_end(tmp_path))
    assert [each.channel for each in judged] == ["hard", "soft"]
    at_s, state = measurement.first("at its end")
    assert at_s < 1.0
    assert (state.now.word, state.line.level) == ("Stop", "fault")
    assert "The soft channel is at the end of its range" in state.line.text
    assert not lines(measurement, "constant")


def test_a_probe_that_falls_is_said_until_a_tare(tmp_path: Path) -> None:
    path = falling(tmp_path)
    measurement, judged = played(path)
    assert [each.name for each in judged] == ["falling"]
    told = lines(measurement, "falling")
    assert told[-1][0] > 39.0
    assert told[0][1].line.text.startswith("Both channels fall when pressed")
    measurement = Played(str(path))
    measurement.play(at={25.0: lambda _: measurement.tares.append(25.0)})
    assert lines(measurement, "falling")[-1][0] < 25.3


def test_the_option_that_makes_it_right_is_in_the_head(tmp_path: Path) -> None:
    measurement, judged = played(falling(tmp_path), falling=True, baseline=(-1.5, -1.8))
    assert judged == []
    table = measurement.page_state._table
    assert table.hello("").stated == ["falling", "baseline given, -1.5 and -1.8 pF"]
    assert played(healthy(tmp_path))[0].page_state._table.hello("").stated == []


@pytest.mark.parametrize("made", [jumped, saturated, falling, healthy])
def test_a_recording_has_those_of_its_measurement(
    made: Callable[[Path], Path], tmp_path: Path
) -> None:
    path = made(tmp_path)
    measurement = RecordedMeasurement(str(path), {}, {})
    bench = FileWorkbench(measurement, str(path))
    measurement.start()
    soon(lambda: not measurement.running)
    measurement.close()
    assert bench.annotations.document().judgements == played(path)[1]


def test_the_page_lists_them_with_their_time(page: Browser, tmp_path: Path) -> None:
    with Live("--falling", source=str(jumped(tmp_path))) as server:
        page.driver.get(f"{server.address}#lab")
        page.until(lambda: page.all("#marks li"))
        assert page.text("source").endswith("handheld · falling")
        entries = [entry.text for entry in page.all("#marks li")]
    assert entries[0] == "00:19\n▲ the hard channel jumped by +1.1 pF at 19.9 s"
    assert page.complaints() == []
