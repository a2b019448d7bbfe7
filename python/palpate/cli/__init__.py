"""The command line. Results go to standard output, everything else to standard error.

Exit codes: 0 done, 1 unexpected, 2 usage, 3 no device or no permission, 4 bad or truncated data, 5 measured but not
reliable, 6 an extra is missing, 130 interrupted.
"""

from collections.abc import Callable

import click

from palpate import __version__, get_cmake_dir, get_include
from palpate.cli import calibrate, check, devices, figures, live, record, replay, simulate
from palpate.cli.exit import Commands


def _tell(text: str) -> Callable[[click.Context, click.Parameter, bool], None]:
    def tell(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
        if asked:
            click.echo(text)
            context.exit()

    return tell


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="palpate")
@click.option("--includes", is_flag=True, is_eager=True, expose_value=False, callback=_tell(f"-I{get_include()}"),
              help="Print what a C++ compiler needs to find the headers, and exit.")  # fmt: skip
@click.option("--cmakedir", is_flag=True, is_eager=True, expose_value=False, callback=_tell(get_cmake_dir()),
              help="Print the folder for CMake's palpate_DIR or add_subdirectory, and exit.")  # fmt: skip
def main() -> None:
    """Real-time capacitance ratio from a two-bump tactile probe."""


main.add_command(live.live)
main.add_command(record.record)
main.add_command(replay.replay)
main.add_command(check.check)
main.add_command(devices.devices)
main.add_command(simulate.simulate)
main.add_command(calibrate.calibrate)
main.add_command(figures.figures)


@main.command()
@click.option("--seeds", default=20, show_default=True, type=click.IntRange(min=1), help="Recordings of each scenario.")
def bench(seeds: int) -> None:
    """Error against run time, on simulated touches with known truth.

    The whole bench, with other libraries, the cost of each stage and a figure, is in bench/ of the source.

    \b
    Example:
      palpate bench --seeds 50
    """  # noqa: D301
    from palpate import benchmark

    click.echo(benchmark.table(benchmark.compare(seeds)))
