"""The group of commands: imports a command when it is used, and ends it with one line and an exit code."""

import errno
import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from keyword import iskeyword
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import click

from palpate.cli.exit import INTERRUPTED, UNEXPECTED, code_of, one_line, said_of


def _remember(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
    if asked:
        context.meta["palpate.debug"] = True


_C = TypeVar("_C", bound=Callable[..., Any])
debug_option: Callable[[_C], _C] = click.option(
    "--debug", is_flag=True, expose_value=False, callback=_remember, help="After an error print the traceback."
)


class Commands(click.Group):
    """A group of commands, each in its own module.

    Parameters
    ----------
    commands_in : str
        Package with one module for each command; the command has the name of the module.
    short_helps : mapping
        Help line of each command: listing the commands imports none of them.
    """

    def __init__(self, *args: Any, commands_in: str, short_helps: Mapping[str, str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._package = commands_in
        self._short_helps = short_helps

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands."""
        return list(self._short_helps)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command; add --debug and the defaults from the environment."""
        if cmd_name not in self._short_helps:
            return None
        if cmd_name not in self.commands:
            from palpate.cli.config import take_from_environment

            name = f"{cmd_name}_" if iskeyword(cmd_name) else cmd_name
            command: click.Command = getattr(import_module(f"{self._package}.{name}"), name)
            self.commands[cmd_name] = debug_option(command)
            take_from_environment(command)
        return self.commands[cmd_name]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self._short_helps.items()))

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """Parse the options of the group itself."""
        try:
            return super().make_context(*args, **kwargs)
        except click.UsageError as error:
            raise _one_line(error, []) from error
        except KeyboardInterrupt:
            _interrupted()

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; if it fails, end with one line and an exit code."""
        try:
            return super().invoke(ctx)
        except click.UsageError as error:
            raise _one_line(
                error, ctx.meta.get("palpate.files", {}).get(ctx.find_root().invoked_subcommand, [])
            ) from error
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except Exception as error:
            if isinstance(error, OSError) and error.errno == errno.EPIPE:
                raise  # click ends without a message
            _end(error, debug="palpate.debug" in ctx.meta)
        except KeyboardInterrupt:
            _interrupted()


def _interrupted() -> NoReturn:
    click.echo("interrupted", err=True)
    sys.exit(INTERRUPTED)


def _one_line(error: click.UsageError, files: list[Path]) -> click.UsageError:
    """Return the error with the source of the defaults and the help command; `palpate` alone shows its help."""
    if error.ctx is None or isinstance(error, click.exceptions.NoArgsIsHelpError):
        return error
    message = one_line(error.format_message().rstrip("."))
    unnamed = [str(file) for file in files if str(file) not in message]
    defaults = f" (defaults: {', '.join(unnamed)})" if unnamed else ""
    return click.UsageError(f"{message}{defaults}; see {error.ctx.command_path} --help")


def _end(error: Exception, *, debug: bool) -> NoReturn:
    if debug:
        from traceback import format_exception

        click.echo("".join(format_exception(error)), err=True, nl=False)
    code = code_of(error)
    more = "; please report it with the output of --debug" if code == UNEXPECTED and not debug else ""
    click.echo(f"Error: {said_of(error)}{more}", err=True)
    sys.exit(code)
