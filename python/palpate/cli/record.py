"""`palpate record`: a measurement without a screen."""

import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
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
from palpate.errors import ProtocolError

if TYPE_CHECKING:
    from palpate.cli.printer import MeasurementPrinter
    from palpate.stream import Stream

_GRACE_S = 1.0  # --seconds counts from the first sample, which comes after the start


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
@click.option(
    "--recentre",
    is_flag=True,
    help="If a channel leaves the range of the converter for 2 s without a touch, set the range "
    "again.",
)
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
    """Record from SOURCE and print a row for each touch.

    The row comes about a second after the touch, when the baseline after it is known and its
    result is revised.

    SOURCE: usb:, sim:SCENARIO, i2c:/dev/i2c-1, iio:, serial:PORT or a file; see `palpate devices`
    and help(palpate.open). Where the board was opened again or its range was set again, the
    recording has a mark, and the baseline is measured again: touch nothing then. Ctrl-C ends the
    recording, too, and so does a closed terminal; the file is closed properly. A disk that is full
    or fails does not: rows wait in memory, and it is tried again. Exit codes: 3, no device, or it
    was unplugged and not connected again; 4, the device sends invalid data, another program read
    the serial port, too, or rows or notes could not be written; 5, no sample, or fewer touches than
    --touches; 130, Ctrl-C, SIGTERM or a closed terminal.

    \b
    Example:
      palpate record usb: -o bench.csv --touches 4 --note "specimen 70 OO"
      palpate record "sim:four-specimens?seed=1" -o run.csv --touches 4
      palpate record usb: -o bench.csv --lsl
    """  # noqa: D301
    from palpate import sources
    from palpate.cli.printer import MeasurementPrinter
    from palpate.stream import Stream
    from palpate.stream.lsl_outlets import Outlets

    require_free(with_sidecar(file), force=None)
    limits = Limits(touches, seconds or inf, recentre)
    outlets = None
    with usage_errors():
        opened = sources.open(source, **reading.keywords())
        # A file or simulation is read ahead, and each sample that was read is recorded. Read little ahead if
        # the recording ends before it, or if its range may change.
        capacity = 2 if limits.is_any() and not opened.live else None
        stream = Stream(
            opened,
            record=file,
            notes=list(notes),
            notify=print_message,
            capacity=capacity,
            **tracker.keywords(),
        )
        if lsl:
            outlets = Outlets(stream, lsl)
    for note in notes:
        if outlets:
            outlets.mark("note", note)
    printer = MeasurementPrinter(stream, quiet=is_json())
    stream.listen(printer)
    failure: PalpateError | None = None
    with signals_stop(stream) as received:
        try:
            with outlets or nullcontext():
                measure(stream, printer, limits)
        except PalpateError as error:
            failure = error
        if stream.recorder:
            printer.clear_status()
            print_result(printer.document(file, failure), "")
            print_message(f"{file}: {_count_text(stream)}; file closed")
    if failure:
        raise failure
    printer.finish()
    if received:
        sys.exit(ExitCode.INTERRUPTED)
    shortfall = _shortfall(source, stream, touches or 0)
    if shortfall:
        click.echo(shortfall, err=True)
        sys.exit(ExitCode.NOT_RELIABLE)


@dataclass(frozen=True)
class Limits:
    """When a measurement stops, and whether its range follows the signals."""

    touches: int | None
    seconds: float
    recentre: bool

    def is_any(self) -> bool:
        """Return whether anything is limited or may change during the measurement."""
        return self.touches is not None or self.seconds < inf or self.recentre

    def is_reached(self, printer: "MeasurementPrinter") -> bool:
        """Return whether there are enough touches or seconds."""
        if self.touches is not None and printer.has(self.touches):
            return True
        return printer.elapsed_s >= self.seconds


def _shortfall(source: str, stream: "Stream", touches: int) -> str:
    """Return what the measurement lacks, else ""."""
    if not stream.counters.read:
        return f"{source}: no sample came: check that it measures, or give --seconds more time"
    measured = len(stream.touches)
    if measured < touches:
        return f"{measured} of {touches} touches were measured"
    return ""


def measure(
    stream: "Stream",
    printer: "MeasurementPrinter",
    limits: Limits,
) -> None:
    """Measure until the source ends or a limit is reached."""
    recentring = _Recentring(stream)
    with stream, ExitStack() as cleanup:
        if limits.seconds < inf and stream.source.live:  # ends also if no samples come
            timer = Timer(limits.seconds + _GRACE_S, stream.stop)
            timer.daemon = True
            timer.start()
            cleanup.callback(timer.cancel)
        for _ in stream.batches():
            if limits.recentre:
                recentring.update()
            if limits.is_reached(printer):
                break
    printer.print_cut()
    if isinstance(stream.error, ProtocolError):  # also if the limits were reached before it
        raise stream.error


class _Recentring:
    """Sets the range again each time that a channel has left it without a touch."""

    def __init__(self, stream: "Stream") -> None:
        self._stream = stream
        self._was_outside = False

    def update(self) -> None:
        """Set the range again, once until the channels are inside again."""
        is_outside = bool(self._stream.out_of_range)
        if is_outside and not self._was_outside:
            try:
                self._stream.centre()
            except RuntimeError as error:
                print_message(str(error))
        self._was_outside = is_outside


def _count_text(stream: "Stream") -> str:
    """Return the number of rows, and of samples that are missing or wrong."""
    counters = stream.counters
    counts = {
        "lost": counters.lost,
        "late": counters.late,
        "not written": counters.unrecorded,
        "not estimated": counters.dropped,
        "samples without a value": counters.refused,
        "saturated": counters.saturated,
        "times a wrong baseline": counters.retaken,
        "errors of the source": counters.errors,
    }
    parts = [f"{counters.recorded} rows"]
    for name, count in counts.items():
        if count:
            parts.append(f"{count} {name}")
    if not stream.touches:
        parts.append("no touch")
    return ", ".join(parts)


@contextmanager
def signals_stop(stream: "Stream") -> Iterator[list[int]]:
    """Let Ctrl-C, SIGTERM and a closed terminal end the measurement, not the program.

    Yields the list of signals that were received.
    """
    received: list[int] = []

    def handle(number: int, _: object) -> None:
        received.append(number)
        if not stream.stop():
            raise KeyboardInterrupt

    with handle_signals(handle, signal.SIGINT, signal.SIGTERM):
        yield received
