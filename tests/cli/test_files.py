"""Files that a command reads or writes: whatever is wrong with one, exit code 4, one line, and nothing is written."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner, Result
from palpate.cli import main
from palpate.cli.group import Commands
from palpate.cli.inputs import InputFile
from palpate.cli.outputs import OUTPUT, OUTPUT_FOLDER
from palpate.cli.recordings import Recordings
from palpate.cli.source import SourceType
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
NOBODY = 65534
NAMES = ("moduli.csv", "captions.md")  # of those that commands write into a folder, one of each command


def commands(
    group: click.Command = main, names: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    if isinstance(group, Commands):
        yield names, group
        context = click.Context(group)
        for name in group.list_commands(context):
            command = group.get_command(context, name)
            assert command is not None
            yield from commands(command, (*names, name))
    else:
        yield names, group


def filled(names: tuple[str, ...], command: click.Command, wanted: click.Parameter) -> list[str]:
    """Return a whole command line; FILE stands for the value of the wanted parameter."""
    words = []
    for parameter in command.params:
        if not (parameter.required or parameter is wanted or isinstance(parameter.type, SourceType)):
            continue
        value = "FILE" if parameter is wanted else given(parameter)
        words += [value] if isinstance(parameter, click.Argument) else [parameter.opts[0], value]
    return [*words, "check", "run.csv"] if command is main else [*names, *words]


def given(parameter: click.Parameter) -> str:
    if isinstance(parameter.type, SourceType):
        return "sim:"
    return "new.csv" if parameter.type in (OUTPUT, OUTPUT_FOLDER) else "run.csv"


def lines(wanted: Callable[[Any], bool]) -> list[list[str]]:
    return [filled(names, command, p) for names, command in commands() for p in command.params if wanted(p.type)]


READ = [
    *lines(lambda kind: isinstance(kind, InputFile | Recordings)),
    ["record", "FILE", "-o", "new.csv"],
    ["live", "FILE"],
]
WRITTEN = lines(lambda kind: kind is OUTPUT)
FOLDERS = lines(lambda kind: kind is OUTPUT_FOLDER)
FORCED = {names for names, command in commands() if any("--force" in p.opts for p in command.params)}
MEASURING = {("record",), ("live",), ("kit", "accept")}


def test_every_kind_is_there() -> None:
    """The lists are made from the commands: no command takes a file by another type."""
    assert {line[0] for line in READ} >= {
        "--config",
        "live",
        "record",
        "replay",
        "check",
        "convert",
        "calibrate",
        "kit",
    }
    assert {line[0] for line in WRITTEN} >= {"live", "record", "convert", "calibrate", "kit"}
    assert {line[0] for line in FOLDERS} == {"simulate", "figures"}
    known = (InputFile, Recordings, type(OUTPUT))
    plain = [
        (*names, p.name)
        for names, command in commands()
        for p in command.params
        if isinstance(p.type, click.Path | click.File) and not isinstance(p.type, known)
    ]
    assert plain == [("live", "folder")]  # one that exists


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the working folder: a recording, an object of each kind that is in the way, and no other file."""
    monkeypatch.chdir(tmp_path)
    for suffix in (".csv", ".json"):
        (tmp_path / "run").with_suffix(suffix).write_bytes(FOUR.with_suffix(suffix).read_bytes())
    (tmp_path / "folder").mkdir()
    for name in NAMES:
        (tmp_path / "folder" / name).write_text("precious")
    (tmp_path / "taken.csv").write_text("precious")
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    (tmp_path / "link.csv").symlink_to("nowhere")
    return tmp_path


def contents(folder: Path) -> dict[str, bytes | None]:
    there = {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}
    return {str(path.relative_to(folder)): data for path, data in there.items()}


def refused(line: list[str], file: str, said: str, *more: str) -> None:
    """Run a command line with this file, and look how it ends."""
    before = contents(Path())
    result = run(*[file if word == "FILE" else word for word in line], *more)
    assert (result.exit_code, result.stdout) == (4, ""), result.output
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert result.stderr.startswith(f"Error: {said}"), result.stderr
    assert contents(Path()) == before


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments)


