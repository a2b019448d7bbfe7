"""What a command prints: results, messages, tables, progress."""

import json
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import click

from palpate.messages import printable


@dataclass
class OutputSettings:
    """How the command that runs prints."""

    json: bool = False
    debug: bool = False
    is_printed: bool = False
    """Whether its JSON document was printed."""


def output_settings(context: click.Context | None = None) -> OutputSettings:
    """Return the settings of the command that runs; group and command share one object."""
    context = context or click.get_current_context()
    settings: OutputSettings = context.meta.setdefault("palpate.output", OutputSettings())
    return settings


def is_json() -> bool:
    """Return whether the command that runs has --json."""
    return output_settings().json


def _set_json(context: click.Context, _: click.Parameter, value: bool) -> None:
    output_settings(context).json |= value


def _set_debug(context: click.Context, _: click.Parameter, value: bool) -> None:
    output_settings(context).debug |= value


_Command = TypeVar("_Command", bound=Callable[..., Any])
debug_option: Callable[[_Command], _Command] = click.option(
    "--debug",
    is_flag=True,
    expose_value=False,
    callback=_set_debug,
    help="After an error print the traceback.",
)
"""Adds --debug to a command."""
json_option: Callable[[_Command], _Command] = click.option(
    "--json",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_set_json,
    help="Print one JSON document instead.",
)
"""Adds --json to a command; see `print_result`."""


def print_result(document: object, text: str, *, indent: int | None = 2) -> None:
    """Print a result: with --json one document, else a text, which may be empty."""
    settings = output_settings()
    if settings.json:
        settings.is_printed = True
        click.echo(json.dumps(document, indent=indent, allow_nan=False))
    elif text:
        print_text(text)


def print_text(text: str) -> None:
    """Print a text to standard output."""
    click.echo(printable(text, "\n"))


def print_notes(file: object, notes: Iterable[str]) -> None:
    """Print the notes about a file to standard error, without empty ones."""
    for note in notes:
        if note:
            click.echo(printable(f"{file}: {note}"), err=True)


def print_message(message: str, *, nl: bool = True) -> None:
    """Print to standard error; a closed terminal or pipe does not end a measurement."""
    with suppress(OSError, ValueError):  # ValueError: the stream is closed
        click.echo(printable(message, "\n" if nl else "\r"), err=True, nl=nl)


def format_row(header: Sequence[str], cells: Iterable[object]) -> str:
    """Return a row of a table: right-aligned cells, as wide as the names in the header."""
    padded = [f"{cell!s:>{len(name)}}" for name, cell in zip(header, cells, strict=True)]
    return "  ".join(padded).rstrip()


def format_table(rows: Sequence[Sequence[str]], side: str = ">") -> str:
    """Return rows as a table, with columns as wide as needed; "<" aligns cells to the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        padded = [f"{cell:{side}{width}}" for cell, width in zip(row, widths, strict=True)]
        lines.append("  ".join(padded).rstrip())
    return "\n".join(lines)


def progress_bar(label: str, length: int) -> Any:
    """Return click's progress bar on standard error, hidden if this is no terminal."""
    return click.progressbar(None, length, label, file=sys.stderr, hidden=not sys.stderr.isatty())


@contextmanager
def reading_progress(label: str, files: Collection[Path]) -> Iterator[Callable[[Path], None]]:
    """Show the progress of reading files by their sizes; yield the function to call after each."""
    sizes = dict.fromkeys(files, 1)
    for file in filter(Path.is_file, files):
        sizes[file] = file.stat().st_size
    with progress_bar(label, sum(sizes.values())) as bar:
        yield lambda file: bar.update(sizes[file])
