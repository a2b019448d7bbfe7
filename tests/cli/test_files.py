"""Files that a command reads or writes: whatever is wrong with one, exit code 4, one line, and nothing is written."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest
from command_lines import commands, run
from palpate.cli.paths import (
    OUTPUT,
    OUTPUT_FOLDER,
    InputFile,
    Recordings,
    require_free,
    require_free_in,
)
from project import copied

OURS = (InputFile, Recordings, type(OUTPUT))
WRITTEN = {
    names
    for names, command in commands()
    if any(p.type in (OUTPUT, OUTPUT_FOLDER) for p in command.params)
}
FORCED = {
    names for names, command in commands() if any("--force" in p.opts for p in command.params)
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the working folder: a recording, and an object of each kind that is in the way."""
    monkeypatch.chdir(tmp_path)
    copied(tmp_path / "run.csv")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "moduli.csv").write_text("precious")
    (tmp_path / "taken.csv").write_text("precious")
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    (tmp_path / "link.csv").symlink_to("nowhere")
    return tmp_path


def contents(folder: Path) -> dict[str, bytes | None]:
    there = {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}
    return {str(path.relative_to(folder)): data for path, data in there.items()}


def filled(
    names: tuple[str, ...], command: click.Command, wanted: click.Parameter, file: str
) -> list[str]:
    """Return a whole command line with this file as the value of the wanted parameter."""
    words = list(names)
    for parameter in command.params:
        if parameter.required or parameter is wanted or parameter.name == "source":
            other = "run.csv"
            if parameter.type in (OUTPUT, OUTPUT_FOLDER):
                other = "new.png" if names == ("plot",) else "new.csv"
            value = file if parameter is wanted else "sim:" if parameter.name == "source" else other
            words += (
                [value] if isinstance(parameter, click.Argument) else [parameter.opts[0], value]
            )
    return [*words, *([] if names else ["check", "run.csv"])]


def lines(wanted: Callable[[Any], bool], file: str) -> list[list[str]]:
    return [
        filled(names, command, p, file)
        for names, command in commands()
        for p in command.params
        if wanted(p.type)
    ]


def test_every_command_takes_files_by_these_types() -> None:
    """What is computed can be replaced with --force; a measurement, which cannot be repeated, never."""
    found = [(*names, p.name, p.type) for names, command in commands() for p in command.params]
    plain = [
        each[:-1]
        for each in found
        if isinstance(each[-1], click.Path) and not isinstance(each[-1], OURS)
    ]
    assert plain == [("live", "folder")]  # one that exists
    assert {("record",), ("live",), ("verify",), ("kit", "accept")} == WRITTEN - FORCED
    assert WRITTEN >= FORCED
    assert InputFile(allow_dash=True).convert("-", None, None) == Path("-")  # standard input


@pytest.mark.parametrize(
    "line",
    [
        *lines(lambda kind: isinstance(kind, InputFile | Recordings), "nowhere.csv"),
        ["record", "nowhere.csv", "-o", "new.csv"],
        ["live", "nowhere.csv"],
        ["check", "folder"],
        *lines(lambda kind: kind is OUTPUT, "taken.csv"),
        *lines(lambda kind: kind is OUTPUT_FOLDER, "taken.csv"),
    ],
    ids=" ".join,
)
def test_each_command_with_a_wrong_file(line: list[str], folder: Path) -> None:
    before = contents(folder)
    result = run(*line)
    assert (result.exit_code, result.stdout, contents(folder)) == (4, "", before), result.output
    assert re.fullmatch(r"Error: (nowhere.csv|taken.csv|folder): .*\n", result.stderr), (
        result.stderr
    )


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("taken.csv", "taken.csv: already exists: choose another name, or use --force"),
        ("link.csv", "link.csv: already exists: choose another name, or use --force"),
        ("folder", "folder: is a folder: name a file in it"),
        ("nowhere/new.csv", "nowhere: is no folder: make it, or name another one"),
        ("taken.csv/new.csv", "taken.csv: is no folder: make it, or name another one"),
        ("folder/../run.json", "folder/../run.json: is an input file: choose another name"),
    ],
)
def test_an_output_that_is_in_the_way(file: str, message: str) -> None:
    for force in (None, False, True) if "--force" not in message else (None, False):
        with pytest.raises(OSError) as caught:  # noqa: PT011 (its parts are compared)
            require_free([Path(file)], [Path("run.csv")], force=force)
        found = f"{caught.value.filename}: {caught.value.strerror}"
        assert found == (message.replace(", or use --force", "") if force is None else message)


def test_an_output_folder_that_is_in_the_way() -> None:
    for folder, message in {
        "folder": "already exists",
        "taken.csv/new/new": "is no folder",
    }.items():
        with pytest.raises(OSError, match=message):
            require_free_in(Path(folder), [Path(folder) / "moduli.csv"], force=False)
