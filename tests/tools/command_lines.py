"""Command lines: running them in the process; whether those in texts are commands of palpate, with options that it has."""

import json
import re
import shlex
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import click
from click.exceptions import Exit
from click.testing import CliRunner, Result
from palpate.cli.main import palpate_command
from palpate.cli.paths import FileArgument, InputFile, Recordings

_PROGRAM = re.compile(r"^(?:\$ |sudo )*(?:\S*/)?palpate (.*)$")


def run(*arguments: str | Path, text: str | bytes | None = None, **environment: str) -> Result:
    """Run a command of palpate in this process; `text` is its input."""
    return CliRunner(env=environment).invoke(
        palpate_command, [str(each) for each in arguments], input=text
    )


def document(*arguments: str | Path, **environment: str) -> Any:
    """Run a command of palpate with --json; return its document."""
    return json.loads(run(*arguments, "--json", **environment).stdout)


def commands(
    command: click.Command = palpate_command, names: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the words and the object of `palpate` and of each command."""
    yield names, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            assert inner is not None
            yield from commands(inner, (*names, name))


def lines_of(block: str) -> list[str]:
    """Return what follows `palpate` in the lines of a block of shell, without comments and what comes after a pipe."""
    joined = re.sub(r"\\\n\s*", " ", block)
    found = [
        match[1]
        for line in joined.splitlines()
        for part in line.split(" && ")
        if (match := _PROGRAM.match(part))
    ]
    return [re.split(r" (?:\||\|\||&|>|2>)", line)[0] for line in found]


def parsed(line: str) -> str:
    """Parse one command, with all its arguments, without running it; return its name."""
    command, words, name = _command(shlex.split(line, comments=True))
    assert name, f"palpate {line}: no such command"
    with ExitStack() as files_need_not_exist:
        for parameter in command.params:
            convert: Callable[..., object] = _path
            if isinstance(parameter.type, Recordings):
                convert = _file_argument
            elif not isinstance(parameter.type, InputFile):
                continue
            files_need_not_exist.enter_context(patch.object(parameter.type, "convert", convert))
        with suppress(Exit):  # --help
            command.make_context(f"palpate {name}", words, **palpate_command.context_settings)
    return f"palpate {name}"


def _path(value: str, *_: object) -> Path:
    return Path(value)


def _file_argument(value: str, *_: object) -> FileArgument:
    return FileArgument([Path(value)], is_pattern=False)


def has_options(line: str) -> str | None:
    """Return what is wrong with a command in a sentence, which may lack its arguments: `palpate replay --offline`."""
    command, words, name = _command(shlex.split(line))
    if not name and words and not words[0].startswith("-"):
        return f"no command {words[0]}"
    known = {name for parameter in command.params for name in parameter.opts} | {
        "--help",
        "--debug",
        "-h",
    }
    unknown = [
        word for word in words if re.match(r"--?[a-z]", word) and word.split("=")[0] not in known
    ]
    return f"no option {unknown}" if unknown else None


def _command(words: list[str]) -> tuple[click.Command, list[str], str]:
    """Return the command that words begin with, the other words, and its name."""
    command: click.Command = palpate_command
    names = []
    while words and isinstance(command, click.Group) and not words[0].startswith("-"):
        inner = command.get_command(click.Context(command), words[0])
        if inner is None:
            return command, words, ""
        names.append(words[0])
        command = inner
        words = words[1:]
    return command, words, " ".join(names)
