"""The page of the commands: usage, options and exit codes, as `--help` has them."""

import re
from collections.abc import Iterator

import click
from palpate.cli.config import GUARDED, configurable_parameters
from palpate.cli.exit_codes import ExitCode
from palpate.cli.main import palpate_command

from docs.generator.attributes import attribute_docstrings
from docs.generator.docstrings import paragraphs
from docs.generator.markdown import block, code, page, prose, slug, table

_DEFAULT = re.compile(r"\s*\[default: (.*)\]\s*$", re.DOTALL)
_OPTION = re.compile(r"(?<![\w`-])(--[a-z][a-z-]*)")
_EVERY = ("json", "debug")
_INTRODUCTION = """\
What `--help` of each command prints: usage, options, exit codes. [Command line](../cli.md)
explains what all commands share. Every command has `--debug`, which prints the traceback of an
error, and `--help`. The default of an option with two dashes can be set in `palpate.toml`, in a
table with the name of the command, or in the environment, as `PALPATE_REPLAY_SCENE`."""
_NOT_IN_FOLDER = """\
The `palpate.toml` of the working folder may not set these options, because the folder may come
from somebody else: {}."""


def commands_page() -> str:
    """Return the page."""
    described = list(every_command())
    parts = ["# Commands", _INTRODUCTION, _NOT_IN_FOLDER.format(guarded_options())]
    rows = []
    for path, command in described:
        summary = (command.help or "").split("\n\n")[0]
        rows.append((f"[{code(path)}](#{slug(path)})", prose(" ".join(summary.split()))))
    parts.append(table(("command", "does"), rows))
    parts += ["## Exit codes", exit_codes()]
    for path, command in described:
        parts += described_command(path, command)
    return page(parts)


def every_command() -> Iterator[tuple[str, click.Command]]:
    """Yield the path and the object of `palpate` and of each command."""
    yield from _commands("palpate", palpate_command)


def _commands(path: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
    yield path, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            assert inner is not None
            yield from _commands(f"{path} {name}", inner)


def guarded_options() -> str:
    """Return the options that a file in the working folder may not set."""
    return ", ".join(code(f"--{name}") for name in sorted(GUARDED))


def exit_codes() -> str:
    """Return the table of the exit codes."""
    texts = attribute_docstrings(ExitCode)
    rows = [(str(each.value), prose(texts.get(each.name, "Done."))) for each in ExitCode]
    return table(("code", "meaning"), rows)


def described_command(path: str, command: click.Command) -> list[str]:
    """Return the parts of the page for one command."""
    words = [piece for each in command.params for piece in usage(each)]
    if isinstance(command, click.Group):
        words += ["COMMAND", "..."]
    parts = [f"## {code(path)}", block("text", " ".join([path, "[OPTIONS]", *words]))]
    parts += help_text(command)
    options = [each for each in command.params if isinstance(each, click.Option)]
    shown = [each for each in options if each.name not in _EVERY and not each.hidden]
    keys = configurable_parameters(command)
    if shown:
        rows = [option_row(option) for option in shown]
        parts.append(table(("option", "value", "default", "meaning"), rows))
    if "json" in keys:
        parts.append("`--json` prints one JSON document instead.")
    return parts


def usage(parameter: click.Parameter) -> list[str]:
    """Return how an argument stands in the usage; options are one word for all."""
    if isinstance(parameter, click.Argument):
        name = parameter.metavar or (parameter.name or "").upper()
        if not parameter.required and "[" not in name:
            name = f"[{name}]"
        if parameter.nargs == -1 and "..." not in name:
            name += "..."
        return [name]
    return []


def help_text(command: click.Command) -> list[str]:
    r"""Return the text of a command; what follows \b is shown as it is written."""
    text = command.help or ""
    before, _, example = text.partition("\b\n")
    parts = [paragraphs(_cleaned(before))]
    if example:
        lines = [line.strip() for line in example.splitlines()]
        parts.append(block("sh", "\n".join(line for line in lines if line.startswith("palpate"))))
    return parts


def _cleaned(text: str) -> str:
    lines = [line.strip() for line in text.strip().splitlines()]
    return _OPTION.sub(r"`\1`", "\n".join(lines))


def option_row(option: click.Option) -> tuple[str, str, str, str]:
    """Return the cells of one option."""
    names = [code(name) for name in [*option.opts, *option.secondary_opts]]
    text = option.help or ""
    default = ""
    stated = _DEFAULT.search(text)
    if stated:
        default = stated[1]
        text = _DEFAULT.sub("", text)
    elif option.show_default:
        default = str(option.default)
    elif option.is_flag and not option.secondary_opts:
        default = "off"
    if option.required:
        default = "required"
    return ", ".join(names), option_value(option), prose(default), prose(_cleaned(text))


def option_value(option: click.Option) -> str:
    """Return what an option takes: its own word, the choices, or a number with its range."""
    kind = option.type
    if option.is_flag:
        return ""
    if isinstance(kind, click.Choice):
        return ", ".join(code(str(choice)) for choice in kind.choices)
    if option.metavar:
        return code(option.metavar)
    if isinstance(kind, click.IntRange | click.FloatRange):
        return number_range(kind)
    if kind in (click.INT, click.FLOAT):
        return "a number"
    if kind is click.STRING:
        return "text"
    return code(kind.name.upper())


def number_range(kind: click.IntRange | click.FloatRange) -> str:
    """Return the range of a number in words."""
    noun = "a number"
    if isinstance(kind, click.IntRange):
        noun = "a whole number"
    if kind.min is not None:
        noun += " above " if kind.min_open else " from "
        noun += f"{kind.min:g}"
    if kind.max is not None:
        noun += " to below " if kind.max_open else " to "
        noun += f"{kind.max:g}"
    return noun
