"""The terminal as a listener of a measurement."""

import sys
import time
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from palpate import PalpateError, Touch, Uncertainty
from palpate.ad7746.registers import linearity_pF
from palpate.cli import touch_table
from palpate.cli.exit_codes import ErrorReport
from palpate.cli.output import print_message
from palpate.stream import Stream
from palpate.stream.estimate import Batch
from palpate.stream.listeners import Listener

_STATE_S = 0.2  # from one line of the state to the next
_REVISED_S = 5.0  # longest wait for the revised result of the last touch


class Printer(Listener):
    """Prints each touch as it ends and as it is revised, and on a terminal a line of the state below them."""

    def __init__(self, stream: Stream, *, quiet: bool) -> None:
        self._stream, self._quiet = stream, quiet
        self.elapsed_s = 0.0
        self._first_ns: int | None = None
        self._enough_s: float | None = None  # when the last touch that is asked for ended
        self._ended = self._cut = 0
        self._running = True  # False: the last touches end because the samples do
        self._outside = False
        self._said: set[str] = set()  # sentences about touches; a revised touch has the same again
        self._shown_s, self._width = 0.0, 0

    def batch(self, batch: Batch) -> None:
        """Count the time, and show the state."""
        self._running = bool(len(batch.samples))
        if self._running:
            times = batch.samples["t_hard_ns"]
            self._first_ns = int(times[0]) if self._first_ns is None else self._first_ns
            self.elapsed_s = (int(times[-1]) - self._first_ns) / 1e9
        self._show_state()

    def touch(self, number: int, touch: Touch) -> None:
        """Print a row, and the sentences that were not printed yet."""
        cut, first = number > self._ended and not self._running, not self._ended
        self._cut += cut
        self._ended = max(self._ended, number)
        if self._quiet:
            return
        self.clear()
        [known] = self._uncertainties([touch])
        advised = touch_table.advised(touch_table.records([touch], [known], cut=int(cut)), number)
        new = [line for line in advised if line not in self._said]
        self._said.update(new)
        click.echo(
            "\n".join(
                ["  ".join(touch_table.HEADER)] * first
                + [touch_table.row(number, touch, known), *new]
            )
        )

    def print_cut(self) -> None:
        """Print the touch that ran when the measurement was stopped."""
        self._running = False
        for number, touch in enumerate(
            self._stream.tracker.touches_since(self._ended), self._ended + 1
        ):
            self.touch(number, touch)

    def has(self, touches: int) -> bool:
        """Return whether there are enough touches, the last one with its revised result if that comes soon."""
        tracker = self._stream.tracker
        if tracker.touch_count < touches:
            return False
        self._enough_s = self.elapsed_s if self._enough_s is None else self._enough_s
        [last] = tracker.touches_since(touches - 1)[:1]
        return last.revised or not last.effects or self.elapsed_s - self._enough_s >= _REVISED_S

    def centre(self) -> None:
        """Set the range again, once each time that it was left without a touch."""
        outside = bool(self._stream.out_of_range)
        if outside and not self._outside:
            try:
                self._stream.centre()
            except RuntimeError as error:
                print_message(str(error))
        self._outside = outside

    def document(self, file: Path, error: PalpateError | None) -> dict[str, Any]:
        """Return the result for JSON."""
        touches = self._stream.touches
        return {
            "file": str(file),
            "seconds": self.elapsed_s,
            "counters": self._stream.counters.as_dict(),
            "touches": touch_table.records(touches, self._uncertainties(touches), cut=self._cut),
            "error": asdict(ErrorReport.of_file(error)) if error else None,
        }

    def _uncertainties(self, touches: Iterable[Touch]) -> list[Uncertainty]:
        """Return those of touches; no specimen is known, so the scatter is assumed."""
        error_pF = linearity_pF(self._stream.tracker.settings["full_scale"])
        return [Uncertainty.of(touch, linearity_pF=error_pF) for touch in touches]

    def clear(self) -> None:
        """Clear the line of the state."""
        if self._width:
            print_message("\r" + " " * self._width + "\r", nl=False)
            self._width = 0

    def _show_state(self) -> None:
        now = time.monotonic()
        if sys.stderr.isatty() and now - self._shown_s >= _STATE_S:
            counters, tracker = self._stream.counters, self._stream.tracker
            text = f"{self.elapsed_s:.1f} s, {counters.read} pairs, {counters.lost} lost, {tracker.state}"
            if tracker.state == "contact":
                text += f", ratio {Uncertainty.of_ratio(tracker.ratio, tracker.standard_error)}"
            print_message(f"\r{text:{self._width}}", nl=False)
            self._shown_s, self._width = now, len(text)
