"""The touches of a report: with which settings, on which specimen, and which of them are kept."""

from dataclasses import replace
from pathlib import Path

import palpate
import pytest
from palpate import Calibration, number_format, report
from palpate.report.findings import AnalysedRecording, analyse_recording, assigned
from palpate.report.recording_facts import RecordingFacts
from project import FOUR, copied, made_once
from report_session import recorded

AGE_S = 0.8


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "report", recorded)


@pytest.fixture(scope="module")
def session(folder: Path) -> AnalysedRecording:
    return analyse_recording(folder / "session.csv", "session.csv")


def test_a_calibration_of_another_age_measures_the_touches_again(
    folder: Path, tmp_path: Path
) -> None:
    aged = replace(Calibration.load(folder / "probe.toml"), age_s=AGE_S)
    aged.save(tmp_path / "aged.toml")
    gel = folder / "gel" / "gel.csv"
    made = report.write_report(
        tmp_path / "r.html", [gel], report.ReportOptions(tmp_path / "aged.toml")
    )
    assert made.results["kept"] == 4
    expected = aged.agreement(palpate.touches(palpate.read(gel), age=AGE_S))
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert number_format.number(expected.ratio, expected.standard_error) in page


def test_the_session_names_the_specimens_before_the_file_does(
    folder: Path, session: AnalysedRecording, tmp_path: Path
) -> None:
    touches = list(assigned(session, {"30 OO": 0.143, "session": 1.0}))
    assert [each.specimen for each in touches] == ["30 OO", "30 OO", "gel", ""]
    assert [each.left_out for each in touches] == ["", "discarded", "", ""]
    unnamed = analyse_recording(copied(tmp_path / "30oo-2.csv", FOUR), "x")
    assert {each.specimen for each in assigned(unnamed, {"30 OO": 0.143})} == {"30 OO"}


def test_events_are_in_order_of_time(session: AnalysedRecording) -> None:
    events = RecordingFacts(session).events
    assert [event.kind for event in events] == ["note", "mark", "note", "tare", "gap"]
    times = [event.t_s for event in events[1:]]
    assert times == sorted(times)


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(ValueError, match="unit: got 'psi'"):
        report.ReportOptions(unit="psi")