@pytest.mark.parametrize("line", READ, ids=" ".join)
@pytest.mark.parametrize(
    "file", ["nowhere.csv", "folder", "loop.csv", "run.csv/x", "x" * 300], ids=["none", "folder", "loop", "in", "long"]
)
@pytest.mark.usefixtures("folder")
def test_an_input_that_cannot_be_read(line: list[str], file: str) -> None:
    refused(line, file, file)


@pytest.mark.parametrize("line", WRITTEN, ids=" ".join)
@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("taken.csv", "taken.csv: already exists: choose another name"),
        ("link.csv", "link.csv: already exists: choose another name"),
        ("loop.csv", "loop.csv: already exists: choose another name"),
        ("folder", "folder: is a folder: name a file in it"),
        ("nowhere/new.csv", "nowhere: no such folder: make it, or name another one"),
        ("taken.csv/new.csv", "taken.csv: is a file: name a folder"),
        ("run.json", "run.json: "),
    ],
)
@pytest.mark.usefixtures("folder")
def test_an_output_that_is_in_the_way(line: list[str], file: str, said: str) -> None:
    refused(line, file, said)


@pytest.mark.parametrize("line", FOLDERS, ids=" ".join)
@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("folder", "folder/"),
        ("taken.csv", "taken.csv: is a file: name a folder"),
        ("taken.csv/new/new", "taken.csv: is a file: name a folder"),
        ("link.csv", "link.csv: No such file or directory"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_an_output_folder_that_is_in_the_way(line: list[str], file: str, said: str) -> None:
    refused(line, file, said)


@pytest.mark.parametrize("line", [line for line in WRITTEN if (line[0],) in FORCED], ids=" ".join)
@pytest.mark.parametrize("file", ["run.csv", "run.json", "./folder/../run.csv"])
@pytest.mark.usefixtures("folder")
def test_an_input_is_never_replaced(line: list[str], file: str) -> None:
    refused(line, file, f"{Path(file)}: is an input file: choose another name", "--force")


def test_force_is_where_the_input_is_still_there() -> None:
    """What is computed can be replaced; a measurement, which cannot be repeated, never."""
    writing = {n for n, command in commands() if any(p.type in (OUTPUT, OUTPUT_FOLDER) for p in command.params)}
    assert writing - FORCED == MEASURING
    assert writing >= FORCED


@contextmanager
def as_nobody() -> Iterator[None]:
    """Be a user without rights, if root runs the tests: root may read and write anything."""
    if os.geteuid():
        yield
        return
    os.setresuid(NOBODY, NOBODY, 0)
    try:
        yield
    finally:
        os.setresuid(0, 0, 0)


FORBIDDEN = [
    *((line, 0o777, "secret.csv", "secret.csv: ") for line in READ),
    *((line, 0o555, "new.csv", ".: ") for line in WRITTEN),
    *((line, 0o555, "new", ".: ") for line in FOLDERS),
]


@pytest.mark.skipif(not hasattr(os, "setresuid"), reason="no users of this kind on this system")
def test_no_permission(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    (folder / "secret.csv").write_bytes(FOUR.read_bytes())
    for path in list(folder.parents)[:-2]:
        path.chmod(path.stat().st_mode | 0o055)
    (folder / "secret.csv").chmod(0o000)
    (folder / "run.json").unlink()
    before = {path.name for path in folder.iterdir()}
    for line, mode, file, said in FORBIDDEN:
        run(
            *["folder" if word == "FILE" else word for word in line]
        )  # import what it needs: nobody may read no package
        folder.chmod(mode)
        with as_nobody():
            result = run(*[file if word == "FILE" else word for word in line])
        assert (result.exit_code, result.stdout) == (4, ""), (line, result.output)
        assert result.stderr.startswith(f"Error: {said}"), (line, result.stderr)
        assert "Permission denied" in result.stderr
        assert len(result.stderr.splitlines()) == 1
    folder.chmod(0o755)
    assert {path.name for path in folder.iterdir()} == before
