"""Pairs from the lines of a serial port: `serial:`. A line is read as a whole or not at all."""

import math
import re
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import chain
from typing import Any

from palpate.ad7746.registers import SATURATED_PF
from palpate.clocks import fine_ns
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, need
from palpate.messages import shortened
from palpate.samples import Sample, Status
from palpate.source_events import Gap, GapCause, SourceEvent
from palpate.sources.base import SampleSource, Stoppable
from palpate.sources.line_protocol import (
    LONGEST,
    OF_LINES,
    TIMES,
    Grammar,
    Refused,
    Values,
    sample_of,
    shown,
)
from palpate.sources.options import Check, checked, number, yes_no

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
_TURN_S = 0.1  # of a read
_COMMENTS = 20


def port_error(port: str, error: Exception, system: str = sys.platform) -> SourceError:
    """Return the error of palpate for one of pyserial."""
    said = str(error)
    denied = "Permission" in said
    # there a port has one user
    if "exclusively lock" in said or "busy" in said or (denied and system == "win32"):
        text = (
            "another program reads it, and each would get a part of the lines: close that program"
        )
        return DeviceRefused(f"{port}: {text}")
    if denied:
        text = (
            "no permission to open it; `sudo usermod -aG dialout $USER`, then log out and in again"
        )
        return DeviceRefused(f"{port}: {text}")
    return DeviceNotFound(f"{port} cannot be opened ({said}); `palpate devices` lists the ports")


