"""Pairs from the lines of a serial port: `serial:`."""

import math
import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.samples import Sample, Status
from palpate.sources.base import Gap, Source
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import TIMES, Given, Values
from palpate.sources.serial.numbering import Numbering
from palpate.sources.serial.pairs import Halves, sample
from palpate.sources.serial.port import Port
from palpate.sources.serial.reading import Reader, Reading

_NO_VALUE_S = 5.0
_SETTLE_S = 5.0
"""Longest time for which the description waits for the first lines."""


class SerialSource(Source):
    """Pairs from lines of text on a serial port.

    The format is found from the first lines, and does not change. A line has the values of both channels, or, with a
    pattern, of one: then a pair is a hard value and the soft value after it. The time of a value is that in its line,
    else the arrival of the line.

    Parameters
    ----------
    port : Port
    given : Given, optional
        What the user says about the lines.
    """

    def __init__(self, port: Port, given: Given | None = None) -> None:
        self._port, self._given = port, given or Given()
        port.tell = self._tell
        self._reader = Reader(self._given, port, self._tell)
        self._readings = self._reader.readings()
        self._early: deque[Reading] = deque()
        self._described: dict[str, Any] | None = None
        self._halves = Halves()
        self._numbering: Numbering | None = None
        self._gaps: list[Gap] = []
        self._away_s, self._why = 0.0, ""
        self._last_ns = 0
        self._value_ns: float | None = None  # arrival of the last pair with both values

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs; lines of another format are counted as errors.

        Raises
        ------
        ProtocolError
            Too many lines are not read.
        DeviceNotFound
            The port is gone.
        """
        while self._early:
            yield from self._take(self._early.popleft())
        for reading in self._readings:
            if reading:
                yield from self._take(reading)

    @property
    def counters(self) -> dict[str, int]:
        """Lines that are not read (`errors`), `reconnects`, and `lost` pairs: incomplete, or in a gap."""
        lost = self._halves.lost + (self._numbering.lost if self._numbering else 0)
        return {"errors": self._reader.errors, "reconnects": self._port.reconnects, "lost": lost}

    @property
    def gaps(self) -> Sequence[Gap]:
        """Where the port was opened again, the board restarted, or its CAPDAC changed."""
        return self._gaps

    def describe(self) -> dict[str, Any]:
        """Return the settings of the port and the format of its lines; waits up to 5 s for the first of them.

        If none came in this time, the times of the samples are those of the arrival.
        """
        if self._described is None:
            if not (self._given.columns or self._given.pattern):
                self._wait_for_lines()
            self._described = self._description()
        return self._described

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._port.interrupt()

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _tell(self, text: str) -> None:
        self.notify(text)

    def _wait_for_lines(self) -> None:
        until = time.monotonic() + _SETTLE_S
        while not self._reader.format and time.monotonic() < until and not self._port.stopped:
            if reading := next(self._readings, None):
                self._early.append(reading)

    def _description(self) -> dict[str, Any]:
        given, settled = self._given, self._reader.format
        columns = settled.columns if settled else given.columns or given.groups
        roles = {column.role for column in columns}
        timed = bool(roles & set(TIMES))
        return {
            "name": "serial port",
            "port": self._port.name,
            "baud": self._port.baud,
            "columns": [f"{column.role} {column.unit}".strip() for column in columns],
            "pattern": given.pattern.pattern if given.pattern else "",
            "unit": given.unit or "pF",
            "clock": f"{'that of the board' if timed else 'arrival of a line'}, ns since the port was opened",
            "stamps": "converter" if timed else "host",
            **({"full_scale_pF": SATURATED_PF} if "hard_raw" in roles and not given.code_pF else {}),
        }

    def _take(self, reading: Reading) -> Iterator[Sample]:
        """Return the samples that this line completes."""
        self._away_s += reading.away_s
        self._why = reading.why or self._why
        if self._away_s or self._why:
            self._halves.clear()
        try:
            for values, arrived_ns in self._halves.pairs(reading.values, reading.arrived_ns):
                yield self._sample(values, arrived_ns)
        except Refused as refused:
            self._reader.refuse(reading.text, refused)

    def _sample(self, values: Values, arrived_ns: tuple[int, int]) -> Sample:
        if not self._numbering:
            by_device = self._described is None or self._described["stamps"] == "converter"
            self._numbering = Numbering(by_device, {column.role: column.unit for column in self._reader.columns})
        numbering, why = self._numbering, self._why
        made = sample(values, self._given.code_pF)
        missing = 0
        if self._away_s:
            period_ns = self._last_ns / numbering.next if numbering.next else math.inf
            missing = max(int((arrived_ns[0] - self._last_ns) / period_ns) - 1, 0)
            why = f"{self._port.name} was unplugged for {self._away_s:.1f} s"
        before = numbering.lost
        place = numbering.place(values, arrived_ns, missing, why)
        if self._away_s:
            self.notify(f"{self._port.name} is back: {numbering.lost - before} pairs lost.")
        if numbering.remark:
            self.notify(f"{self._port.name}: {numbering.remark}")
            numbering.remark = ""
        if place.gap:
            self._gaps.append(Gap(place.seq, place.gap))
            self.notify(f"pair {place.seq}: {place.gap}")
        self._away_s, self._why, self._last_ns = 0.0, "", arrived_ns[0]
        self._require_values(made.status, arrived_ns[0])
        return made._replace(seq=place.seq, t_hard_ns=place.t_hard_ns, t_soft_ns=place.t_soft_ns)

    def _require_values(self, status: int, arrived_ns: int) -> None:
        """Say once that no pair has both values for some time."""
        if status != Status.LOST or self._value_ns is None:
            self._value_ns = arrived_ns
        elif arrived_ns - self._value_ns >= _NO_VALUE_S * 1e9:
            self._value_ns = math.inf
            self.notify(
                f"{self._port.name}: no pair with both values for {_NO_VALUE_S:g} s, the lines say overload, nan or "
                "nothing: check the probe's connection and the range of the instrument"
            )
