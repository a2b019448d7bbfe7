"""Files of a run: names that are proposed and checked, reports, and how they are sent to a browser."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from live_bench import OWN_FILE, begun, client, done
from palpate.live import run_files as module
from palpate.live.app import READ_ONLY
from palpate.live.page_commands import SettingsCommand
from palpate.live.protocol import RefusedCommand
from palpate.live.run_files import RunFiles
from palpate.report import ReportOptions


class Sunday(module.date):  # type: ignore[name-defined,misc]
    @classmethod
    def today(cls) -> "Sunday":
        return cls(2026, 11, 22)


@pytest.fixture
def named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RunFiles:
    monkeypatch.setattr(module, "date", Sunday)
    return RunFiles(folder=tmp_path)


def test_names_are_proposed_by_date(named: RunFiles, tmp_path: Path) -> None:
    (tmp_path / "palpate-2026-11-22-2.json").touch()  # half of another recording
    assert named.made(named.next(), "recording") == tmp_path / "palpate-2026-11-22-1.csv"
    assert named.next() == named.next() == tmp_path / "palpate-2026-11-22-3.csv"
    assert named.next("30 OO_a.1-b.csv") == tmp_path / "30 OO_a.1-b.csv"
    files = RunFiles(tmp_path / "run.csv")
    assert [files.made(files.next(), "recording").name for _ in range(2)] == [
        "run.csv",
        "run-2.csv",
    ]
    assert [file.name for file in files.named] == [
        "run.csv",
        "run.json",
        "run-2.csv",
        "run-2.json",
    ]
    (tmp_path / "other.csv").touch()
    assert [files.find(name) for name in ("run.json", "other.csv", "../run.csv")] == [
        tmp_path / "run.json",
        None,
        None,
    ]


@pytest.mark.parametrize(
    "name",
    ["", "../run.csv", "a\\b.csv", "/run.csv", "run.json", "run.csv\n", ".run.csv", "-run.csv", "r\0.csv", "C:run.csv", "x" * 97 + ".csv"],
)  # fmt: skip
def test_a_name_that_could_be_another_place_is_refused(name: str, named: RunFiles) -> None:
    with pytest.raises(ValueError, match=r"name: got .*, allowed: at most 100 of A-Z"):
        named.next(name)
    assert named.named == []


@pytest.mark.parametrize("there", ["run.csv", "run.json"])
def test_nothing_is_overwritten(there: str, named: RunFiles, tmp_path: Path) -> None:
    (tmp_path / there).touch()
    with pytest.raises(
        ValueError, match=r"'run\.csv', and there is such a file; choose another name"
    ):
        named.next("run.csv")
    (tmp_path / "probe.toml").touch()
    assert named.free("probe.toml") == tmp_path / "probe-2.toml"
    assert named.made(named.free("gel.toml"), "calibration") == tmp_path / "gel.toml"
    assert named.free("gel.toml") == tmp_path / "gel-2.toml"


def test_a_report_of_the_newest_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside it, under a new name; one at a time."""
    asked: list[tuple[Path, list[Path], object]] = []

    def write(
        path: Path,
        recordings: Sequence[Path],
        options: ReportOptions,
        progress: Callable[[str], None],
    ) -> None:
        assert options.unit == "kPa"
        asked.append((path, list(recordings), options.calibration))
        path.write_text("<p>gel</p>")
        with pytest.raises(RefusedCommand, match="one is being written"):
            files.report()
        progress("touch 1 of 4")
        assert files.progress == "Report: touch 1 of 4"

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    files = RunFiles(tmp_path / "run.csv")
    with pytest.raises(RefusedCommand, match="report: nothing is recorded yet"):
        files.report()
    for name in ("one.csv", "two.csv"):
        files.made(files.next(name), "recording")
    monkeypatch.setattr(module, "write_report", full)
    with pytest.raises(RefusedCommand, match=r"report: cannot be written: No space left on device"):
        files.report()
    monkeypatch.setattr(module, "write_report", write)
    files.calibration = tmp_path / "probe.toml"
    files.use_settings(SettingsCommand(unit="kPa"))
    (tmp_path / "two-report-2.html").write_text("precious")
    names = [files.report() for _ in range(2)]
    assert names == ["two-report.html", "two-report-3.html"]
    assert (tmp_path / "two-report-2.html").read_text() == "precious"
    assert asked[0] == (
        tmp_path / "two-report.html",
        [tmp_path / "two.csv"],
        tmp_path / "probe.toml",
    )
    assert [file.name for file in files.named if file.kind == "report"] == names
    assert files.progress == ""


def test_a_report_that_is_stopped_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In each of its parts: while rows are read, and while touches are written."""
    files, told = RunFiles(), list[str]()
    files.made(OWN_FILE, "recording")
    monkeypatch.setattr(files, "free", lambda name: tmp_path / name)
    tell = files._show_progress
    for part in ("rows read", "touch 2 of 4"):

        def stop(progress: str, part: str = part) -> None:
            told.append(progress)
            if part in progress:
                files.stop_report()
            tell(progress)

        monkeypatch.setattr(files, "_show_progress", stop)
        with pytest.raises(RefusedCommand, match="report: stopped; nothing is written"):
            files.report()
        assert part in told[-1]
    assert list(tmp_path.iterdir()) == []


def test_a_browser_shows_a_report_and_runs_nothing_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = begun(f"{OWN_FILE}?speed=100", tmp_path)
    monkeypatch.setattr(
        module, "write_report", lambda path, *_, progress: path.write_text("<p>gel</p>")
    )
    name = done(bench, "report").file
    assert isinstance(name, str)
    for beside in ("probe.toml", "odd.bin"):
        (tmp_path / beside).write_text("x")
        bench.measurement.files.made(tmp_path / beside, "calibration")
    page = client(bench)
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
        assert got.headers["content-type"] == "application/octet-stream"
        assert got.content == (tmp_path / file).read_bytes()[: len(got.content)]
        assert got.headers["x-content-type-options"] == "nosniff"
    bench.measurement.close()
