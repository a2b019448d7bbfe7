"""Defaults of options, from palpate.toml and from the environment.

Priority, highest first: the command line, the environment, palpate.toml in the working folder, palpate.toml in the
user's configuration folder.
"""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

from palpate.cli.output import say
from palpate.errors import listed, nearest, quoted, unlike

NAME = "palpate.toml"
GUARDED = frozenset({"no-token", "host", "firmware", "force", "install-udev"})
"""Options that open the page to more people, run a firmware or replace files: not from the working folder, whose palpate.toml
may be of somebody else."""


def places() -> list[Path]:
    """Return the paths of palpate.toml, the one with the highest priority last."""
    return [Path(click.get_app_dir("palpate")) / NAME, Path(NAME)]


def load(context: click.Context, chosen: Path | None, commands: Iterable[str]) -> None:
    """Set click's map of defaults for the command that runs, and print where they are from.

    Raises
    ------
    click.UsageError
        The file is not valid; for the command that runs: an unknown key or variable. The message lists the allowed ones.
    """
    group, run = context.command, context.invoked_subcommand
    if not (
        isinstance(group, click.Group) and run and (command := group.get_command(context, run))
    ):
        return
    paths = [chosen] if chosen else [*filter(Path.exists, places())]
    tables = {str(path): read(path, commands).get(run) for path in paths}
    guarded = "" if chosen else NAME
    tables["the environment"] = _of_environment(command)
    merged: dict[str, Any] = {}
    for place, table in tables.items():
        if table:
            say(f"defaults of {run} from {place}: {listed(table)}")
            for key, value in parameters(
                place, run, command, table, is_own=place != guarded
            ).items():
                merged[key] = {**merged.get(key, {}), **value} if isinstance(value, dict) else value
    context.default_map = {run: merged}


def read(path: Path, commands: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return a file's tables, one for each command.

    Raises
    ------
    click.UsageError
        Not TOML, a table with an unknown command, or an entry that is not a table.
    OSError
        The file cannot be read.
    """
    from palpate.files import read_toml

    try:
        tables = read_toml(path)
    except ValueError as error:  # not UTF-8, or not TOML
        raise click.UsageError(f"{path}: not TOML: {error}") from error
    for name, table in tables.items():
        if name not in commands or not isinstance(table, dict):
            allowed = ", ".join(f"[{command}]" for command in commands)
            raise click.UsageError(
                f"{path}: got {quoted(name)}, allowed: tables {allowed}{nearest(name, commands)}"
            )
    return tables


def keys(command: click.Command) -> dict[str, click.Parameter]:
    """Return the parameters that can have a default: long options without dashes, and the source."""
    found: dict[str, click.Parameter] = {}
    for parameter in command.params:
        long = [name[2:] for name in parameter.opts if name.startswith("--") and len(name) > 3]
        if long or parameter.name == "source":
            found[long[0] if long else "source"] = parameter
    return found


def parameters(
    place: object,
    section: str,
    command: click.Command,
    table: dict[str, Any],
    *,
    is_own: bool = True,
) -> dict[str, Any]:
    """Return the table of a command with the names of click's parameters as keys; a group has a table for each command.

    Raises
    ------
    click.UsageError
        An unknown key (the message lists the allowed ones), a table in place of a value, or a key in `GUARDED` in a file
        that is not the user's own.
    """
    allowed, inner, found = keys(command), _commands_of(command), dict[str, Any]()
    for key, value in table.items():
        where = f"{place}: [{section}]: "
        if key in inner and isinstance(value, dict):
            found[key] = parameters(place, f"{section}.{key}", inner[key], value, is_own=is_own)
        elif key not in allowed:
            raise click.UsageError(where + unlike(key, [*allowed, *inner]))
        elif key in GUARDED and not is_own:
            allowed_in = f"--{key} in the command line, or this key in {places()[0]}"
            raise click.UsageError(
                f"{where}{key}: got it in the working folder, allowed: {allowed_in}"
            )
        elif isinstance(value, dict):
            raise click.UsageError(
                f"{where}{key}: got a table, allowed: a value or a list of values"
            )
        else:
            several = getattr(allowed[key], "multiple", False) and isinstance(value, str)
            found[allowed[key].name or key] = value.split() if several else value
    return found


def _of_environment(command: click.Command) -> dict[str, Any]:
    """Return the table of a command from the variables PALPATE_COMMAND_OPTION."""
    begin, inner, table = (
        f"PALPATE_{command.name}_".upper(),
        _commands_of(command),
        dict[str, Any](),
    )
    for variable in sorted(name for name in os.environ if name.startswith(begin)):
        key = variable.removeprefix(begin).lower().replace("_", "-")
        name, _, option = key.partition("-")
        group, key = (table.setdefault(name, {}), option) if name in inner else (table, key)
        group[key] = os.environ[variable]
    return table


def _commands_of(command: click.Command) -> dict[str, click.Command]:
    """Return the commands of a group; none for a command."""
    return getattr(command, "commands", {})
