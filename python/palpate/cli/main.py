"""The command `palpate`: a group whose commands are imported when they are used."""

import pkgutil
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import click

from palpate import __version__, get_cmake_dir, get_include
from palpate.cli.exit_codes import errors_end_command, handle_signals
from palpate.cli.output import debug_option, output_settings
from palpate.cli.paths import InputFile
from palpate.messages import unlike


class LazyCommand(NamedTuple):
    """A command that is imported when it is used."""

    function: str
    """Module of `palpate.cli`, and its function."""
    help: str
    """The line in the list of commands."""


COMMANDS = {
    "live": LazyCommand("live:live_command", "Watch a measurement in the browser."),
    "record": LazyCommand(
        "record:record_command",
        "Record from SOURCE and print a row for each touch.",
    ),
    "replay": LazyCommand(
        "replay:replay_command",
        "Send recordings through the estimator again: one row for each touch.",
    ),
    "check": LazyCommand(
        "recordings:check_command",
        "Check that recordings are complete, without gaps and not saturated.",
    ),
    "import": LazyCommand(
        "recordings:import_command", "Show how a table of another program is read."
    ),
    "convert": LazyCommand(
        "recordings:convert_command",
        "Convert a recording to Parquet, Arrow, or palpate's own CSV.",
    ),
    "plot": LazyCommand(
        "figures:plot_command",
        "Draw a recording with the ratio of each touch, or a figure of the paper.",
    ),
    "devices": LazyCommand("doctor:devices_command", "List the connected devices."),
    "simulate": LazyCommand(
        "calibrate:simulate_command",
        "Write simulated recordings of touches on known objects.",
    ),
    "calibrate": LazyCommand(
        "calibrate:calibrate_command",
        "Fit a calibration to recordings of touches on known objects.",
    ),
    "verify": LazyCommand(
        "verify:verify_command",
        "Check with a specimen of known modulus whether a calibration still holds.",
    ),
    "report": LazyCommand(
        "recordings:report_command",
        "Write a report of recordings as one HTML file, which prints on A4.",
    ),
    "kit": LazyCommand("kit:kit", "Check a board: wiring, noise, registers."),
    "doctor": LazyCommand(
        "doctor:doctor_command",
        "Check installation, board and permissions, and print what to type.",
    ),
}


class CommandGroup(click.Group):
    """A group of commands with --debug that end with one line and an exit code after an error.

    Parameters
    ----------
    lazy : mapping of str to LazyCommand, optional
        Commands that are imported when they are used.
    """

    def __init__(
        self, *args: Any, lazy: Mapping[str, LazyCommand] | None = None, **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self._lazy = lazy or {}

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, and --debug to it."""
        super().add_command(debug_option(cmd), name)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, in the order of the source."""
        return list(self._lazy or self.commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command; import it before its first use."""
        if cmd_name in self._lazy and cmd_name not in self.commands:
            command = pkgutil.resolve_name(f"palpate.cli.{self._lazy[cmd_name].function}")
            self.add_command(command, cmd_name)
        return self.commands.get(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command by its name."""
        name = args[0]
        names = self.list_commands(ctx)
        if name not in names and not name.startswith("-") and not ctx.resilient_parsing:
            raise click.UsageError(unlike(name, names, "command"), ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands."""
        lines = [(name, command.help) for name, command in self._lazy.items()]
        if not self._lazy:
            for name, command in self.commands.items():
                lines.append((name, (command.help or "").split("\n")[0]))
        with formatter.section("Commands"):
            formatter.write_dl(lines)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the options of the group; with --json in the line an error is JSON, too."""
        output = output_settings(ctx)
        if "--json" in args:
            output.json = True
        with errors_end_command(output):
            return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; SIGTERM ends it as Ctrl-C does, so that no half file is left."""
        with (
            errors_end_command(output_settings(ctx)),
            handle_signals(signal.default_int_handler, signal.SIGTERM),
        ):
            return super().invoke(ctx)


@click.group(
    "palpate",
    cls=CommandGroup,
    lazy=COMMANDS,
    context_settings={
        "help_option_names": ["-h", "--help"],
        "auto_envvar_prefix": "PALPATE",
    },
)
@click.version_option(__version__, prog_name="palpate")
@click.version_option(
    get_include(),
    "--includes",
    message="-I%(version)s",
    help="Print the compiler flag for the headers, and exit.",
)
@click.version_option(
    get_cmake_dir(),
    "--cmakedir",
    message="%(version)s",
    help="Print the folder for CMake (palpate_DIR or add_subdirectory), and exit.",
)
@click.option(
    "--config",
    type=InputFile(),
    help="File with defaults, instead of palpate.toml here and in your configuration folder.",
)
@debug_option
@click.pass_context
def palpate_command(context: click.Context, config: Path | None) -> None:
    """Real-time capacitance ratio from a two-bump tactile probe.

    Defaults of any option: [COMMAND] OPTION = VALUE in palpate.toml, or PALPATE_COMMAND_OPTION in
    the environment.

    \b
    Example:
      palpate live
      palpate record sim:four-specimens -o run.csv
      palpate replay run.csv
    """  # noqa: D301
    from palpate.cli.config import load_defaults

    load_defaults(context, config, COMMANDS)
