"""Pairs from the lines of a serial port: `serial:`. A line is read as a whole or not at all."""

import math
import re
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from typing import Any

from palpate.ad7746.registers import SATURATED_PF
from palpate.clocks import fine_ns
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, need
from palpate.files import Json
from palpate.line_protocol import (
    LONGEST,
    TIMES,
    Grammar,
    LineColumn,
    LineFormat,
    LineUnit,
    LineValues,
    Refused,
    parse_columns,
    parse_pattern,
    parse_unit,
)
from palpate.messages import shortened
from palpate.samples import Sample, Status
from palpate.source_events import Gap, GapCause, SourceEvent
from palpate.sources.base import TURN_S, SampleSource, Stoppable
from palpate.sources.even_clock import EvenClock
from palpate.sources.options import Options, number, option, whole_number, yes_no
from palpate.sources.port_users import Sharing, refused_as_shared, require_no_reader

# ns after which a counter of 32 bits begins again.
WRAPS = {"ms": 10**6 * 2**32, "us": 10**3 * 2**32}
AHEAD_NS = 2 * 10**9  # A device's clock that gets ahead of the computer's by more was set.
APART_NS = 10**10  # Longest time between the channels of a pair.
RESTARTS = 20  # Pairs in a row that look like a restart of the board are an error.
# No clock is that wrong in this time, but a unit is.
PACE = 3
PACE_S = 10.0
SILENCE_S = 10.0
PATIENCE_S = 10.0
SETTLE_S = 5.0  # Longest time for which the description waits for the first line.
_COMMENTS = 20
_PAUSE_NS = 10**9  # a read takes up to TURN_S


@dataclass(frozen=True)
class SerialOptions(LineFormat, Options):
    """Options of `serial:`."""

    columns: tuple[LineColumn, ...] = option(parse_columns, ())
    """Names of the cells of a line, in order. Default: from the first lines."""
    pattern: re.Pattern[str] | None = option(parse_pattern, None)
    """A regular expression with groups of these names, in place of `columns`."""
    unit: LineUnit = option(parse_unit, LineUnit())
    """Unit of the values, or the size of one count of a converter in pF. Default: pF, or as the names
    say."""
    baud: int = option(whole_number(50, 4_000_000), 115200)
    """Speed of the port, bits a second."""
    reset: bool = option(yes_no, True)
    """Whether opening the port may reset the board; no: DTR and RTS stay inactive."""
    replug: float = option(number(0, 86400), 30.0)
    """Longest time to wait for a port that was unplugged, s."""


def port_error(port: str, error: Exception, system: str = sys.platform) -> SourceError:
    """Return the error of palpate for one of pyserial."""
    text = str(error)
    is_denied = "Permission" in text
    is_shared = "exclusively lock" in text or "busy" in text
    if is_shared or (is_denied and system == "win32"):  # there a port has one user
        return refused_as_shared(port)
    if is_denied:
        return DeviceRefused(
            f"{port}: no permission to open it; `sudo usermod -aG dialout $USER`, then log out and "
            "in again"
        )
    return DeviceNotFound(f"{port} cannot be opened ({text}); `palpate devices` lists the ports")


