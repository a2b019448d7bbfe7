"""The touches of a report: with which settings, on which specimen, and which of them are kept."""

import math
from dataclasses import replace
from pathlib import Path

import palpate
import pytest
from palpate import Calibration, number_format, report
from palpate.materials import KnownModulus
from palpate.recording.session import Entry, Plan
from palpate.report.findings import AnalysedRecording, analyse_recording, assigned, findings
from palpate.report.recording_facts import RecordingFacts
from project import FOUR, copied, made_once
from report_session import change, recorded, softened

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


def test_four_objects_under_the_name_of_a_file_have_no_repeatability(tmp_path: Path) -> None:
    """Nor is their scatter the one of the session."""
    run = analyse_recording(copied(tmp_path / "four.csv", FOUR), "four.csv")
    found = findings([run], None, {})
    [result] = found.results
    assert (result.is_named, result.is_one_object) == (False, False)
    assert math.isnan(result.variation)
    assert found.repeatability() is None
    assert (found.scatter.source, found.scatter.share) == ("assumed", 0.03)
    report.write_report(tmp_path / "r.html", [run.recording.path])
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "four: no repeatability, as its touches differ, and only the name of the file" in page
    assert "From touch to touch (CV)" not in page


def test_touches_on_a_named_specimen_count_although_they_differ(tmp_path: Path) -> None:
    path = copied(tmp_path / "four.csv", FOUR)
    touches = palpate.touches(palpate.read(path))
    plan = Plan(touches=tuple(Entry(touch.start_s, "gel") for touch in touches))
    change(path, {"session": plan.as_dict()})
    by_session = findings([analyse_recording(path, "x")], None, {})
    by_table = findings(
        [analyse_recording(copied(tmp_path / "30oo.csv", FOUR), "x")],
        None,
        {"30 OO": KnownModulus(0.143)},
    )
    for found in (by_session, by_table):
        [result] = found.results
        assert (result.is_named, result.is_one_object) == (True, True)
        assert result.variation == pytest.approx(0.71, abs=0.01)
        assert found.repeatability() is not None
    report.write_report(tmp_path / "r.html", [path])
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "gel: its touches differ, and count here because the session" in page


def test_a_trend_is_in_the_report(tmp_path: Path) -> None:
    path = softened(tmp_path)
    [result] = findings([analyse_recording(path, "x")], None, {}).results
    assert result.mean is not None
    assert result.mean.trend is not None
    assert result.mean.trend.change == pytest.approx(-0.071, abs=0.003)
    report.write_report(tmp_path / "r.html", [path])
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert f"gel: {result.mean.trend_text}." in page
    assert "the object softens, or the probe drifts" in page
