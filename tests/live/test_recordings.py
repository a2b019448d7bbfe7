"""Names of the files of a run: proposed by date, checked, and never those of other files."""

from pathlib import Path

import pytest
from palpate.live import recordings as module
from palpate.live.recordings import Recordings


class Sunday(module.date):  # type: ignore[name-defined,misc]
    @classmethod
    def today(cls) -> "Sunday":
        return cls(2026, 11, 22)


@pytest.fixture
def named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Recordings:
    monkeypatch.setattr(module, "date", Sunday)
    return Recordings(folder=tmp_path)


def test_names_are_proposed_by_date(named: Recordings, tmp_path: Path) -> None:
    (tmp_path / "palpate-2026-11-22-2.json").touch()  # half of another recording
    assert named.proposed == named.proposed == "palpate-2026-11-22-1.csv"
    first, second = named.next(), named.next()
    assert [first, second] == [tmp_path / "palpate-2026-11-22-1.csv", tmp_path / "palpate-2026-11-22-3.csv"]
    named.forget(second)
    assert named.proposed == second.name


def test_a_name_of_the_page_is_in_the_folder(named: Recordings, tmp_path: Path) -> None:
    assert named.next("30 OO_a.1-b.csv") == tmp_path / "30 OO_a.1-b.csv"
    assert named.proposed == "palpate-2026-11-22-1.csv"


@pytest.mark.parametrize(
    "name",
    ["", ".csv", "../run.csv", "a/b.csv", "a\\b.csv", "/run.csv", "run", "run.json", "run.csv\n", ".run.csv", "-run.csv", "r\0.csv",
     "ü.csv", "~/run.csv", "C:run.csv", "x" * 97 + ".csv", "run.CSV"],
)  # fmt: skip
def test_a_name_that_could_be_another_place_is_refused(name: str, named: Recordings) -> None:
    with pytest.raises(ValueError, match=r"record: got the name .*, allowed: at most 100 of A-Z"):
        named.next(name)
    assert named.files == []


@pytest.mark.parametrize("there", ["run.csv", "run.json"])
def test_nothing_is_overwritten(there: str, named: Recordings, tmp_path: Path) -> None:
    (tmp_path / there).touch()
    with pytest.raises(ValueError, match=r"'run\.csv', and there is such a file; choose another name"):
        named.next("run.csv")


def test_a_name_is_given_once(named: Recordings) -> None:
    named.next("run.csv")
    with pytest.raises(ValueError, match="there is such a file"):
        named.next("run.csv")


def test_files_of_every_kind_are_found_by_name_and_no_others(named: Recordings, tmp_path: Path) -> None:
    (tmp_path / "other.csv").touch()
    run = named.next("run.csv")
    probe, report = (
        named.made(tmp_path / "probe.toml", "calibration"),
        named.made(tmp_path / "run-report.html", "report"),
    )
    assert named.files == [
        {"name": "run.csv", "kind": "recording"},
        {"name": "run.json", "kind": "settings"},
        {"name": "probe.toml", "kind": "calibration"},
        {"name": "run-report.html", "kind": "report"},
    ]
    assert [named.find(name) for name in ("run.csv", "probe.toml", "run-report.html")] == [run, probe, report]
    assert [named.find(name) for name in ("other.csv", "../run.csv", str(run), "")] == [None] * 4


def test_the_name_of_the_user_comes_first(tmp_path: Path) -> None:
    recordings = Recordings(tmp_path / "run.csv")
    assert [recordings.next().name, recordings.next().name, recordings.proposed] == [
        "run.csv",
        "run-2.csv",
        "run-3.csv",
    ]
    with pytest.raises(ValueError, match="a name that ends in"):
        Recordings("run.txt")
