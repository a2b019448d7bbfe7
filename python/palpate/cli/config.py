"""Defaults of options: from palpate.toml, and from the environment.

Priority, highest first: the command line, the environment, palpate.toml in the working folder, palpate.toml in the
user's configuration folder.
"""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

from palpate.cli.known_loggers import ENTRIES
from palpate.errors import quoted

NAME = "palpate.toml"
_FILES = "palpate.files"  # key in context.meta: command -> files and variables with defaults for it


def places() -> list[Path]:
    """Return the paths of palpate.toml, the one with the highest priority last."""
    return [Path(click.get_app_dir("palpate")) / NAME, Path(NAME)]


def load(context: click.Context, chosen: Path | None, commands: Iterable[str]) -> None:
    """Read the defaults from the files into the context of a group.

    Raises
    ------
    click.UsageError
        The file is not valid. For the command that runs: an unknown key or variable (the message lists the allowed
        ones), or a value that the option does not accept.
    """
    merged: dict[str, dict[str, Any]] = {}
    files: dict[str, list[Path]] = {}
    loggers: list[tuple[Path, Any]] = context.meta.setdefault(ENTRIES, [])
    for path in [chosen] if chosen else [path for path in places() if path.exists()]:
        for name, table in read(path, commands).items():
            if name == "import":
                loggers.extend((path, entry) for entry in _entries(path, table))
            _merge(merged.setdefault(name, {}), table)
            files.setdefault(name, []).append(path)
    context.meta[_FILES] = files
    group, run = context.command, context.invoked_subcommand
    if isinstance(group, click.Group) and run and (command := group.get_command(context, run)):
        _check_environment(command)
        where = ", ".join(map(str, files.get(run, [])))
        context.default_map = {run: parameters(where, command, merged.get(run, {}))}
        if merged.get(run):
            click.echo(f"defaults of {run} from {where}: {', '.join(merged[run])}", err=True)
        files.setdefault(run, []).extend(Path(name) for name in sorted(os.environ) if name in _variables(command))


def _entries(path: Path, table: dict[str, Any]) -> list[Any]:
    """Take the entries [[import.logger]] out of a table."""
    entries = table.pop("logger", [])
    if not isinstance(entries, list):
        raise click.UsageError(f"{path}: [import]: logger: got {quoted(entries)}, allowed: tables [[import.logger]]")
    return entries


def _merge(into: dict[str, Any], table: dict[str, Any]) -> None:
    """Add a table to another one; where both have a table, add that one in the same way."""
    for key, value in table.items():
        before = into.get(key)
        if isinstance(before, dict) and isinstance(value, dict):
            into[key] = {**before, **value}
        else:
            into[key] = value


def read(path: Path, commands: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return a file's tables, one for each command.

    Raises
    ------
    click.UsageError
        Not a file, not TOML, a table with an unknown command, or an entry that is not a table.
    """
    from palpate import toml

    try:
        tables = toml.read(path)
    except OSError as error:
        raise click.UsageError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:  # not UTF-8, or not TOML
        raise click.UsageError(f"{path}: not TOML: {error}") from error
    allowed = ", ".join(f"[{name}]" for name in commands)
    for name, table in tables.items():
        if name not in commands or not isinstance(table, dict):
            raise click.UsageError(f"{path}: got {quoted(name)}, allowed: tables {allowed}")
    return tables


def keys(command: click.Command) -> dict[str, click.Parameter]:
    """Return the parameters that can have a default: long options without dashes, and the source."""
    found: dict[str, click.Parameter] = {}
    for parameter in command.params:
        long = [name[2:] for name in parameter.opts if name.startswith("--") and len(name) > 3]
        if long:
            found[long[0]] = parameter
        elif parameter.name == "source":
            found["source"] = parameter
    return found


def take_from_environment(command: click.Command) -> None:
    """Set the environment variable of each option: PALPATE_COMMAND_OPTION."""
    for key, parameter in keys(command).items():
        parameter.envvar = parameter.envvar or _variable(command, key)


def parameters(where: str, command: click.Command, table: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a command with the names of click's parameters as keys; a group has a table for each command.

    Raises
    ------
    click.UsageError
        An unknown key (the message lists the allowed ones), or a table in place of a value.
    """
    inner = _commands_of(command)
    if inner and (both := {key: value for key, value in table.items() if key in inner and isinstance(value, dict)}):
        own = {key: value for key, value in table.items() if key not in both}
        return parameters(where, command, own) | {
            key: parameters(where, inner[key], value) for key, value in both.items()
        }
    allowed = keys(command)
    for key, value in table.items():
        if key not in allowed:
            raise click.UsageError(
                f"{where}: [{command.name}]: got {quoted(key)}, allowed: {', '.join([*allowed, *inner])}"
            )
        if isinstance(value, dict):
            raise click.UsageError(
                f"{where}: [{command.name}]: {key}: got a table, allowed: a value or a list of values"
            )
        if any(isinstance(one, int) and abs(one) >= 2**63 for one in (value if isinstance(value, list) else [value])):
            raise click.UsageError(f"{where}: [{command.name}]: {key}: got {quoted(value)}, allowed: below 2**63")
    return {allowed[key].name or key: value for key, value in table.items()}


def _check_environment(command: click.Command) -> None:
    allowed = _variables(command)
    for variable in sorted(os.environ):
        if variable.startswith(_variable(command, "")) and variable not in allowed:
            raise click.UsageError(f"environment: got {variable}, allowed: {', '.join(sorted(allowed))}")


def _variables(command: click.Command) -> set[str]:
    own = {_variable(command, key) for key in keys(command)}
    return own.union(*map(_variables, _commands_of(command).values()))


def _variable(command: click.Command, key: str) -> str:
    return f"PALPATE_{command.name}_{key}".upper().replace("-", "_").replace(".", "_")


def _commands_of(command: click.Command) -> dict[str, click.Command]:
    """Return the commands of a group; none for a command."""
    if not isinstance(command, click.Group):
        return {}
    context = click.Context(command)
    found = {name: command.get_command(context, name) for name in command.list_commands(context)}
    return {name: inner for name, inner in found.items() if inner is not None}