class Numbering:
    """Numbers and times of the samples; after a restart of the board both go on from the last sample."""

    # "": no times in the lines; a time is the arrival of a line
    def __init__(self, unit: str = "") -> None:
        self.next = self.lost = 0
        self._unit = unit
        self._wrap_ns = WRAPS.get(unit, 0)
        self._before: Values = {}  # of the last pair
        self._clock_ns: int | None = None  # as the board counts
        self._begun_ns = self._arrived_ns = self._last_ns = self._restarts = 0
        self._is_paced = False

    def place(
        self, values: Values, arrived_ns: int, away_s: float = 0.0
    ) -> tuple[Sample, Gap | None]:
        """Return the sample of a line, and the gap before it, if there is one; raises Refused."""
        sample = sample_of(values)
        t_hard_ns, t_soft_ns, jump = self._times(values, arrived_ns)
        before = self._before
        self._before = values
        restart = self._count(values.get("seq"), before.get("seq")) or jump
        self._restarts = self._restarts + 1 if restart else 0
        if self._restarts >= RESTARTS:
            unit = f", or its times are not in {self._unit}" if self._unit else ""
            why = f"the board restarts with each line, or does not count up{unit}"
            raise ProtocolError(f"{why}: {restart}; check columns=")
        away = f"the port was unplugged for {away_s:.1f} s" if away_s else ""
        old, new = (
            tuple(each.get(f"capdac_{name}") for name in ("hard", "soft"))
            for each in (before, values)
        )
        moved = f"CAPDAC {old[0]}, {old[1]} -> {new[0]}, {new[1]}" if before and old != new else ""
        self._arrived_ns = arrived_ns
        self._last_ns = t_hard_ns
        self.next = self.next + 1
        sample = sample._replace(seq=self.next - 1, t_hard_ns=t_hard_ns, t_soft_ns=t_soft_ns)
        return sample, _gap_of(away, restart, moved)

    def _count(self, seq: int | None, before: int | None) -> str:
        """Leave out the numbers of lost pairs; return why the board must have restarted."""
        if seq is None or before is None:
            return ""
        if seq <= before:
            return f"the board restarted: seq {seq} after {before}"
        self.next = self.next + seq - before - 1
        self.lost = self.lost + seq - before - 1
        return ""

    def _times(self, values: Values, arrived_ns: int) -> tuple[int, int, str]:
        """Return the times of both channels, and why the board must have restarted."""
        if not self._unit:
            return arrived_ns, arrived_ns, ""
        before = self._clock_ns
        (clock_ns, apart) = self._clock(values)
        jump = ""
        if before is None:
            self._begun_ns = arrived_ns
            now = max(arrived_ns, -apart)
            return now, now + apart, ""
        waited = max(arrived_ns - self._arrived_ns, 1)
        step = clock_ns - before
        if step < 0 and self._wrap_ns:
            step %= self._wrap_ns
        if not 0 < step <= waited + AHEAD_NS:
            jump = f"the board restarted, or its clock was set: {clock_ns / 1e9:.6g} s after {before / 1e9:.6g} s"
            step = waited
        now = self._last_ns + step
        self._check_unit(
            (now - self._begun_ns) / 1e9, (arrived_ns - self._begun_ns) / 1e9, waited / 1e9
        )
        return now, now + apart, jump

    def _clock(self, values: Values) -> tuple[int, int]:
        """Take the board's time of the hard channel; return it, and the time from there to the soft one; raises Refused."""
        hard = values.get("t_hard", values.get("t"))
        if hard is None:
            raise Refused("it has no time")
        if hard == self._clock_ns:
            raise Refused("its time is equal to the one before")
        apart = values.get("t_soft", hard) - hard
        if self._wrap_ns:  # the counter may begin again between the channels
            apart = (apart + self._wrap_ns // 2) % self._wrap_ns - self._wrap_ns // 2
        if abs(apart) > APART_NS:
            raise Refused(
                f"its channels are {abs(apart) / 1e9:.3g} s apart; allowed: {APART_NS / 1e9:g} s"
            )
        self._clock_ns = hard
        return hard, apart

    def _check_unit(self, clock_s: float, computer_s: float, waited_s: float) -> None:
        """Compare the clocks of board and computer once; not if the computer slept meanwhile."""
        if self._is_paced or computer_s < PACE_S:
            return
        self._is_paced = True
        if waited_s < PACE_S and not 1 / PACE < clock_s / computer_s < PACE:
            went = f"by them {clock_s:.4g} s went by in {computer_s:.4g} s of the computer's clock"
            do = "name their unit, for example columns=t_us,hard,soft"
            raise ProtocolError(f"the times of the lines are not in {self._unit}: {went}; {do}")


class SerialSource(Stoppable, SampleSource):
    """Pairs from lines of text on a serial port. Gaps: the port was opened again, the board restarted, its CAPDAC changed."""

    def __init__(
        self,
        name: str,
        grammar: Grammar,
        baud: int = 115200,
        replug: float = 30.0,
        reset: bool = True,
    ) -> None:
        self._name = name
        self._grammar = grammar
        self._baud = baud
        self._replug_s = replug
        self._reset = reset
        super().__init__()
        self._begun_ns = fine_ns()
        self._port = self._open()
        self._lines = self._read_lines()
        self._early: list[tuple[bytes, int]] = []  # that the description read
        self._described: dict[str, Any] = {}
        self._numbering = Numbering()
        self._comments: set[bytes] = set()
        self._gone_s = self._away_s = (
            0.0  # when the port was lost; how long it was away since the last pair
        )
        self._is_read = False  # since a line was read, and shown
        self._unread_ns: int | None = (
            None  # arrival of the first line since the last one that was read
        )
        self._value_ns: float = (
            0.0  # arrival of the last pair with both values; infinity: silence was reported
        )
        # lines not read since the last message about them, and the last one
        self._unshown = 0
        self._last = ""
        self._came = False  # any line

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs; lines that are not read are counted as errors."""
        self.describe()
        try:
            for line, arrived_ns in chain(self._early, self._lines):
                pair, gap = self._pair(line, arrived_ns) if line else (None, None)
                self._watch_silence(pair, arrived_ns)
                if gap:
                    yield gap
                if pair:
                    yield pair
        finally:
            if self._unshown:
                self.notify(
                    f"{self._name}: lines not read: {self._unshown:,}. The last: {self._last}"
                )
            elif not self._came:
                self.notify(
                    f"{self._name}: no line came: check the board, and the baud rate, {self._baud}"
                )

    @property
    def counters(self) -> dict[str, int]:
        """Lines that are not read (`errors`), `reconnects`, and `lost` pairs."""
        return {**super().counters, "lost": self._numbering.lost}

    def describe(self) -> dict[str, Any]:
        """Return the settings of the port and the columns of its lines; waits up to 5 s for the first line."""
        if self._described:
            return self._described
        until = time.monotonic() + SETTLE_S
        while (
            not self._grammar.columns
            and time.monotonic() < until
            and (early := next(self._lines, None))
        ):
            self._early.append(early)
            with suppress(Refused):
                self._grammar.read(early[0])
        columns = self._grammar.columns
        unit = next((each.unit for each in columns if each.role in TIMES), "")
        self._numbering = Numbering(unit)
        has_codes = any(each.role == "hard_raw" for each in columns)
        self._described = {
            "name": "serial port",
            "port": self._name,
            "baud": self._baud,
            "columns": [f"{each.role} {each.unit}".strip() for each in columns],
            "clock": f"{'clock of the board' if unit else 'arrival of a line'}, ns since the port was opened",
            "stamps": "converter" if unit else "host",
            **({"full_scale_pF": SATURATED_PF} if has_codes else {}),
            **({"unit": self._grammar.unit} if self._grammar.unit != "pF" else {}),
        }
        return self._described

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _open(self) -> Any:
        serial = need("serial", "serial")
        try:
            # Exclusive: of two programs that read a port each gets a part of every line.
            port = serial.Serial(None, self._baud, timeout=_TURN_S, exclusive=True)
            port.port = self._name
            if not self._reset:
                port.dtr = port.rts = False
            port.open()
        except (OSError, ValueError) as error:
            raise port_error(self._name, error) from error
        return port

    def _read_lines(self) -> Iterator[tuple[bytes, int]]:
        """Yield each line but the first one, which may have been cut, and when it came; an empty one after each read."""
        rest = b""
        is_cut = True
        while not self._stopped.is_set():
            try:
                data = self._port.read(max(self._port.in_waiting, 1))
            except OSError:  # also of pyserial
                self.notify(
                    f"{self._name} was unplugged. Waiting for it, up to {self._replug_s:g} s."
                )
                self._gone_s = time.monotonic()
                self._wait_for_replug(
                    self._reopen, self._replug_s, f"{self._name} was unplugged: plug it in again"
                )
                rest = b""
                is_cut = True
                continue
            arrived_ns = fine_ns() - self._begun_ns
            # What is too long stays too long, and takes no more room.
            *parts, rest = re.split(rb"[\r\n]", rest[: LONGEST + 1] + data)
            for part in parts:
                if part.strip() and not is_cut:
                    yield part.strip() if len(part) <= LONGEST else part, arrived_ns
                is_cut = False
            yield b"", arrived_ns

    def _reopen(self) -> bool:
        self._port.close()
        self._port = self._open()
        self._away_s += time.monotonic() - self._gone_s
        self._reconnects += 1
        return True

    def _pair(self, line: bytes, arrived_ns: int) -> tuple[Sample | None, Gap | None]:
        """Return the pair of a line, and the gap before it; no pair: it is a comment, which is shown once, or not read."""
        self._came = True
        if line.startswith(b"#"):
            if len(self._comments) < _COMMENTS and line not in self._comments:
                self._comments.add(line)
                self.notify(f"{self._name}: {_quoted(line)}")
            return None, None
        try:
            values = self._grammar.read(line)
            sample, gap = self._numbering.place(values, arrived_ns, self._away_s)
        except Refused as refused:
            self._refuse(line, arrived_ns, refused)
            return None, None
        self._away_s = 0.0
        self._unread_ns = None
        if not self._is_read:
            self._is_read = True
            self._unshown = 0  # what a board sends when it starts is no error
            guess = (
                "; hard is the first: columns=soft,hard if it is not"
                if self._grammar.by_order
                else ""
            )
            is_summed = self._grammar.form and self._grammar.form[0]
            sure = (
                ""
                if is_summed
                else "; no checksum *XX: a digit that is lost before the point is not seen"
            )
            self.notify(f"{_quoted(line)} -> {shown(values)}{guess}{sure}")
        return sample, gap

    def _refuse(self, line: bytes, arrived_ns: int, refused: Refused) -> None:
        """Count a line that is not read; show the 10th, the 100th and so on; raise ProtocolError if no line is read for long."""
        hint = (
            "" if line.isascii() else f". It is not plain text: check the baud rate, {self._baud}"
        )
        self._last = f"{_quoted(line)}. Reason: {refused}{hint}"
        self._unshown = self._unshown + 1
        if self._is_read and not self._away_s:  # what a board sends when it starts is no error
            self._errors += 1
            if self._errors > 1 and str(self._errors).strip("0") == "1":
                self.notify(
                    f"{self._name}: {self._errors:,} lines were not read. The last: {self._last}"
                )
                self._unshown = 0
        if self._unread_ns is None:
            self._unread_ns = arrived_ns
        limit_s = max(PATIENCE_S, self._replug_s if self._is_read else 0.0)
        if arrived_ns - self._unread_ns >= limit_s * 1e9:
            self._unshown = 0
            raise ProtocolError(f"{self._name}: no line is read. The last: {self._last}")

    def _watch_silence(self, pair: Sample | None, now_ns: int) -> None:
        """Report once that no pair with both values comes."""
        if pair and pair.status != Status.LOST:
            self._value_ns = now_ns
        elif now_ns - self._value_ns > SILENCE_S * 1e9:
            self._value_ns = math.inf
            check = f"check the board, the baud rate, {self._baud}, and the probe's connection"
            self.notify(f"{self._name}: no pair with both values for {SILENCE_S:g} s: {check}")


def _gap_of(away: str, restart: str, moved: str) -> Gap | None:
    """Return the gap with these texts; "": it does not apply."""
    causes = {away: GapCause.DISCONNECTED, restart: GapCause.RESTARTED, moved: GapCause.RANGE}
    texts = [text for text in (away, restart, moved) if text]
    return Gap(causes[texts[0]], "; ".join(texts)) if texts else None


def _quoted(line: bytes) -> str:
    """Return a line as a message shows it."""
    return shortened(repr(line.decode(errors="replace")), 100)


_OF_PORT: dict[str, Check] = {
    "baud": number(50, 4_000_000, whole=True),
    "reset": yes_no,
    "replug": number(0, 86400),
}


def open_serial(address: str, options: Mapping[str, Any]) -> SerialSource:
    """Return the source of `serial:PORT`."""
    given = checked("serial", options, {**OF_LINES, **_OF_PORT})
    if not address:
        raise ValueError(
            "serial: got no port, allowed: serial:PORT; `palpate devices` lists the ports"
        )
    of_lines, of_port = (
        {name: given[name] for name in kind if name in given} for kind in (OF_LINES, _OF_PORT)
    )
    return SerialSource(address, Grammar(**of_lines), **of_port)
