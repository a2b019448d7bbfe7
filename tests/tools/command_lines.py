"""Commands as they stand in texts: whether they are commands of palpate, with options that it has."""

import re
import shlex
from contextlib import ExitStack, suppress
from pathlib import Path
from unittest.mock import patch

import click
from click.exceptions import Exit
from palpate.cli import main
from palpate.cli.inputs import InputFile
from palpate.cli.recordings import Recordings

_PROGRAM = re.compile(r"^(?:\$ |sudo )*(?:\S*/)?palpate (.*)$")


def lines_of(block: str) -> list[str]:
    """Return what follows `palpate` in the lines of a block of shell, without comments and what comes after a pipe."""
    joined = re.sub(r"\\\n\s*", " ", block)
    found = [match[1] for line in joined.splitlines() for part in line.split(" && ") if (match := _PROGRAM.match(part))]
    return [re.split(r" (?:\||\|\||&|>|2>)", line)[0] for line in found]


def parsed(line: str) -> str:
    """Parse one command, with all its arguments, without running it; return its name."""
    words, path = shlex.split(line, comments=True), ["palpate"]
    group: click.Group = main
    while True:
        command = group.get_command(click.Context(group), words[0])
        assert command is not None, f"palpate {line}: no command {words[0]}"
        path.append(words.pop(0))
        if not isinstance(command, click.Group) or not words or words[0].startswith("-"):
            break
        group = command
    with ExitStack() as files_need_not_exist:
        for parameter in command.params:
            if isinstance(parameter.type, InputFile | Recordings):
                files_need_not_exist.enter_context(
                    patch.object(parameter.type, "convert", lambda value, *_: Path(value))
                )
        with suppress(Exit):  # --help
            command.make_context(" ".join(path), words)
    return " ".join(path)


def has_options(line: str) -> str | None:
    """Return what is wrong with a command in a sentence, which may lack its arguments: `palpate replay --offline`."""
    words = shlex.split(line)
    group: click.Group = main
    command: click.Command = main
    while words and isinstance(command, click.Group) and not words[0].startswith("-"):
        group = command
        found = group.get_command(click.Context(group), words[0])
        if found is None:
            return f"no command {words[0]}"
        command = found
        words.pop(0)
    known = {name for parameter in command.params for name in parameter.opts} | {"--help", "--debug", "-h"}
    unknown = [word for word in words if re.match(r"--?[a-z]", word) and word.split("=")[0] not in known]
    return f"no option {unknown}" if unknown else None
