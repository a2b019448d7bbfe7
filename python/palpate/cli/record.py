"""`palpate record`: a measurement without a screen."""

import json
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING, Any

import click

from palpate import PalpateError, digits
from palpate.cli import touches as cli_touches
from palpate.cli.exit import INTERRUPTED, NOT_RELIABLE
from palpate.cli.lsl import lsl_option
from palpate.cli.options import board_options, json_option, opening, recording_options, tracking
from palpate.cli.outputs import OUTPUT, require_free, with_sidecar
from palpate.cli.source import SourceType
from palpate.cli.terminal import say, signals

if TYPE_CHECKING:
    from palpate import Touch
    from palpate._core import _Scene
    from palpate.lsl import Outlets
    from palpate.stream import Stream
    from palpate.stream.estimate import Batch

_PROGRESS_S = 0.2
_GRACE_S = 1.0  # the first sample comes after the begin, and --seconds counts from it
_REVISED_S = 5.0  # longest wait for the revised result of the last touch


@click.command()
@click.argument("source", type=SourceType())
@click.option("-o", "file", required=True, type=OUTPUT, help="The recording to write, NAME.csv: a new file.")
@click.option("--touches", type=click.IntRange(min=1), help="Stop after this number of touches, the last one revised.")
@click.option("--seconds", type=click.FloatRange(min=0, min_open=True), help="Stop after this time, s.")
@click.option("--note", "notes", multiple=True, metavar="TEXT", help="A note for the sidecar; may be repeated.")
@lsl_option
@board_options
@click.option("--recentre", is_flag=True, help="If a channel leaves the range of the converter for 2 s without a touch, "
              "set the range again.")  # fmt: skip
