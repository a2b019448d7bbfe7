"""The terminal as a listener of a measurement."""

import errno
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import click

from palpate import Judgement, PalpateError, Touch, Uncertainty
from palpate.ad7746.registers import linearity_pF
from palpate.cli import touch_table
from palpate.cli.exit_codes import ErrorReport
from palpate.cli.output import print_message
from palpate.judgements import judgement_notes
from palpate.stream import Stream
from palpate.stream.batches import Batch
from palpate.stream.listeners import Listener

_STATUS_INTERVAL_S = 0.2
_LONGEST_WAIT_S = 5.0  # for the revised result of the last touch


class TouchCounter(Listener):
    """Prints to standard error that a touch has ended, and how many are wanted."""

    def __init__(self, wanted: int) -> None:
        self._wanted = wanted
        self._ended = 0

    def touch(self, number: int, touch: Touch) -> None:
        """Print the number of a touch that is new."""
        if number > self._ended:
            self._ended = number
            print_message(f"touch {number} of {self._wanted} has ended")


class MeasurementPrinter(Listener):
    """Prints a row for each touch when its result is final; on a terminal also a status line.

    A result is final when it is revised, with the baseline after the release; or when the next
    touch or the end comes before that.
    """

    def __init__(self, stream: Stream, *, quiet: bool) -> None:
        self.elapsed_s = 0.0
        self._stream = stream
        self._quiet = quiet
        self._first_ns: int | None = None
        self._ends_s: list[float] = []  # elapsed time at the end of each touch
        self._cut = 0  # touches that ended because the samples did
        self._running = True
        self._header_is_printed = False
        self._waiting: tuple[int, Touch] | None = None  # a touch that is not revised yet
        self._judgements: list[Judgement] = []
        # advice, which a revised touch has again, and judgements
        self._was_printed: set[str] = set()
        self._status_time_s = 0.0
        self._status_width = 0
        self._output_error: OSError | None = None

    def batch(self, batch: Batch) -> None:
        """Update the elapsed time, and show the state."""
        self._running = len(batch.samples) > 0
        if self._running:
            times = batch.samples["t_hard_ns"]
            if self._first_ns is None:
                self._first_ns = int(times[0])
            self.elapsed_s = (int(times[-1]) - self._first_ns) / 1e9
        self._show_status()

    def judgement(self, judgement: Judgement) -> None:
        """Print a judgement; of many alike the first ones, `print_cut` counts the others."""
        self._judgements.append(judgement)
        if judgement.text in judgement_notes(self._judgements):
            self._print_note(judgement.text)

    def _print_note(self, note: str) -> None:
        if note not in self._was_printed:
            self._was_printed.add(note)
            self.clear_status()
            print_message(note)

    def touch(self, number: int, touch: Touch) -> None:
        """Print the row of a touch, or keep the touch until it is revised."""
        is_new = number > len(self._ends_s)
        is_cut = is_new and not self._running
        if is_new:
            self._ends_s.append(self.elapsed_s)
        if is_cut:
            self._cut += 1
        if self._waiting and self._waiting[0] != number:
            self._print_waiting()
        self._waiting = (number, touch)
        if touch.revised or not touch.effects or is_cut:
            self._print_waiting(is_cut=is_cut)

    def _print_waiting(self, *, is_cut: bool = False) -> None:
        """Print the row of the touch that waits, if any, and the advice that was not printed yet."""
        if self._waiting is None:
            return
        number, touch = self._waiting
        self._waiting = None
        if self._quiet:
            return
        [uncertainty] = self._uncertainties([touch])
        lines = [touch_table.touch_row(number, touch, uncertainty)]
        if not self._header_is_printed:
            self._header_is_printed = True
            lines.insert(0, "  ".join(touch_table.HEADER))
        for advice in touch_table.advice_lines([touch], first=number, cut=int(is_cut)):
            if advice not in self._was_printed:
                self._was_printed.add(advice)
                lines.append(advice)
        self.clear_status()
        self._print("\n".join(lines))

    def _print(self, text: str) -> None:
        """Print to standard output; if that fails, the measurement goes on, and `finish` fails.

        The stream keeps text that it could not write, and writes it with the next one.
        """
        if isinstance(self._output_error, BrokenPipeError):
            return
        try:
            click.echo(text)
        except OSError as error:
            if self._output_error is None:
                reason = "was closed" if error.errno == errno.EPIPE else f"fails: {error.strerror}"
                print_message(
                    f"standard output {reason}: rows of touches are not printed; the recording "
                    "goes on"
                )
            if error.errno != errno.EPIPE:
                error.filename = "standard output"
            self._output_error = error
        else:
            self._output_error = None

    def finish(self) -> None:
        """Raise the error of rows that could not be printed."""
        if self._output_error:
            raise self._output_error

    def print_cut(self) -> None:
        """Print the touch that was running when the measurement was stopped, and what is left."""
        self._running = False
        self._print_waiting()
        for note in judgement_notes(self._judgements):
            self._print_note(note)
        first = len(self._ends_s)
        for number, touch in enumerate(self._stream.tracker.touches_since(first), first + 1):
            self.touch(number, touch)

    def has(self, touches: int) -> bool:
        """Return whether there are enough touches, the last one revised if that comes soon."""
        if len(self._ends_s) < touches:
            return False
        last = self._stream.tracker.touches_since(touches - 1)[0]
        if last.revised or not last.effects:
            return True
        return self.elapsed_s - self._ends_s[touches - 1] >= _LONGEST_WAIT_S

    def document(self, file: Path, error: PalpateError | None) -> dict[str, object]:
        """Return the result for JSON."""
        touches = self._stream.touches
        return {
            "file": str(file),
            "seconds": self.elapsed_s,
            "counters": self._stream.counters.as_dict(),
            "judgements": [judgement.as_dict() for judgement in self._judgements],
            "touches": touch_table.touch_records(
                touches, self._uncertainties(touches), cut=self._cut
            ),
            "error": asdict(ErrorReport.of_file(error)) if error else None,
        }

    def _uncertainties(self, touches: Iterable[Touch]) -> list[Uncertainty]:
        """Return the uncertainties of touches; no specimen is known, so the scatter is assumed."""
        linearity = linearity_pF(self._stream.tracker.settings["full_scale"])
        return [Uncertainty.of(touch, linearity_pF=linearity) for touch in touches]

    def clear_status(self) -> None:
        """Clear the status line."""
        if self._status_width:
            print_message("\r" + " " * self._status_width + "\r", nl=False)
            self._status_width = 0

    def _show_status(self) -> None:
        now_s = time.monotonic()
        if not sys.stderr.isatty() or now_s - self._status_time_s < _STATUS_INTERVAL_S:
            return
        counters = self._stream.counters
        tracker = self._stream.tracker
        text = f"{self.elapsed_s:.1f} s, {counters.read} pairs, {counters.lost} lost, "
        text += tracker.state
        if tracker.state == "contact":
            ratio = Uncertainty.of_ratio(tracker.ratio, tracker.standard_error)
            text += f", ratio {ratio}"
        elif self._waiting:
            number, touch = self._waiting
            [uncertainty] = self._uncertainties([touch])
            text += f", touch {number}: ratio {uncertainty}"
        print_message(f"\r{text:{self._status_width}}", nl=False)
        self._status_time_s = now_s
        self._status_width = len(text)
