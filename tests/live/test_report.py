"""The button Report, and how files of a run are sent to a browser."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from live_bench import begun, client
from palpate.live.desk.report import MOST, Report
from palpate.live.protocol import Command, Refused
from palpate.live.recordings import Recordings
from palpate.live.server import DOWNLOADED, READ_ONLY
from palpate.live.workbench import Workbench

_ASK = Command("report")


class Writing:
    """Notes what it is asked for, and writes a file."""

    def __init__(self) -> None:
        self.asked: list[tuple[Path, list[Path], Path | None]] = []

    def __call__(self, path: Path, recordings: Sequence[Path], calibration: Path | None) -> None:
        self.asked.append((path, list(recordings), calibration))
        path.write_text("<p>gel</p>")


def test_a_report_of_the_newest_recording(tmp_path: Path) -> None:
    recordings, writing = Recordings(None, tmp_path), Writing()
    report = Report(recordings, writing, lambda: tmp_path / "probe.toml")
    with pytest.raises(Refused, match="report: nothing is recorded yet"):
        report.orders["report"](_ASK)
    recordings.next("one.csv")
    recordings.next("two.csv")
    assert report.orders["report"](_ASK)["file"] == "two-report.html"
    assert report.orders["report"](_ASK)["file"] == "two-report-2.html"
    assert writing.asked[0] == (tmp_path / "two-report.html", [tmp_path / "two.csv"], tmp_path / "probe.toml")
    assert {"name": "two-report.html", "kind": "report"} in recordings.files


def test_a_report_overwrites_nothing_and_not_too_many(tmp_path: Path) -> None:
    recordings, writing = Recordings(tmp_path / "run.csv"), Writing()
    recordings.next()
    report = Report(recordings, writing, lambda: None)
    (tmp_path / "run-report.html").write_text("precious")
    for _ in range(MOST - 1):
        report.orders["report"](_ASK)
    with pytest.raises(Refused, match=f"got {MOST} reports of run.csv"):
        report.orders["report"](_ASK)
    assert (tmp_path / "run-report.html").read_text() == "precious"


def test_a_report_that_cannot_be_written_is_told_and_another_one_may_be(tmp_path: Path) -> None:
    def full(path: Path, *_: object) -> None:
        raise OSError(28, "No space left on device")

    recordings = Recordings(tmp_path / "run.csv")
    recordings.next()
    report = Report(recordings, full, lambda: None)
    for _ in range(2):
        with pytest.raises(Refused, match=r"report: cannot be written: No space left on device"):
            report.orders["report"](_ASK)
    assert all(file["kind"] != "report" for file in recordings.files)


def test_one_report_at_a_time(tmp_path: Path) -> None:
    def again(path: Path, *_: object) -> None:
        with pytest.raises(Refused, match="one is being written"):
            report.orders["report"](_ASK)

    recordings = Recordings(tmp_path / "run.csv")
    recordings.next()
    report = Report(recordings, again, lambda: None)
    report.orders["report"](_ASK)


def test_a_browser_shows_a_report_and_runs_nothing_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = begun(tmp_path, speed=None)
    monkeypatch.setattr("palpate.live.desk.measuring.write", Writing())
    name = Workbench(session, "").do(_ASK)["file"]
    for beside in ("probe.toml", "odd.bin"):
        (tmp_path / beside).write_text("x")
        session.recordings.made(tmp_path / beside, "calibration")
    page = client(session)
    got = page.get(f"/recording/{name}")
    assert got.text == "<p>gel</p>"
    assert got.headers["content-type"] == "text/html; charset=utf-8"
    assert got.headers.get_list("content-security-policy") == [READ_ONLY]
    assert READ_ONLY.startswith("sandbox; default-src 'none'; ")
    assert "script" not in READ_ONLY
    assert got.headers["content-disposition"].startswith("inline")
    for file in ("run.csv", "run.json", "probe.toml", "odd.bin"):
        got = page.get(f"/recording/{file}")
        assert got.headers["content-disposition"].startswith("attachment")
        kind = DOWNLOADED.get(Path(file).suffix, ("application/octet-stream",))[0]
        assert got.headers["content-type"].partition(";")[0] == kind
        [policy] = got.headers.get_list("content-security-policy")
        assert "script-src 'self'" in policy
        assert got.headers["x-content-type-options"] == "nosniff"
    session.close()
