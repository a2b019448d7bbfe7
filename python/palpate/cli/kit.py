"""`palpate kit`: commands for a board with an AD7746, and for a simulated one."""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any, BinaryIO

import click

from palpate.acceptance import steps
from palpate.acceptance.board_under_test import PINS, BoardUnderTest, open_board
from palpate.acceptance.chip_steps import measure_noise
from palpate.acceptance.report import (
    AcceptanceReport,
    Step,
    Verdict,
    count_verdicts,
    new_report,
    read_report,
    utc_now,
)
from palpate.ad7746.registers import CONVERSION_S, NOISE_PF, describe_registers
from palpate.cli.exit_codes import ExitCode, usage_errors
from palpate.cli.main import CommandGroup
from palpate.cli.output import (
    format_row,
    format_table,
    is_json,
    json_option,
    print_message,
    print_result,
)
from palpate.cli.paths import OUTPUT, InputFile, require_free
from palpate.cli.shared_options import complete_source, firmware_option


def board_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add source and firmware to a command."""
    return click.argument("source", shell_complete=complete_source, default="usb:")(
        firmware_option(command)
    )


@contextmanager
def opened(source: str, firmware: Path | None) -> Iterator[BoardUnderTest]:
    """Open a board, and close it in the end."""
    with usage_errors():
        bench = open_board(source, {"firmware": str(firmware)} if firmware else {})
    with closing(bench.source):
        yield bench


BY_USER = "interrupted"


def exit_code_of(report: AcceptanceReport) -> int:
    """Print the sum of a report, or the whole as JSON; return the exit code."""
    ended = f"; ended early: {report.stopped}" if report.stopped else ""
    click.echo(report.to_json().rstrip() if is_json() else count_verdicts(report.steps) + ended)
    if report.stopped:
        return ExitCode.INTERRUPTED if report.stopped == BY_USER else ExitCode.NO_DEVICE
    return (
        ExitCode.NOT_RELIABLE if any(step.verdict == Verdict.WRONG for step in report.steps) else 0
    )


@click.group(cls=CommandGroup)
def kit() -> None:
    """Check a board: wiring, noise, registers.

    SOURCE is usb:, i2c:/dev/i2c-1, or sim: for a simulated board.

    \b
    Example:
      palpate kit accept usb: --firmware Icv_usb.hex
      palpate kit report kit-report-20261122-110500.json
    """  # noqa: D301


@kit.command("accept")
@board_options
@click.option("-o", "file", type=OUTPUT,
              help="The report to write: a new file.  [default: kit-report-DATE-TIME.json]")  # fmt: skip
@click.option("--prompt/--no-prompt", default=None,
              help="Ask for what needs a hand.  [default: only at a terminal]")  # fmt: skip
@click.option(
    "--skip",
    multiple=True,
    type=click.Choice(steps.NAMES),
    help="A step to leave out; may be repeated.",
)
@json_option
def accept_command(
    source: str,
    firmware: Path | None,
    file: Path | None,
    prompt: bool | None,
    skip: tuple[str, ...],
) -> None:
    """Measure all that shows whether a board works and is wired right; write a report.

    It takes about a minute. Keep the probe still in the air; what needs a hand is asked for at the end. The report is a
    JSON file, to attach to an issue; it has the registers and versions, no name and no path. Exit codes: 0, all is
    right; 3, no board, or it was unplugged and not connected again; 5, a step is wrong; 130, Ctrl-C. The report has
    what was done until then.

    \b
    Example:
      palpate kit accept usb: --firmware Icv_usb.hex
      palpate kit accept "usb:1/5?excitation=A" --skip replug -o bench.json
      palpate kit accept sim: --no-prompt
    """  # noqa: D301
    path = file or Path(f"kit-report-{datetime.now():%Y%m%d-%H%M%S}.json")
    require_free([path], force=None)
    with opened(source, firmware) as bench:
        bench.source.notify = print_message
        with path.open("xb") as output:  # before the steps: a minute of work needs a place
            asks = sys.stdin.isatty() if prompt is None else prompt
            report = _measure(bench, source, output, asks=asks, skip=skip)
    code = exit_code_of(report)
    print_message(f"report: {path}")
    sys.exit(code)


def _measure(
    bench: BoardUnderTest, source: str, output: BinaryIO, *, asks: bool, skip: tuple[str, ...]
) -> AcceptanceReport:
    """Do the steps; write the report, also if an error or Ctrl-C ends them."""
    started = utc_now()
    done: list[Step] = []
    stopped = ""
    begun = steps.Acceptance(bench, Terminal() if asks else None, skip=skip)
    try:
        for step in begun:
            done.append(step)
            if not is_json():
                click.echo("\n".join(step.lines()))
        stopped = begun.stopped
    except (KeyboardInterrupt, click.Abort):
        stopped = BY_USER
    except Exception as error:
        stopped = f"unexpected: {type(error).__name__}"
        raise
    finally:
        found = new_report(started, source, bench.source.describe(), bench.dump, done, stopped)
        output.write(found.to_json().encode())
    return found


class Terminal:
    """Asks at the terminal; questions go to standard error."""

    def ready(self, text: str) -> bool:
        """Wait for Enter; s leaves the step out."""
        question = f"{text} Enter: go on, s: leave out"
        answer: str = click.prompt(question, default="", show_default=False, err=True)
        return answer.strip().lower() != "s"


_NOISE = ("CAPF", "   ms", " CIN1 aF", " CIN2 aF", "data sheet aF")


@kit.command("noise")
@board_options
@click.option("--capf", "speeds", type=click.IntRange(0, 7), multiple=True,
              help="Speed, 0 (11 ms) to 7 (110 ms); may be repeated.  [default: all]")  # fmt: skip
@click.option(
    "--readings",
    type=click.IntRange(2, 10_000),
    default=50,
    show_default=True,
    help="Readings for a value.",
)
@click.option(
    "--rounds",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    help="How often to measure all.",
)
@json_option
def noise_command(
    source: str, firmware: Path | None, speeds: tuple[int, ...], readings: int, rounds: int
) -> None:
    """Measure the noise of each input, beside the data sheet's.

    aF rms, from the differences of readings in succession, so that a slow drift does not count. Keep the probe still.
    The data sheet's values are for open inputs; a probe and its cable add to them.

    \b
    Example:
      palpate kit noise usb:
      palpate kit noise usb: --capf 4 --rounds 100
    """  # noqa: D301
    rows = []
    if not is_json():
        click.echo("  ".join(_NOISE))
    with opened(source, firmware) as bench:
        bench.chip.reset()
        bench.scan()
        for capf in rounds * (speeds or tuple(range(len(CONVERSION_S)))):
            found, sheet = _both(bench, capf, readings), 1e6 * NOISE_PF[capf]
            rows.append(
                {
                    "capf": capf,
                    "cin1_aF": found[0],
                    "cin2_aF": found[1],
                    "data_sheet_aF": round(sheet, 1),
                }
            )
            if not is_json():
                shown = ["-" if value is None else f"{value:.1f}" for value in found]
                click.echo(
                    format_row(
                        _NOISE, [capf, f"{1e3 * CONVERSION_S[capf]:.1f}", *shown, f"{sheet:.1f}"]
                    )
                )
        for pin in [pin for pin in PINS if bench.level(pin) is None]:
            has = f"{bench.levels[pin, 'A']} on EXCA and {bench.levels[pin, 'B']} on EXCB"
            so = "so no sensor is there, or a short: look at its wires (palpate kit accept names them)"
            print_message(f"CIN{pin} is not measured: it has {has}, {so}")
    print_result({"readings": readings, "noise": rows}, "")


def _both(bench: BoardUnderTest, capf: int, readings: int) -> list[float | None]:
    """Return the noise of both inputs, aF rms; None: nothing is connected."""
    levels = [(pin, bench.level(pin)) for pin in PINS]
    return [None if level is None else round(1e6 * measure_noise(bench, pin, level, capf, readings)[0], 2)
            for pin, level in levels]  # fmt: skip


@kit.command("scan")
@board_options
@json_option
def scan_command(source: str, firmware: Path | None) -> None:
    """Measure the capacitance of each input with each excitation.

    Above 4 pF the values are uncertain by 20 %, because of the chip's CAPDAC. An open input has some fF.

    \b
    Example:
      palpate kit scan usb:
    """  # noqa: D301
    with opened(source, firmware) as bench:
        bench.chip.reset()
        bench.scan()
    rows = [{"input": f"CIN{pin}", "excitation": f"EXC{name}", "excitation_error": level.error,
             "pF": None if math.isnan(level.pF) else round(level.total_pF, 5)}
            for (pin, name), level in bench.levels.items()]  # fmt: skip
    shown = [[f"CIN{pin}", *(str(bench.levels[pin, name]) for name in "AB")] for pin in PINS]
    print_result({"inputs": rows}, format_table([["", "EXCA", "EXCB"], *shown]))


@kit.command("dump")
@board_options
@json_option
def dump_command(source: str, firmware: Path | None) -> None:
    """Print the registers by name, with their bits in words.

    Nothing is written to the chip; a conversion that is running may be lost.

    \b
    Example:
      palpate kit dump usb:
    """  # noqa: D301
    with opened(source, firmware) as bench:
        found = describe_registers(bench.chip.registers())
    rows = [{**register._asdict(), "content": register.content.hex()} for register in found]
    shown = [(f"{each.address:02X}", each.name, each.content.hex(), each.words) for each in found]
    print_result({"registers": rows}, format_table(shown, "<"))


@kit.command("report")
@click.argument("file", type=InputFile())
@json_option
def kit_report_command(file: Path) -> None:
    """Print the report of an acceptance.

    Exit codes as those of `palpate kit accept`: 0, all is right; 3, it was stopped by the board; 5, a step is wrong;
    130, it was interrupted; also 4, the file is not a report.

    \b
    Example:
      palpate kit report kit-report-20261122-110500.json
    """  # noqa: D301
    found = read_report(file)
    if not is_json():
        click.echo("\n".join(found.lines()))
    sys.exit(exit_code_of(found))
