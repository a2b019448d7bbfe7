"""`palpate import`: shows, asks, remembers."""

import json
import re
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from click.testing import CliRunner, Result
from foreign_files import RATIOS, measurement  # tests/tools
from palpate.cli import import_, main
from palpate.cli.config import NAME


def run(*arguments: Any, **kwargs: Any) -> Result:
    return CliRunner().invoke(main, [str(each) for each in arguments], **kwargs)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    rows = [f"{t:.4f};{1e3 * h:.3f};{1e3 * s:.3f}" for t, h, s in zip(*measurement(), strict=True)]
    Path("other.csv").write_text("t (s);A;B\n" + "\n".join(rows) + "\n")
    return tmp_path


def test_what_is_open_is_an_error_without_a_terminal(here: Path) -> None:
    result = run("import", "other.csv")
    assert result.exit_code == 2
    assert "    2  A      6900." in result.stdout
    assert "columns: got none" in result.stderr
    assert "unit: got none" in run("import", "other.csv", "--map", "hard=2,soft=3").stderr
    assert not Path(NAME).exists()


def test_answers_are_remembered_and_told(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_, "_may_ask", lambda: True)
    Path(NAME).write_text("# mine\n[replay]\nscene = 'handheld'")
    result = run("import", "other.csv", input="A\nQ\nA\nB\nff\nfF\ny\n")
    assert "got 'Q', allowed: 1 (t (s)), 2 (A), 3 (B)" in result.stderr
    assert "unit: got 'ff', allowed: aF" in result.stderr
    assert result.exit_code == 0, result.stderr
    assert "time = t, s; hard = A, fF; soft = B, fF; 38.4 pairs a second; 880 rows" in result.stdout
    assert "2 touches: ratio 2.0" in result.stdout
    text = Path(NAME).read_text()
    assert text.startswith("# mine\n[replay]\nscene = 'handheld'\n\n[[import.logger]]\n")
    replayed = run("replay", "other.csv", "--json")
    assert replayed.exit_code == 0, replayed.stderr
    document = json.loads(replayed.stdout)
    assert [touch["ratio"] for touch in document["touches"]] == pytest.approx(RATIOS, rel=1e-3)
    assert "read as remembered in palpate.toml for tables with the columns t (s), A, B" in document["notes"][0]
    for command in (["check"], ["convert", "-o", "own.csv"], ["record", "-o", "again.csv"]):
        result = run(*command, "other.csv")
        assert result.exit_code in (0, 5), result.stderr
        assert "remembered" in result.stdout + result.stderr, command
    assert "remembered" not in run("replay", "other.csv", "--map", "hard=3,soft=2", "--unit", "fF").stderr
    assert "remembered" not in run("import", "other.csv", input="").stderr  # nothing is asked a second time


def test_no_is_no(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_, "_may_ask", lambda: True)
    assert run("import", "other.csv", "--unit", "fF", input="A\nB\nn\n").exit_code == 0
    assert not Path(NAME).exists()


def test_the_last_answer_holds(here: Path) -> None:
    for wanted in ("hard=3,soft=2", "hard=A,soft=B"):
        assert run("import", "other.csv", "--map", wanted, "--unit", "fF", "--remember").exit_code == 0
    assert "hard = A" in run("replay", "other.csv").stderr


def test_a_table_without_names_is_not_remembered(here: Path) -> None:
    Path("bare.csv").write_text("\n".join(Path("other.csv").read_text().splitlines()[1:]) + "\n")
    result = run("import", "bare.csv", "--map", "hard=2,soft=3,time=1", "--unit", "fF", "--remember")
    assert (result.exit_code, "without names of columns" in result.stderr) == (2, True)


def test_a_recording_of_palpate_is_none(here: Path) -> None:
    assert run("convert", "other.csv", "--map", "hard=2,soft=3", "--unit", "fF", "-o", "own.csv").exit_code == 0
    assert run("import", "own.csv").exit_code == 2


def test_json(here: Path) -> None:
    result = run("import", "other.csv", "--map", "hard=2,soft=3", "--unit", "fF", "--json")
    document = json.loads(result.stdout)
    assert (document["columns"], document["rows"]) == (["t (s)", "A", "B"], 880)
    assert document["asked"] == {"columns": {"hard": "2", "soft": "3"}, "unit": "fF"}


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("[import]\nlogger = 3\n", r"logger: got 3"),
        ("[[import.logger]]\nmap = 'hard=1,soft=2'\n", "columns: got None, allowed: a list of names"),
        ("[[import.logger]]\ncolumns = ['a']\nunits = 'fF'\n", "got 'units', allowed: columns, map, unit"),
        ("[[import.logger]]\ncolumns = ['a']\nunit = 'ff'\n", "unit: got 'ff'"),
        ("[[import.logger]]\ncolumns = ['a']\nmap = 'soft=2'\n", "columns: got soft, allowed: hard, soft"),
        ("[[import.logger]]\ncolumns = ['a']\nrate = 50\n", "got 'rate', allowed: columns, map"),
        ("[import]\nlogger = ['x']\n", r"logger: got 'x', allowed: a table"),
    ],
)
def test_wrong_entries_are_refused(here: Path, entry: str, message: str) -> None:
    Path(NAME).write_text(entry)
    result = run("replay", "other.csv")
    assert result.exit_code == 2
    assert re.search(message, result.stderr), result.stderr


def test_what_is_asked_of_one_file_is_not_remembered(here: Path) -> None:
    Path("two.csv").write_bytes(Path("other.csv").read_bytes())
    asked = ["--map", "hard=A,soft=B", "--unit", "fF"]
    assert run("import", "other.csv", "--soft", "two.csv", "--rate", "38", *asked, "--remember").exit_code == 0
    assert "rate" not in Path(NAME).read_text()
    assert "soft = " not in Path(NAME).read_text()
    assert "remembered" in run("replay", "other.csv").stderr
    assert "remembered" in run("replay", "other.csv", "--soft", "two.csv").stderr


def test_the_sheet_is_asked_for(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    book = openpyxl.Workbook()
    for name in ("one", "two"):
        sheet = book.create_sheet(name)
        for row in (["t (s)", "C1 (pF)", "C2 (pF)"], *zip(*(each.tolist() for each in measurement()), strict=True)):
            sheet.append(list(row))
    del book["Sheet"]
    book.save("book.xlsx")
    assert "part: got none" in run("import", "book.xlsx").stderr
    monkeypatch.setattr(import_, "_may_ask", lambda: True)
    result = run("import", "book.xlsx", input="three\ntwo\n")
    assert result.exit_code == 0, result.stderr
    assert "part: got 'three'" in result.stderr
    assert "2 touches: ratio 2.0" in result.stdout
