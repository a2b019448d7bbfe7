"""The group of commands: imports a command when it is used, and ends it with one line and an exit code."""

import errno
import json
import re
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from enum import IntEnum
from importlib import import_module
from keyword import iskeyword
from typing import Any, NoReturn, TypeVar

import click

from palpate import DeviceNotFound, MissingExtra, PalpateError, SourceTimeout
from palpate.cli.output import echo, signals
from palpate.errors import printable, shortened, unlike


class Exit(IntEnum):
    """Exit codes."""

    UNEXPECTED = 1
    USAGE = 2
    NO_DEVICE = 3
    BAD_DATA = 4
    NOT_RELIABLE = 5
    MISSING_EXTRA = 6
    INTERRUPTED = 130


_LONGEST = 1500  # characters of a message
_VALID = re.compile(r"a valid (float|integer)(?: range)?$")  # as click ends a message
_NUMBERS = {
    "float": "a number: write it as 1.5, without a unit",
    "integer": "a whole number: write it as 3",
}


def code_of(error: Exception) -> int:
    """Return the exit code of an error."""
    if isinstance(error, MissingExtra):
        return Exit.MISSING_EXTRA
    if isinstance(error, DeviceNotFound | SourceTimeout):
        return Exit.NO_DEVICE
    return Exit.BAD_DATA if isinstance(error, PalpateError | OSError) else Exit.UNEXPECTED


def said_of(error: Exception) -> str:
    """Return an error as one line."""
    if isinstance(error, OSError) and error.filename is not None:
        return one_line(f"{error.filename}: {error.strerror}")
    text = one_line(str(error))
    return (
        text
        if isinstance(error, PalpateError | OSError)
        else f"unexpected: {type(error).__name__}: {text}"
    )


def failure(error: Exception) -> dict[str, Any]:
    """Return an error as it stands in a document: exit code and message; of one file, also a column that is not there."""
    if isinstance(error, ValueError | TypeError):
        return {"code": Exit.BAD_DATA, "message": one_line(str(error).split("\n")[0])}
    return {"code": code_of(error), "message": said_of(error)}


def one_line(message: str) -> str:
    """Return a message as one line that fits a screen; libraries quote what they were given as a whole."""
    return shortened(" ".join(message.splitlines()), _LONGEST)


@contextmanager
def usage_errors(before: str = "") -> Iterator[None]:
    """Turn a wrong argument of palpate's functions into an error of the command line, with a text before it."""
    try:
        yield
    except (ValueError, TypeError) as error:
        raise click.UsageError(before + str(error).split("\n")[0]) from error


def as_json() -> bool:
    """Return whether the command that runs has --json."""
    return "palpate.json" in click.get_current_context().meta


def show(document: Any, text: str, *, indent: int | None = 2) -> None:
    """Print a result: with --json one document, else a text, which may be empty."""
    if as_json():
        click.get_current_context().meta["palpate.shown"] = True
        click.echo(json.dumps(document, indent=indent, allow_nan=False))
    elif text:
        echo(text)


def show_notes(file: object, notes: Iterable[str]) -> None:
    """Print what is to be known of a file to standard error."""
    for note in filter(None, notes):
        click.echo(printable(f"{file}: {note}"), err=True)


def _remember(context: click.Context, parameter: click.Parameter, asked: bool) -> None:
    if asked:
        context.meta[f"palpate.{parameter.name}"] = True


_C = TypeVar("_C", bound=Callable[..., Any])
debug_option: Callable[[_C], _C] = click.option(
    "--debug",
    is_flag=True,
    expose_value=False,
    callback=_remember,
    help="After an error print the traceback.",
)
json_option: Callable[[_C], _C] = click.option(
    "--json",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_remember,
    help="Print one JSON document instead.",
)
"""Adds --json to a command; see `show`."""


class Commands(click.Group):
    """A group of commands with --debug; those in `known` (name: module, help line) are imported when they are used."""

    def __init__(
        self, *args: Any, known: Mapping[str, tuple[str, str]] | None = None, **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self._known = known or {}

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, and --debug to it."""
        super().add_command(debug_option(cmd), name)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands."""
        return list(self._known or self.commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        if cmd_name in self._known and cmd_name not in self.commands:
            module = import_module(f"palpate.cli.{self._known[cmd_name][0]}")
            self.add_command(
                getattr(module, f"{cmd_name}_" if iskeyword(cmd_name) else cmd_name), cmd_name
            )
        return self.commands.get(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command by its name."""
        name, names = args[0], self.list_commands(ctx)
        if name not in names and not name.startswith("-") and not ctx.resilient_parsing:
            raise click.UsageError(unlike(name, names, "command"), ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands."""
        known = {name: line for name, (_, line) in self._known.items()}
        lines = known or {
            name: (command.help or "").split("\n")[0] for name, command in self.commands.items()
        }
        with formatter.section("Commands"):
            formatter.write_dl(list(lines.items()))

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the options of the group itself; with --json in the line also a wrong line is a document."""
        if "--json" in args:
            ctx.meta["palpate.json"] = True
        with _one_line_and_code(ctx.meta):
            return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; if it fails, end with one line and an exit code."""
        # SIGTERM as Ctrl-C: what the command has begun to write is removed.
        with _one_line_and_code(ctx.meta), signals(signal.default_int_handler, signal.SIGTERM):
            return super().invoke(ctx)


@contextmanager
def _one_line_and_code(meta: Mapping[str, Any]) -> Iterator[None]:
    """End with one line and an exit code after an error; click itself does so after a closed pipe, without a line."""
    try:
        yield
    except click.UsageError as error:
        raise _with_help(error, meta) from error
    except (click.ClickException, click.exceptions.Exit, click.Abort):
        raise
    except KeyboardInterrupt:
        _end(Exit.INTERRUPTED, "interrupted", "", meta)
    except Exception as error:
        if isinstance(error, OSError) and error.errno == errno.EPIPE:
            raise
        debug, code = "palpate.debug" in meta, code_of(error)
        if debug:
            traceback.print_exception(error)
        more = (
            "; please report it with the output of --debug"
            if code == Exit.UNEXPECTED and not debug
            else ""
        )
        _end(code, said_of(error) + more, "Error: ", meta)


def _with_help(error: click.UsageError, meta: Mapping[str, Any]) -> click.UsageError:
    """Return the error as one line with the help command; `palpate` alone shows its help."""
    if error.ctx is None or isinstance(error, click.exceptions.NoArgsIsHelpError):
        return error
    message = one_line(
        _VALID.sub(lambda match: _NUMBERS[match[1]], error.format_message().rstrip("."))
    )
    message += f"{' See' if message.endswith('?') else '; see'} {error.ctx.command_path} --help"
    _show_error(Exit.USAGE, message, meta)
    return click.UsageError(message)


def _end(code: int, message: str, before: str, meta: Mapping[str, Any]) -> NoReturn:
    """End with a message and an exit code."""
    _show_error(code, message, meta)
    click.echo(before + message, err=True)
    sys.exit(code)


def _show_error(code: int, message: str, meta: Mapping[str, Any]) -> None:
    """Print the document of an error, with --json, if the command has printed none."""
    if "palpate.json" in meta and "palpate.shown" not in meta:
        click.echo(json.dumps({"error": {"code": code, "message": message}}, indent=2))
