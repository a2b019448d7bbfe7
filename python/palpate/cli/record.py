"""`palpate record`: a measurement without a screen."""

import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from math import inf
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING

import click

from palpate import PalpateError
from palpate.cli.exit_codes import ExitCode, handle_signals, usage_errors
from palpate.cli.output import is_json, json_option, print_message, print_result
from palpate.cli.paths import OUTPUT, require_free, with_sidecar
from palpate.cli.shared_options import (
    SourceOptions,
    TrackerOptions,
    board_options,
    complete_source,
    lsl_option,
    recording_options,
)

if TYPE_CHECKING:
    from palpate.cli.printer import Printer
    from palpate.stream import Stream
    from palpate.stream.lsl_outlets import Outlets

_GRACE_S = 1.0  # the first sample comes after the begin, and --seconds counts from it


@click.command("record")
@click.argument("source", shell_complete=complete_source)
@click.option(
    "-o", "file", required=True, type=OUTPUT, help="The recording to write, NAME.csv: a new file."
)
@click.option(
    "--touches",
    type=click.IntRange(min=1),
    help="Stop after this number of touches, the last one revised.",
)
@click.option(
    "--seconds", type=click.FloatRange(min=0, min_open=True), help="Stop after this time, s."
)
@click.option(
    "--note",
    "notes",
    multiple=True,
    metavar="TEXT",
    help="A note for the sidecar; may be repeated.",
)
@lsl_option
@board_options
@click.option("--recentre", is_flag=True, help="If a channel leaves the range of the converter for 2 s without a touch, "
              "set the range again.")  # fmt: skip
@recording_options
@json_option
def record_command(
    source: str,
    file: Path,
    touches: int | None,
    seconds: float | None,
    notes: tuple[str, ...],
    lsl: str | None,
    recentre: bool,
    reading: SourceOptions,
    tracker: TrackerOptions,
) -> None:
    """Record from SOURCE and print a row for each touch as it ends, and another when its result is revised.

    SOURCE: usb:, sim:SCENARIO, i2c:/dev/i2c-1, iio:, serial:PORT or a file; see `palpate devices` and
    help(palpate.open). Where the board was opened again or its range was set again, the recording has a mark, and the
    baseline is measured again: touch nothing then. Ctrl-C ends the recording, too, and so does a closed terminal; the file is closed properly. Exit codes: 3, no device, or it was
    unplugged and not connected again; 4, the device sends invalid data, or the file cannot be written; 5, no sample, or
    fewer touches than --touches; 130, Ctrl-C, SIGTERM or a closed terminal.

    \b
    Example:
      palpate record usb: -o bench.csv --touches 4 --note "specimen 70 OO"
      palpate record "sim:four-specimens?seed=1" -o run.csv --touches 4
      palpate record usb: -o bench.csv --lsl
    """  # noqa: D301
    from palpate import sources
    from palpate.cli.printer import Printer
    from palpate.stream import Stream
    from palpate.stream.lsl_outlets import Outlets

    require_free(with_sidecar(file), force=None)
    with usage_errors():
        opened = sources.open(source, **reading.keywords())
        # A file or a simulation is read ahead, and what is read is recorded: not beyond the end that is asked for, nor in another range.
        ahead = 2 if (touches or seconds or recentre) and not opened.live else None
        stream = Stream(
            opened,
            record=file,
            notes=list(notes),
            notify=print_message,
            capacity=ahead,
            **tracker.keywords(),
        )
        outlets = Outlets(stream, lsl) if lsl else None
    for note in notes:
        if outlets:
            outlets.mark("note", note)
    printer = Printer(stream, quiet=is_json())
    stream.listen(printer)
    failure: PalpateError | None = None
    with _interruptible(stream) as came:
        try:
            with outlets or nullcontext():
                _measure(stream, printer, outlets, touches or 0, seconds or inf, recentre=recentre)
        except PalpateError as error:
            failure = error
        if stream.recorder:
            printer.clear()
            print_result(printer.document(file, failure), "")
            print_message(f"{file}: {_counted(stream)}; file closed")
    if failure:
        raise failure
    if came:
        sys.exit(ExitCode.INTERRUPTED)
    if missing := _missing(source, stream, touches or 0):
        click.echo(missing, err=True)
        sys.exit(ExitCode.NOT_RELIABLE)


def _missing(source: str, stream: "Stream", touches: int) -> str:
    """Return what the measurement lacks; "": nothing."""
    if not stream.counters.read:
        return f"{source}: no sample came: check that it measures, or give --seconds more time"
    return (
        f"{len(stream.touches)} of {touches} touches were measured"
        if len(stream.touches) < touches
        else ""
    )


def _measure(
    stream: "Stream",
    printer: "Printer",
    outlets: "Outlets | None",
    touches: int,
    seconds: float,
    *,
    recentre: bool,
) -> None:
    """Measure until the source ends, or there are enough touches or seconds."""
    with stream, ExitStack() as ending:
        if seconds < inf and stream.source.live:  # it ends also if no samples come
            timer = Timer(seconds + _GRACE_S, stream.stop)
            timer.daemon = True
            timer.start()
            ending.callback(timer.cancel)
        for batch in stream.batches():
            if outlets:
                outlets.send(batch)
            if recentre:
                printer.centre()
            if (touches and printer.has(touches)) or printer.elapsed_s >= seconds:
                break
    printer.print_cut()


def _counted(stream: "Stream") -> str:
    """Return the number of rows, and of what is missing or wrong in them."""
    counters = stream.counters
    parts = {
        "lost": counters.lost,
        "late": counters.late,
        "not written": counters.unrecorded,
        "not estimated": counters.dropped,
        "samples without a value": counters.refused,
        "saturated": counters.saturated,
        "times a wrong baseline": counters.retaken,
        "errors of the source": counters.errors,
    }
    counted = "".join(f", {count} {what}" for what, count in parts.items() if count)
    return f"{counters.recorded} rows{counted}{'' if stream.touches else ', no touch'}"


@contextmanager
def _interruptible(stream: "Stream") -> Iterator[list[int]]:
    """Let Ctrl-C, SIGTERM and a closed terminal end the measurement, not the program; yield the received signals."""
    came: list[int] = []

    def handle(number: int, _: object) -> None:
        came.append(number)
        if not stream.stop():
            raise KeyboardInterrupt

    with handle_signals(handle, signal.SIGINT, signal.SIGTERM):
        yield came
