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
    utc_now,
    versions,
    without_path,
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
from palpate.cli.paths import OUTPUT, require_free
from palpate.cli.shared_options import complete_source, firmware_option

_INTERRUPTED = "interrupted"  # why an acceptance ended, in its report


def _board_arguments(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add source and firmware to a command."""
    source = click.argument("source", shell_complete=complete_source, default="usb:")
    return source(firmware_option(command))


@contextmanager
def _opened_board(source: str, firmware: Path | None) -> Iterator[BoardUnderTest]:
    """Open a board, and close it in the end."""
    options = {}
    if firmware:
        options["firmware"] = str(firmware)
    with usage_errors():
        board = open_board(source, options)
    with closing(board.source):
        yield board


@click.group(cls=CommandGroup)
def kit() -> None:
    """Check a board: wiring, noise, registers.

    SOURCE is usb:, i2c:/dev/i2c-1, or sim: for a simulated board.

    \b
    Example:
      palpate kit accept usb: --firmware Icv_usb.hex
    """  # noqa: D301


@kit.command("accept")
@_board_arguments
@click.option(
    "-o",
    "file",
    type=OUTPUT,
    help="The report to write: a new file.  [default: kit-report-DATE-TIME.json]",
)
@click.option(
    "--prompt/--no-prompt",
    default=None,
    help="Ask for what needs a hand.  [default: only at a terminal]",
)
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

    It takes about a minute. Keep the probe still in the air; what needs a hand is asked for at the
    end. The report is a JSON file, to attach to an issue; it has the registers and versions, no
    name and no path. Exit codes: 0, all is right; 3, no board, or it was unplugged and not
    connected again; 5, a step is wrong; 130, Ctrl-C. The report has what was done until then.

    \b
    Example:
      palpate kit accept usb: --firmware Icv_usb.hex
      palpate kit accept "usb:1/5?excitation=A" --skip replug -o bench.json
      palpate kit accept sim: --no-prompt
    """  # noqa: D301
    path = file or Path(f"kit-report-{datetime.now():%Y%m%d-%H%M%S}.json")
    require_free([path], force=None)
    with _opened_board(source, firmware) as board:
        board.source.notify = print_message
        with path.open("xb") as output:  # before the steps: a minute of work needs a place
            asks = sys.stdin.isatty() if prompt is None else prompt
            report = _measure(board, source, output, asks=asks, skip=skip)
    if is_json():
        click.echo(report.to_json().rstrip())
    else:
        ended = f"; ended early: {report.stopped}" if report.stopped else ""
        click.echo(count_verdicts(report.steps) + ended)
    print_message(f"report: {path}")
    sys.exit(acceptance_exit_code(report))


def _measure(
    board: BoardUnderTest,
    source: str,
    output: BinaryIO,
    *,
    asks: bool,
    skip: tuple[str, ...],
) -> AcceptanceReport:
    """Do the steps; write the report, also if an error or Ctrl-C ends them."""
    started = utc_now()
    done: list[Step] = []
    stopped = ""
    acceptance = steps.Acceptance(board, ask if asks else None, skip=skip)
    try:
        for step in acceptance:
            done.append(step)
            if not is_json():
                click.echo("\n".join(step.lines()))
        stopped = acceptance.stopped
    except (KeyboardInterrupt, click.Abort):
        stopped = _INTERRUPTED
    except Exception as error:
        stopped = f"unexpected: {type(error).__name__}"
        raise
    finally:
        device = board.source.describe()
        registers = board.dump.hex(" ")
        report = AcceptanceReport(
            started, without_path(source), versions(), device, registers, done, stopped
        )
        output.write(report.to_json().encode())
    return report


def acceptance_exit_code(report: AcceptanceReport) -> ExitCode:
    """Return the exit code for an acceptance."""
    if report.stopped == _INTERRUPTED:
        return ExitCode.INTERRUPTED
    if report.stopped:
        return ExitCode.NO_DEVICE
    if any(step.verdict is Verdict.WRONG for step in report.steps):
        return ExitCode.NOT_RELIABLE
    return ExitCode.DONE


def ask(text: str) -> bool:
    """Ask at the terminal, on standard error, and wait for Enter; s leaves the step out."""
    question = f"{text} Enter: go on, s: leave out"
    answer: str = click.prompt(question, default="", show_default=False, err=True)
    return answer.strip().lower() != "s"


_NOISE_HEADER = ("CAPF", "   ms", " CIN1 aF", " CIN2 aF", "data sheet aF")


@kit.command("noise")
@_board_arguments
@click.option(
    "--capf",
    "speeds",
    type=click.IntRange(0, 7),
    multiple=True,
    help="Speed, 0 (11 ms) to 7 (110 ms); may be repeated.  [default: all]",
)
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

    aF rms, from the differences of readings in succession, so that a slow drift does not count.
    Keep the probe still. The data sheet's values are for open inputs; a probe and its cable add to
    them.

    \b
    Example:
      palpate kit noise usb:
      palpate kit noise usb: --capf 4 --rounds 100
    """  # noqa: D301
    documents = []
    if not is_json():
        click.echo("  ".join(_NOISE_HEADER))
    speeds = speeds or tuple(range(len(CONVERSION_S)))
    with _opened_board(source, firmware) as board:
        board.chip.reset()
        board.scan()
        for capf in rounds * speeds:
            row: dict[str, float | None] = {"capf": capf}
            cells = [str(capf), f"{1e3 * CONVERSION_S[capf]:.1f}"]
            for pin in PINS:
                noise_aF = _noise_aF(board, pin, capf, readings)
                row[f"cin{pin}_aF"] = noise_aF
                cells.append("-" if noise_aF is None else f"{noise_aF:.1f}")
            data_sheet_aF = round(1e6 * NOISE_PF[capf], 1)
            row["data_sheet_aF"] = data_sheet_aF
            documents.append(row)
            if not is_json():
                click.echo(format_row(_NOISE_HEADER, [*cells, f"{data_sheet_aF:.1f}"]))
        for pin in PINS:
            if board.level(pin) is None:
                found = f"{board.levels[pin, 'A']} on EXCA and {board.levels[pin, 'B']} on EXCB"
                print_message(
                    f"CIN{pin} is not measured: it has {found}, so no sensor is there, or a "
                    "short: look at its wires (palpate kit accept names them)"
                )
    print_result({"readings": readings, "noise": documents}, "")


def _noise_aF(board: BoardUnderTest, pin: int, capf: int, readings: int) -> float | None:
    """Return the noise of an input, aF rms; None: nothing is connected."""
    level = board.level(pin)
    if level is None:
        return None
    rms_pF, _ = measure_noise(board, pin, level, capf, readings)
    return round(1e6 * rms_pF, 2)


@kit.command("scan")
@_board_arguments
@json_option
def scan_command(source: str, firmware: Path | None) -> None:
    """Measure the capacitance of each input with each excitation.

    Above 4 pF the values are uncertain by 20 %, because of the chip's CAPDAC. An open input has
    some fF.

    \b
    Example:
      palpate kit scan usb:
    """  # noqa: D301
    with _opened_board(source, firmware) as board:
        board.chip.reset()
        board.scan()
    documents = []
    for (pin, excitation), level in board.levels.items():
        documents.append(
            {
                "input": f"CIN{pin}",
                "excitation": f"EXC{excitation}",
                "excitation_error": level.error,
                "pF": None if math.isnan(level.pF) else round(level.total_pF, 5),
            }
        )
    rows = [["", "EXCA", "EXCB"]]
    for pin in PINS:
        rows.append([f"CIN{pin}", str(board.levels[pin, "A"]), str(board.levels[pin, "B"])])
    print_result({"inputs": documents}, format_table(rows))


@kit.command("dump")
@_board_arguments
@json_option
def dump_command(source: str, firmware: Path | None) -> None:
    """Print the registers by name, with their bits in words.

    Nothing is written to the chip; a conversion that is running may be lost.

    \b
    Example:
      palpate kit dump usb:
    """  # noqa: D301
    with _opened_board(source, firmware) as board:
        registers = describe_registers(board.chip.registers())
    documents = []
    rows = []
    for register in registers:
        content = register.content.hex()
        documents.append({**register._asdict(), "content": content})
        rows.append((f"{register.address:02X}", register.name, content, register.words))
    print_result({"registers": documents}, format_table(rows, "<"))
