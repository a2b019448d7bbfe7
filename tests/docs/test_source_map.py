"""The map of the source: each row of each of its tables names files that are there, and names that are in them."""

import re
from pathlib import Path
from typing import NamedTuple

import pytest
from project import ROOT

PAGE = (ROOT / "docs" / "source.md").read_text(encoding="utf-8")
QUESTIONS = "## Questions"
MOST_FILES = 3
FILES = (".py", ".js", ".cpp", ".hpp")


class Row(NamedTuple):
    """One row of a table: what is asked for, the files, and the names in them."""

    subject: str
    paths: list[Path]
    names: list[str]


def rows(page: str) -> list[Row]:
    """Return the rows of all tables; each line of a table that is not understood is an error."""
    found = []
    for line in page.splitlines():
        if not line.startswith("|") or set(line) <= set("|- "):
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[1] == "file":  # the head of a table
            continue
        subject, files, names = cells
        paths = re.findall(r"`([^`]+)`", files)
        assert re.sub(r"`[^`]+`", "", files).strip(", ") == "", f"not a list of files: {files}"
        assert paths, f"no file: {line}"
        found.append(Row(subject, [ROOT / path for path in paths], code_of(names)))
    return found


def code_of(text: str) -> list[str]:
    """Return what is marked as code."""
    return re.findall(r"`([^`]+)`", text)


def text_of(path: Path) -> str:
    """Return the text of a file, or of the files of a folder, with their names."""
    files = [path] if path.is_file() else [each for each in path.iterdir() if each.is_file()]
    return "".join(f"{each.name}\n{each.read_text(errors='replace')}" for each in files)


def has(text: str, name: str) -> bool:
    """Return whether a text has a name, or the last part of a name with dots or colons."""
    part = name if name.endswith(FILES) else re.split(r"::|\.", name)[-1]
    return bool(re.search(rf"(?<!\w){re.escape(part)}(?!\w)", text))


@pytest.mark.parametrize("row", rows(PAGE), ids=lambda row: row.subject[:60])
def test_a_row_names_what_is_there(row: Row) -> None:
    assert [path for path in row.paths if not path.exists()] == []
    text = "".join(map(text_of, row.paths))
    assert [name for name in row.names if not has(text, name)] == []


def test_no_row_is_left_out() -> None:
    lines = re.findall(r"^\| .*\|$", PAGE, re.MULTILINE)
    heads = [line for line in lines if "| file |" in line]
    assert len(rows(PAGE)) == len(lines) - len(heads)
    assert len(heads) == PAGE.count("\n|---")


def test_a_question_is_answered_in_few_files() -> None:
    part = PAGE.split(QUESTIONS)[1].split("\n## ")[0]
    questions = rows(part)
    assert len(questions) >= 12
    assert [row.subject for row in questions if len(row.paths) > MOST_FILES] == []
    assert [row.subject for row in questions if not all(path.is_file() for path in row.paths)] == []


@pytest.mark.parametrize(
    "line",
    ["| one | two |", "| one | `README.md` there | `a` |", "| one | README.md | `a` |"],
)
def test_a_row_that_is_not_understood_is_an_error(line: str) -> None:
    with pytest.raises((AssertionError, ValueError)):
        rows(line)