@recording_options
@json_option
def record(
    source: str,
    file: Path,
    touches: int | None,
    seconds: float | None,
    notes: tuple[str, ...],
    lsl: str | None,
    firmware: Path | None,
    excitation: str | None,
    recentre: bool,
    asked: dict[str, Any],
    scene: "_Scene",
    touch_seconds: float | None,
    samples: int | None,
    settings: dict[str, float],
    as_json: bool,
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
    from palpate.stream import Stream

    require_free(with_sidecar(file), force=None)
    how = tracking(touch_seconds, samples, settings)
    try:
        opened = sources.open(source, **opening(firmware, excitation), **asked)
        # A file or a simulation is read ahead, and what is read is recorded: not beyond the end that is asked for, nor in another range.
        ahead = 2 if (touches or seconds or recentre) and not opened.live else None
        stream = Stream(opened, scene=scene, record=file, notes=list(notes), notify=say, capacity=ahead, **how)
        outlets = _outlets(stream, lsl, notes) if lsl else None
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    session = _Session(stream, touches, seconds, outlets=outlets, recentre=recentre, quiet=as_json)
    failure: PalpateError | None = None
    with _interruptible(stream) as came:
        try:
            session.run()
        except PalpateError as error:
            failure = error
        if recorder := stream.recorder:
            written = file if recorder.path.name == file.name else recorder.path  # of a rescue recording: where it is
            session.report(written, as_json, failure)
    if failure:
        raise failure
    if came:
        sys.exit(INTERRUPTED)
    if not stream.counters.read:
        click.echo(f"{source}: no sample came: check that it measures, or give --seconds more time", err=True)
        sys.exit(NOT_RELIABLE)
    if touches and len(stream.touches) < touches:
        click.echo(f"{len(stream.touches)} of {touches} touches were measured", err=True)
        sys.exit(NOT_RELIABLE)


def _outlets(stream: "Stream", name: str, notes: tuple[str, ...]) -> "Outlets":
    """Return the outlets of --lsl."""
    from palpate.lsl import Outlets

    outlets = Outlets(stream, name)
    for note in notes:
        outlets.mark("note", note)
    return outlets


class _Session:
    """One measurement: prints the touches, stops after --touches or --seconds."""

    def __init__(
        self,
        stream: "Stream",
        touches: int | None,
        seconds: float | None,
        *,
        outlets: "Outlets | None",
        recentre: bool,
        quiet: bool,
    ) -> None:
        self._stream = stream
        self._outlets = outlets
        self._touches = touches
        self._seconds = seconds
        self._recentre = recentre
        self._outside = False
        self._quiet = quiet
        self._first_ns: int | None = None
        self._elapsed_s = 0.0
        self._all_s: float | None = None  # when the last touch ended
        self._printed = self._cut = 0
        self._headed = False
        self._said: set[str] = set()  # sentences about touches; a revised touch says them again
        self._progress = _Progress()

    def run(self) -> None:
        """Measure until the stop condition or the end of the source."""
        with self._outlets or nullcontext(), self._stream, _by_the_clock(self._stream, self._seconds):
            for batch in self._stream.batches():
                if self._outlets:
                    self._outlets.send(batch)
                self._count(batch)
                self._print_batch(batch)
                self._centre()
                self._progress.show(self._line)
                if self._enough():
                    break
        for touch in self._stream.tracker.touches_since(self._printed):
            self._print_ended(touch, cut=True)  # it ran when the measurement was stopped

    def report(self, file: Path, as_json: bool, failure: PalpateError | None) -> None:
        """Print the number of rows and of missing samples."""
        self._progress.clear()
        counters = self._stream.counters
        if as_json:
            plain = cli_touches.records(self._stream.touches, cut=self._cut)
            document = {"file": str(file), "seconds": self._elapsed_s, "counters": counters.as_dict(), "touches": plain}
            document["error"] = str(failure) if failure else None
            click.echo(json.dumps(document, indent=2, allow_nan=False))
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
        told = "".join(f", {count} {what}" for what, count in parts.items() if count)
        say(f"{file}: {counters.recorded} rows{told}; file closed")

    def _centre(self) -> None:
        """Set the range again, once each time that it was left without a touch."""
        outside = bool(self._stream.out_of_range)
        if self._recentre and outside and not self._outside:
            try:
                self._stream.centre()
            except RuntimeError as error:
                say(str(error))
        self._outside = outside

    def _count(self, batch: "Batch") -> None:
        if len(batch.samples):
            times = batch.samples["t_hard_ns"]
            self._first_ns = int(times[0]) if self._first_ns is None else self._first_ns
            self._elapsed_s = (int(times[-1]) - self._first_ns) / 1e9

    def _enough(self) -> bool:
        return self._has_all() or (self._seconds is not None and self._elapsed_s >= self._seconds)

    def _has_all(self) -> bool:
        """Return whether there are enough touches, the last one with its revised result if that comes soon."""
        tracker = self._stream.tracker
        if self._touches is None or tracker.touch_count < self._touches:
            return False
        self._all_s = self._elapsed_s if self._all_s is None else self._all_s
        [last] = tracker.touches_since(self._touches - 1)[:1]
        return last.revised or not last.effects or self._elapsed_s - self._all_s >= _REVISED_S

    def _print_batch(self, batch: "Batch") -> None:
        """Print each touch as it ended, then as it was revised, then the next one."""
        revised = dict(batch.revised)
        for number in sorted({*revised, *range(batch.first, batch.first + len(batch.touches))}):
            if number >= batch.first:
                self._print_ended(batch.touches[number - batch.first], cut=not len(batch.samples))
            if number in revised:
                self._print(number, revised[number])

    def _print_ended(self, touch: "Touch", *, cut: bool) -> None:
        self._printed += 1
        self._cut += cut
        self._print(self._printed, touch, cut=cut)

    def _print(self, number: int, touch: "Touch", *, cut: bool = False) -> None:
        if self._quiet:
            return
        self._progress.clear()
        if not self._headed:
            click.echo(cli_touches.HEADER)
            self._headed = True
        click.echo(cli_touches.row(number, touch))
        for line in cli_touches.advised([touch], number, cut=int(cut)).splitlines():
            if line not in self._said:
                self._said.add(line)
                click.echo(line)

    def _line(self) -> str:
        counters, tracker = self._stream.counters, self._stream.tracker
        ratio = (
            f", ratio {digits.plus_minus(tracker.ratio, tracker.standard_error)}" if tracker.state == "contact" else ""
        )
        return f"{self._elapsed_s:.1f} s, {counters.read} pairs, {counters.lost} lost, {tracker.state}{ratio}"


class _Progress:
    """A status line on a terminal, updated in place; no output if stderr is not a terminal."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._shown_s, self._width = 0.0, 0

    def show(self, line: Any) -> None:
        now = time.monotonic()
        if self._terminal and now - self._shown_s >= _PROGRESS_S:
            text = line()
            say(f"\r{text:{self._width}}", nl=False)
            self._shown_s, self._width = now, len(text)

    def clear(self) -> None:
        if self._width:
            say("\r" + " " * self._width + "\r", nl=False)
            self._width = 0


@contextmanager
def _by_the_clock(stream: "Stream", seconds: float | None) -> Iterator[None]:
    """End the measurement of a live source after this time and `_GRACE_S`, also if no samples come."""
    timer = Timer((seconds or 0.0) + _GRACE_S, stream.stop)
    timer.daemon = True
    if seconds is not None and stream.source.live:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


@contextmanager
def _interruptible(stream: "Stream") -> Iterator[list[int]]:
    """Let Ctrl-C, SIGTERM and a closed terminal end the measurement, not the program; yield the received signals."""
    came: list[int] = []

    def handle(number: int, _: object) -> None:
        came.append(number)
        if not stream.stop():
            raise KeyboardInterrupt

    with signals(handle, signal.SIGINT, signal.SIGTERM):
        yield came
