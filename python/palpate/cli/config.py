"""Defaults of options, from palpate.toml and from the environment.

Priority, highest first: the command line, the environment, palpate.toml in the working folder,
palpate.toml in the user's configuration folder.
"""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import click

from palpate.cli.output import print_message
from palpate.messages import listed, nearest, quoted, unlike

NAME = "palpate.toml"
GUARDED = frozenset(
    {
        "no-token",
        "host",
        "lsl",
        "firmware",
        "record",
        "folder",
        "plot",
        "report",
        "force",
        "install-udev",
    }
)
"""Options that let others in, run a firmware, or say where files are written or replaced: refused in
the palpate.toml of the working folder, which may come from somebody else."""

Values = dict[str, object]
"""A table of TOML: key and value."""


@dataclass(frozen=True)
class DefaultsTable:
    """The defaults of one command from one place."""

    place: str
    """The file, or "the environment"."""
    section: str
    """Name of the command, as "kit.noise"."""
    values: Mapping[str, object]
    is_trusted: bool = True
    """Whether keys in `GUARDED` are allowed."""

    def parameters(self, command: click.Command) -> Values:
        """Return the values by the names of click's parameters; of a group one table a command.

        Raises
        ------
        click.UsageError
            The key is unknown or in `GUARDED`, or its value is a table.
        """
        options = configurable_parameters(command)
        inner_commands = _subcommands(command)
        parameters: Values = {}
        for key, value in self.values.items():
            if key in inner_commands and isinstance(value, dict):
                section = f"{self.section}.{key}"
                inner = DefaultsTable(self.place, section, value, self.is_trusted)
                parameters[key] = inner.parameters(inner_commands[key])
                continue
            if key not in options:
                raise self._error(unlike(key, [*options, *inner_commands]))
            if _is_guarded(key, value) and not self.is_trusted:
                written = "SOURCE" if key == "source" else f"--{key}"
                allowed = f"{written} in the command line, or this key in {config_paths()[0]}"
                raise self._error(f"{key}: got it in the working folder, allowed: {allowed}")
            if isinstance(value, dict):
                raise self._error(f"{key}: got a table, allowed: a value or a list of values")
            option = options[key]
            if isinstance(option, click.Option) and option.multiple and isinstance(value, str):
                value = value.split()
            parameters[option.name or key] = value
        return parameters

    def _error(self, message: str) -> click.UsageError:
        return click.UsageError(f"{self.place}: [{self.section}]: {message}")


def _is_guarded(key: str, value: object) -> bool:
    """Return whether the working folder may not set this; a source of LSL listens in the network."""
    return key in GUARDED or (key == "source" and str(value).lower().startswith("lsl:"))


def config_paths() -> list[Path]:
    """Return the paths of palpate.toml, the one with the highest priority last."""
    return [Path(click.get_app_dir("palpate")) / NAME, Path(NAME)]


def load_defaults(context: click.Context, chosen: Path | None, commands: Collection[str]) -> None:
    """Set click's defaults for the command that runs, and print where they come from.

    Raises
    ------
    click.UsageError
        The file is not valid; for the command that runs: an unknown key or variable. The message
        lists the allowed ones.
    """
    group = context.command
    name = context.invoked_subcommand
    if not isinstance(group, click.Group) or not name:
        return
    command = group.get_command(context, name)
    if command is None:
        return
    paths = [chosen] if chosen else [path for path in config_paths() if path.exists()]
    tables = []
    for path in paths:
        is_trusted = chosen is not None or str(path) != NAME
        values = read_tables(path, commands).get(name, {})
        tables.append(DefaultsTable(str(path), name, values, is_trusted))
    tables.append(DefaultsTable("the environment", name, _environment_values(command)))
    defaults: Values = {}
    for table in tables:
        if table.values:
            print_message(f"defaults of {name} from {table.place}: {listed(table.values)}")
            _update(defaults, table.parameters(command))
    context.default_map = {name: defaults}


def _update(defaults: Values, parameters: Values) -> None:
    """Replace values; the values of an inner command are replaced one by one."""
    for key, value in parameters.items():
        earlier = defaults.get(key)
        if isinstance(value, dict) and isinstance(earlier, dict):
            defaults[key] = {**earlier, **value}
        else:
            defaults[key] = value


def read_tables(path: Path, commands: Collection[str]) -> dict[str, Values]:
    """Return the tables of a file, one for each command.

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
            names = ", ".join(f"[{command}]" for command in commands)
            allowed = f"tables {names}"
            if name not in commands:
                allowed += nearest(name, commands)
            raise click.UsageError(f"{path}: got {quoted(name)}, allowed: {allowed}")
    return tables


def configurable_parameters(command: click.Command) -> dict[str, click.Parameter]:
    """Return the parameters that can have a default: long options, without dashes, and source."""
    parameters: dict[str, click.Parameter] = {}
    for parameter in command.params:
        long_names = [name for name in parameter.opts if name.startswith("--") and len(name) > 3]
        if long_names:
            parameters[long_names[0].removeprefix("--")] = parameter
        elif parameter.name == "source":
            parameters["source"] = parameter
    return parameters


def _environment_values(command: click.Command) -> Values:
    """Return the table of a command from the variables PALPATE_COMMAND_OPTION."""
    prefix = f"PALPATE_{command.name}_".upper()
    inner_commands = _subcommands(command)
    inner_tables: dict[str, Values] = {}
    values: Values = {}
    for variable in sorted(os.environ):
        if not variable.startswith(prefix):
            continue
        key = variable.removeprefix(prefix).lower().replace("_", "-")
        inner_name, _, inner_key = key.partition("-")
        if inner_name in inner_commands:
            inner_table = inner_tables.setdefault(inner_name, {})
            inner_table[inner_key] = os.environ[variable]
            values[inner_name] = inner_table
        else:
            values[key] = os.environ[variable]
    return values


def _subcommands(command: click.Command) -> Mapping[str, click.Command]:
    return command.commands if isinstance(command, click.Group) else {}
