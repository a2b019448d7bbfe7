"""The command line. Results go to standard output, everything else to standard error.

Exit codes: 0 done, 1 unexpected error or closed pipe, 2 a wrong line or a wrong palpate.toml, 3 no device or no permission
to open it, 4 anything about a file, 5 measured but not reliable, 6 an extra is missing, 130 interrupted.
"""

from collections.abc import Callable
from pathlib import Path

import click

from palpate import __version__, get_cmake_dir, get_include
from palpate.cli.group import Commands, debug_option
from palpate.cli.inputs import InputFile

COMMANDS = {
    "live": "Watch a measurement in the browser.",
    "record": "Record from SOURCE and print a row for each touch as it ends, and another when its result is revised.",
    "replay": "Send recordings through the estimator again: one row for each touch.",
    "check": "Check that recordings are complete, without gaps and not saturated.",
    "import": "Show how a table of another program is read, ask what is open, and remember the answer.",
    "convert": "Convert a recording to Parquet, Arrow, or palpate's own CSV.",
    "plot": "Draw a recording, with the ratio of each touch.",
    "devices": "List the connected devices.",
    "simulate": "Write simulated recordings of touches on known objects.",
    "calibrate": "Fit a calibration to recordings of touches on known objects.",
    "report": "Write a report of recordings as one HTML file, which prints on A4.",
    "figures": "Draw the figures of the paper from simulated data.",
    "bench": "Compare estimators on simulated touches: error and run time.",
    "kit": "Check a board: wiring, noise, registers.",
    "doctor": "Check installation, board and permissions, and print what to type.",
    "completion": "Print a script for shell completion of commands, options and sources.",
}
"""Help line of each command. The module palpate.cli.NAME has the function NAME; it is imported when it is used."""


def _tell(text: str) -> Callable[[click.Context, click.Parameter, bool], None]:
    def tell(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
        if asked:
            click.echo(text)
            context.exit()

    return tell


@click.group("palpate", cls=Commands, commands_in="palpate.cli", short_helps=COMMANDS,
             context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "PALPATE"})  # fmt: skip
@click.version_option(__version__, prog_name="palpate")
@click.option("--includes", is_flag=True, is_eager=True, expose_value=False, callback=_tell(f"-I{get_include()}"),
              help="Print the compiler flag for the headers, and exit.")  # fmt: skip
@click.option("--cmakedir", is_flag=True, is_eager=True, expose_value=False, callback=_tell(get_cmake_dir()),
              help="Print the folder for CMake (palpate_DIR or add_subdirectory), and exit.")  # fmt: skip
@click.option("--config", type=InputFile(),
              help="File with defaults, instead of palpate.toml here and in your configuration folder.")  # fmt: skip
@debug_option
@click.pass_context
def main(context: click.Context, config: Path | None) -> None:
    """Real-time capacitance ratio from a two-bump tactile probe.

    Defaults of any option: [COMMAND] OPTION = VALUE in palpate.toml, or PALPATE_COMMAND_OPTION in the environment.

    \b
    Example:
      palpate live
      palpate record sim:four-specimens -o run.csv
      palpate replay run.csv
    """  # noqa: D301
    if context.invoked_subcommand != "doctor":  # doctor reports errors in these files itself
        from palpate.cli.config import load

        load(context, config, COMMANDS)
