"""The command line. Results go to standard output, everything else to standard error.

Exit codes: 0 done, 1 unexpected error or closed pipe, 2 a wrong line or a wrong palpate.toml, 3 no device or no permission
to open it, 4 anything about a file, 5 measured but not reliable, 6 an extra is missing, 130 interrupted.
"""

from pathlib import Path

import click

from palpate import __version__, get_cmake_dir, get_include
from palpate.cli.main import Commands, debug_option
from palpate.cli.paths import InputFile

COMMANDS = {
    "live": ("live", "Watch a measurement in the browser."),
    "record": (
        "record",
        "Record from SOURCE and print a row for each touch as it ends, and another when its result is revised.",
    ),
    "replay": ("replay", "Send recordings through the estimator again: one row for each touch."),
    "check": ("recordings", "Check that recordings are complete, without gaps and not saturated."),
    "import": ("recordings", "Show how a table of another program is read."),
    "convert": ("recordings", "Convert a recording to Parquet, Arrow, or palpate's own CSV."),
    "plot": ("recordings", "Draw a recording, with the ratio of each touch."),
    "devices": ("doctor", "List the connected devices."),
    "simulate": ("calibrate", "Write simulated recordings of touches on known objects."),
    "calibrate": ("calibrate", "Fit a calibration to recordings of touches on known objects."),
    "report": ("recordings", "Write a report of recordings as one HTML file, which prints on A4."),
    "kit": ("kit", "Check a board: wiring, noise, registers."),
    "doctor": ("doctor", "Check installation, board and permissions, and print what to type."),
}
"""Module and help line of each command; the module is imported when the command is used."""


@click.group("palpate", cls=Commands, known=COMMANDS,
             context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "PALPATE"})  # fmt: skip
@click.version_option(__version__, prog_name="palpate")
@click.version_option(get_include(), "--includes", message="-I%(version)s",
                      help="Print the compiler flag for the headers, and exit.")  # fmt: skip
@click.version_option(get_cmake_dir(), "--cmakedir", message="%(version)s",
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
    from palpate.cli.config import load

    load(context, config, COMMANDS)