class Numbering:
    """Numbers and times of the samples; both go on after a restart of the board.

    `unit`: of the times in the lines; "": there are none, and a time is the arrival of a line.
    """

    def __init__(self, unit: str = "") -> None:
        self.lost = 0
        self._next = 0
        self._unit = unit
        self._wrap_ns = WRAPS.get(unit, 0)
        self._before: LineValues | None = None
        self.clock = EvenClock()
        self._clock_ns: int | None = None  # the board's
        self._even_ns = 0  # the same, on an even grid where it has few decimals
        self._begun_ns = 0
        self._arrived_ns = 0
        self._last_ns = 0
        self._restarts = 0
        self._is_paced = False

    def place(
        self, values: LineValues, arrived_ns: int, away_s: float = 0.0
    ) -> tuple[Sample, Gap | None]:
        """Return the sample of a line, and the gap before it, if there is one; raises Refused."""
        sample = values.sample()
        t_hard_ns, t_soft_ns, jump = self._times(values, arrived_ns)
        restart = self._count(values) or jump
        self._restarts += 1
        if not restart:
            self._restarts = 0
        if self._restarts >= RESTARTS:
            unit = f", or its times are not in {self._unit}" if self._unit else ""
            raise ProtocolError(
                f"the board restarts with each line, or does not count up{unit}: {restart}; check "
                "columns="
            )
        gaps = []
        if away_s:
            away = f"the port was unplugged for {away_s:.1f} s"
            gaps.append(Gap(GapCause.DISCONNECTED, away))
        if restart:
            gaps.append(Gap(GapCause.RESTARTED, restart))
        before = self._before or values
        old = f"{before.capdac_hard}, {before.capdac_soft}"
        new = f"{values.capdac_hard}, {values.capdac_soft}"
        if old != new:
            gaps.append(Gap(GapCause.RANGE, f"CAPDAC {old} -> {new}"))
        gap = Gap(gaps[0].cause, "; ".join(each.text for each in gaps)) if gaps else None
        self._before = values
        self._arrived_ns = arrived_ns
        self._last_ns = t_hard_ns
        self._next += 1
        sample = sample._replace(seq=self._next - 1, t_hard_ns=t_hard_ns, t_soft_ns=t_soft_ns)
        return sample, gap

    def _count(self, values: LineValues) -> str:
        """Leave out the numbers of lost pairs; return why the board must have restarted."""
        before = self._before
        if before is None or before.seq is None or values.seq is None:
            return ""
        lost = values.seq - before.seq - 1
        if lost < 0:
            return f"the board restarted: seq {values.seq} after {before.seq}"
        self._next += lost
        self.lost += lost
        return ""

    def _times(self, values: LineValues, arrived_ns: int) -> tuple[int, int, str]:
        """Return the times of both channels, and why the board must have restarted."""
        if not self._unit:
            return arrived_ns, arrived_ns, ""
        is_first = self._clock_ns is None
        before = self._even_ns
        clock_ns, apart = self._clock(values)
        if is_first:
            self._begun_ns = arrived_ns
            now = max(arrived_ns, -apart)
            return now, now + apart, ""
        jump = ""
        waited = max(arrived_ns - self._arrived_ns, 1)
        step = clock_ns - before
        if step < 0 and self._wrap_ns:
            step %= self._wrap_ns
        # Lines that had waited in a buffer are behind, and the ones after them are not.
        behind = max(self._arrived_ns - self._last_ns, 0)
        if not 0 < step <= behind + waited + AHEAD_NS:
            step = waited
            jump = (
                "the board restarted, or its clock was set: "
                f"{clock_ns / 1e9:.6g} s after {before / 1e9:.6g} s"
            )
        now = self._last_ns + step
        if not self._is_paced and arrived_ns - self._begun_ns >= PACE_S * 1e9:
            self._is_paced = True
            if waited < PACE_S * 1e9:  # else the computer slept meanwhile
                self._check_unit(now - self._begun_ns, arrived_ns - self._begun_ns)
        return now, now + apart, jump

    def _clock(self, values: LineValues) -> tuple[int, int]:
        """Take the board's time of the hard channel.

        Return it, and the time from there to the soft channel; raises Refused.
        """
        hard = values.t if values.t_hard is None else values.t_hard
        if hard is None:
            raise Refused("it has no time")
        step_ns = values.time_step_ns
        if hard == self._clock_ns and not self.clock.may_be_equal(step_ns):
            raise Refused("its time is equal to the one before")
        apart = 0 if values.t_soft is None else values.t_soft - hard
        if self._wrap_ns:  # the counter may begin again between the channels
            apart = (apart + self._wrap_ns // 2) % self._wrap_ns - self._wrap_ns // 2
        if abs(apart) > APART_NS:
            raise Refused(
                f"its channels are {abs(apart) / 1e9:.3g} s apart; allowed: {APART_NS / 1e9:g} s"
            )
        self._clock_ns = hard
        self._even_ns, apart = self.clock.place(hard, apart, step_ns)
        return self._even_ns, apart

    def _check_unit(self, clock_ns: int, computer_ns: int) -> None:
        """Compare the clocks of board and computer."""
        if not 1 / PACE < clock_ns / computer_ns < PACE:
            raise ProtocolError(
                f"the times of the lines are not in {self._unit}: by them {clock_ns / 1e9:.4g} s "
                f"went by in {computer_ns / 1e9:.4g} s of the computer's clock; name their unit, "
                "for example columns=t_us,hard,soft"
            )


# The end of pyserial's message if bytes had come, and were gone when they were read.
_TAKEN = "returned no data"
_TAKEN_S = 0.01


class SerialSource(Stoppable, SampleSource):
    """Pairs from lines of text; gaps: the port was away, the board restarted, its CAPDAC moved."""

    def __init__(self, name: str, options: SerialOptions) -> None:
        self._name = name
        self._options = options
        self._grammar = Grammar(options)
        super().__init__()
        self._begun_ns = fine_ns()
        require_no_reader(name)
        self._port = self._open()
        self._lines = self._read_lines()
        self._early: list[tuple[bytes, int]] = []  # lines that the description read
        self._described: Json = {}
        self._numbering = Numbering()
        self._comments: set[bytes] = set()
        self._gone_s = 0.0  # when the port was lost
        self._away_s = 0.0  # how long it was away since the last pair
        self._is_read = False  # since a line was read, and shown
        self._unread_ns: int | None = None  # arrival of the first line since the last read one
        # arrival of the last pair with both values; infinity: silence was reported
        self._value_ns: float = 0.0
        # lines not read since the last message about them, and the last one
        self._unshown = 0
        self._last = ""
        self._has_lines = False
        self._is_smoothing = False  # the times, which was shown
        self._sharing = Sharing(name)

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs; lines that are not read are counted as errors.

        ProtocolError at the end if another program took lines.
        """
        self.describe()
        try:
            for line, arrived_ns in chain(self._early, self._lines):
                if line:
                    self._has_lines = True
                    yield from self._read(line, arrived_ns)
                yield from self._sharing.changes(self.notify, arrived_ns)
                self._check_silence(arrived_ns)
            self._sharing.require_none(self._errors)
        finally:
            if self._unshown:
                self.notify(
                    f"{self._name}: lines not read: {self._unshown:,}. The last: {self._last}"
                )
            elif not self._has_lines:
                self.notify(
                    f"{self._name}: no line came: check the board, and the baud rate, "
                    f"{self._options.baud}"
                )

    @property
    def counters(self) -> dict[str, int]:
        """Lines that are not read (`errors`), `reconnects`, and `lost` pairs."""
        return {**super().counters, "lost": self._numbering.lost}

    def describe(self) -> Json:
        """Return the settings of the port and the columns; waits up to 5 s for the first line."""
        if self._described:
            return self._described
        grammar = self._grammar
        until = time.monotonic() + SETTLE_S
        while not grammar.columns and time.monotonic() < until:
            early = next(self._lines, None)
            if early is None:
                break
            self._early.append(early)
            with suppress(Refused):
                grammar.read(early[0])
        time_unit = ""
        for role, unit in grammar.columns:
            if role in TIMES:
                time_unit = time_unit or unit
        self._numbering = Numbering(time_unit)
        clock = "arrival of a line"
        stamps = "host"
        if time_unit:
            clock = "clock of the board"
            stamps = "converter"
        self._described = {
            "name": "serial port",
            "port": self._name,
            "baud": self._options.baud,
            "columns": [" ".join(filter(None, column)) for column in grammar.columns],
            "clock": f"{clock}, ns since the port was opened",
            "stamps": stamps,
        }
        if any(role == "hard_raw" for role, _ in grammar.columns):
            self._described["full_scale_pF"] = SATURATED_PF
        if grammar.unit.name != "pF":
            self._described["unit"] = grammar.unit.name
        return self._described

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _open(self) -> Any:
        serial = need("serial", "serial")
        try:
            # Exclusive: of two programs that read a port each gets a part of every line.
            port = serial.Serial(None, self._options.baud, timeout=TURN_S, exclusive=True)
            port.port = self._name
            if not self._options.reset:
                port.dtr = False
                port.rts = False
            port.open()
        except (OSError, ValueError) as error:
            raise port_error(self._name, error) from error
        return port

    def _read_lines(self) -> Iterator[tuple[bytes, int]]:
        """Yield each line and its arrival, and an empty one after each read.

        The first line is left out: it may have been cut.
        """
        rest = b""
        is_cut = True
        looked_ns = 0
        while not self._stopped.is_set():
            try:
                data = self._port.read(max(self._port.in_waiting, 1))
            except OSError as error:  # also of pyserial
                rest = b""
                is_cut = True
                if _TAKEN in str(error) and self._sharing.is_found():
                    self._errors += 1
                    self._stopped.wait(_TAKEN_S)
                else:
                    self._wait_for_port()
                continue
            arrived_ns = fine_ns() - self._begun_ns
            if arrived_ns - looked_ns > _PAUSE_NS:
                self._forget_silence(arrived_ns)
            looked_ns = arrived_ns
            # A line that is too long stays too long, and takes no more memory.
            *parts, rest = re.split(rb"[\r\n]", rest[: LONGEST + 1] + data)
            for part in parts:
                if self._stopped.is_set():
                    return
                if part.strip() and not is_cut:
                    yield part.strip() if len(part) <= LONGEST else part, arrived_ns
                is_cut = False
            yield b"", arrived_ns

    def _wait_for_port(self) -> None:
        gone = f"{self._name} was unplugged"
        limit_s = self._options.replug
        self.notify(f"{gone}. Waiting for it, up to {limit_s:g} s.")
        self._gone_s = time.monotonic()
        self._wait_for_replug(self._reopen, limit_s, f"{gone}: plug it in again")

    def _reopen(self) -> bool:
        self._port.close()
        self._port = self._open()
        self._away_s += time.monotonic() - self._gone_s
        self._reconnects += 1
        return True

    def _show_comment(self, line: bytes) -> None:
        """Show a comment of the board, once."""
        if len(self._comments) < _COMMENTS and line not in self._comments:
            self._comments.add(line)
            self.notify(f"{self._name}: {_quoted(line)}")

    def _read(self, line: bytes, arrived_ns: int) -> Iterator[Sample | Gap]:
        """Yield the pair of a line, and the gap before it; none if it is not read."""
        if line.startswith(b"#"):
            self._show_comment(line)
            return
        try:
            values = self._grammar.read(line)
            sample, gap = self._numbering.place(values, arrived_ns, self._away_s)
        except Refused as refused:
            self._refuse(line, arrived_ns, refused)
            return
        self._away_s = 0.0
        self._unread_ns = None
        self._show_smoothing()
        if not self._is_read:
            self._is_read = True
            self._unshown = 0  # other text of a board that starts is no error
            self._show_first(line, values)
        if sample.status != Status.LOST:
            self._value_ns = arrived_ns
        if gap:
            yield gap
        yield sample

    def _show_first(self, line: bytes, values: LineValues) -> None:
        """Show how the first line is read."""
        grammar = self._grammar
        text = f"{_quoted(line)} -> {values.text(grammar.columns)}"
        if grammar.is_by_order:
            text += "; hard is the first: columns=soft,hard if it is not"
        if not (grammar.form and grammar.form.has_checksum):
            text += "; no checksum *XX: a digit that is lost before the point is not seen"
        self.notify(text)

    def _show_smoothing(self) -> None:
        """Show once that the times have few decimals."""
        clock = self._numbering.clock
        if clock.is_smoothing and not self._is_smoothing:
            self._is_smoothing = True
            step_ms = clock.step_ns / 1e6
            self.notify(f"{self._name}: times have steps of {step_ms:.3g} ms: smoothed")

    def _refuse(self, line: bytes, arrived_ns: int, refused: Refused) -> None:
        """Count a line that is not read; show the 10th, the 100th and so on.

        ProtocolError if no line is read for long.
        """
        self._last = f"{_quoted(line)}. Reason: {refused}"
        if not line.isascii():
            self._last += f". It is not plain text: check the baud rate, {self._options.baud}"
        self._unshown += 1
        if self._is_read and not self._away_s:  # other text of a board that starts is no error
            self._sharing.is_due = True
            self._errors += 1
            if self._errors > 1 and str(self._errors).strip("0") == "1":
                self._unshown = 0
                self.notify(
                    f"{self._name}: {self._errors:,} lines were not read. The last: {self._last}"
                )
        if self._unread_ns is None:
            self._unread_ns = arrived_ns
        limit_s = PATIENCE_S
        if self._is_read:
            limit_s = max(limit_s, self._options.replug)
        if arrived_ns - self._unread_ns >= limit_s * 1e9:
            self._unshown = 0
            raise ProtocolError(f"{self._name}: no line is read. The last: {self._last}")

    def _forget_silence(self, now_ns: int) -> None:
        """Begin to wait again: this program did not read for some time, so nothing could come."""
        self._unread_ns = None
        if self._value_ns < math.inf:
            self._value_ns = now_ns

    def _check_silence(self, now_ns: int) -> None:
        """Report once that no pair with both values comes."""
        if now_ns - self._value_ns > SILENCE_S * 1e9:
            self._value_ns = math.inf
            self.notify(
                f"{self._name}: no pair with both values for {SILENCE_S:g} s: check the board, the "
                f"baud rate, {self._options.baud}, and the probe's connection"
            )


def _quoted(line: bytes) -> str:
    """Return a line as a message shows it."""
    return shortened(repr(line.decode(errors="replace")), 100)


def open_serial(address: str, values: Mapping[str, object]) -> SerialSource:
    """Return the source of `serial:PORT`."""
    options = SerialOptions.parse("serial", values)
    if not address:
        raise ValueError(
            "serial: got no port, allowed: serial:PORT; `palpate devices` lists the ports"
        )
    return SerialSource(address, options)
