"""A stream of Lab Streaming Layer as a source, `lsl:NAME`; and the library, with the offset of its clock."""

import math
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Self

from palpate import errors
from palpate.errors import DeviceNotFound, ProtocolError, need
from palpate.importers.units import PICOFARADS, checked_unit, unit_read
from palpate.messages import listed, quoted, shortened
from palpate.samples import Sample, Status
from palpate.source_events import Gap, GapCause, SourceEvent
from palpate.sources.base import SampleSource, Stoppable
from palpate.sources.line_protocol import COLUMNS, LineColumn
from palpate.sources.options import Check, checked, choice, number, text

# Labels of the channels of palpate's own stream of samples. gaps: number of gaps of the source so far.
SAMPLES = ("hard_pF", "soft_pF", "soft_offset_s", "seq", "status", "gaps")
MANUFACTURER = "palpate"  # in the description of palpate's own streams
NUMBERS = (1, 2, 4, 5, 6, 7)  # the formats of LSL but 3, text
_SILENT = (
    "[log]\nlevel = -3\n"  # fatal errors only: palpate reports itself what happens to a stream
)

WAIT_S = 5.0
_POLL_S = 0.05
_OTHERS_S = 1.0  # The search waits this long for more streams after each answer: LSL asks twice in this time.
_TURN_S = 0.1  # of a call of liblsl: an interruption ends between two
_ANSWER_S = 5.0
_SILENT_S = 5.0
_LOOK_S = 1.0  # of the search for a stream that was lost, at least
_STREAK = 100  # stamps in a row that go back are an error
# LSL's estimate is better than 0.2 ms. Clocks of two machines count from their starts: they agree to 1 ms by chance alone.
_AGREE_S = 1e-3
_FOREIGN_S = 600.0  # liblsl keeps 360 s of samples
_STEP_NS = (
    1_000_000  # A new estimate of the clocks' difference may be this much below the last one.
)
_MOST = 2.0**53  # of a whole number in a stream


@cache
def library() -> Any:
    """Import pylsl; raises MissingExtra. liblsl prints no messages, unless the user has a configuration file for it."""
    try:
        found = need("pylsl", "lsl")
    except (RuntimeError, OSError) as error:  # from its search for liblsl
        said = str(error).strip().split("\n")[0]
        do = "type: pip install --force-reinstall 'palpate[lsl]', or set PYLSL_LIB to the library"
        raise errors.MissingExtra(f"pylsl finds no liblsl ({said:.100}); {do}") from error
    # liblsl before 1.17.7 has no such call; or there is no home folder
    with suppress(RuntimeError):
        files = [
            Path("lsl_api.cfg"),
            Path("~/lsl_api/lsl_api.cfg").expanduser(),
            Path("/etc/lsl_api/lsl_api.cfg"),
        ]
        if "LSLAPICFG" not in os.environ and not any(file.exists() for file in files):
            found.set_config_content(_SILENT)
    return found


def ahead_ns(pylsl: Any) -> int:
    """Return how far the clock of LSL is ahead of `time.monotonic_ns()`, ns; exactly 0 where they are the same clock."""
    read = [(time.monotonic_ns(), pylsl.local_clock(), time.monotonic_ns()) for _ in range(5)]
    before, lsl_s, after = min(read, key=lambda times: times[2] - times[0])
    lsl_ns = round(lsl_s * 1e9)
    return 0 if before <= lsl_ns <= after else lsl_ns - (before + after) // 2


def _resolver(wanted: Mapping[str, str]) -> Any:
    """Return what looks for the streams with these properties of LSL, from now on."""
    for name, value in wanted.items():
        if '"' in value:
            raise ValueError(f"{name}: got {quoted(value)}, allowed: no text with double quotes")
    predicate = " and ".join(f'{name}="{value}"' for name, value in wanted.items())
    return library().ContinuousResolver(pred=predicate or None)


def search(wanted: Mapping[str, str], limit_s: float) -> list[Any]:
    """Return all streams with these properties, sorted, without their descriptions; empty after the limit."""
    resolver = _resolver(wanted)
    found = list[Any]()
    until = time.monotonic() + limit_s
    while time.monotonic() < until:
        answered = resolver.results()
        if len(answered) > len(found):
            found = answered
            until = time.monotonic() + _OTHERS_S
        time.sleep(_POLL_S)
    return sorted(found, key=told)


def told(info: Any) -> str:
    """Return a stream as a message shows it."""
    marked = f", source_id {quoted(info.source_id())}" if info.source_id() else ""
    return f"{shortened(info.name())} ({shortened(info.type()) or 'no type'}, on {shortened(info.hostname())}{marked})"


class Channels:
    """Which channels of a stream are the two of the probe, with their unit."""

    def __init__(
        self,
        labels: Sequence[str],
        units: Sequence[str],
        asked: Mapping[str, str],
        own: bool = False,
    ) -> None:
        there = [f"{i} ({label})" if label else f"{i}" for i, label in enumerate(labels, 1)]
        # position, and pF of its unit
        self.names = dict[str, str]()
        self._found = list[tuple[int, float]]()
        for name in ("hard", "soft"):
            place = _place(name, labels, asked.get(name), there)
            unit = asked.get("unit") or units[place] or _column(labels[place]).unit
            if unit not in PICOFARADS and not asked.get("unit"):
                said = f"the stream says {quoted(units[place])} for {name}, channel {there[place]}"
                raise ValueError(
                    f"unit: {said}; allowed: unit=, one of {', '.join(PICOFARADS)}, or another, as N"
                )
            self.names[name] = f"{labels[place] or place + 1}, {unit}"
            self._found.append((place, PICOFARADS.get(unit, 1.0)))
        self.unit = unit_read(unit)
        if self._found[0][0] == place:
            raise ValueError(f"hard, soft: got {there[place]} for both, allowed: two channels")
        self._extra = {
            label: labels.index(label) for label in SAMPLES[2:] if own and label in labels
        }
        self.numbered = "seq" in self._extra  # each sample has the number of its sender

    def values(self, row: Sequence[float]) -> tuple[float, float]:
        """Return both capacitances of a sample, pF; nan: none."""
        hard, soft = (float(row[place]) * factor for place, factor in self._found)
        return hard if math.isfinite(hard) else math.nan, soft if math.isfinite(soft) else math.nan

    def own(self, row: Sequence[float], name: str, low: float = 0, high: float = _MOST) -> float:
        """Return a number that only palpate's own streams have; 0: this one has none."""
        value = row[self._extra[name]] if name in self._extra else 0
        if not low <= value <= high:
            raise ProtocolError(f"lsl: {name}: got {value:g}, allowed: {low:g} to {high:g}")
        return value


def _place(name: str, labels: Sequence[str], wanted: str | None, there: Sequence[str]) -> int:
    """Return the channel with the wanted label or position; if nothing is wanted, the one whose label says the name."""
    fits = [
        wanted in (label, str(i)) if wanted else _column(label).role == name
        for i, label in enumerate(labels, 1)
    ]
    found = [i for i, is_so in enumerate(fits) if is_so]
    if len(found) != 1:
        got = quoted(wanted) if wanted else "nothing"
        raise ValueError(
            f"{name}: got {got}, allowed: {name}=LABEL or a position from 1, one of {listed(there)}"
        )
    return found[0]


def _column(label: str) -> LineColumn:
    return COLUMNS.get(label.strip().casefold(), LineColumn(""))


def channels_of(info: Any, asked: Mapping[str, str]) -> Channels:
    """Return the channels of a stream with its description; errors as `Channels`, and for a stream of text."""
    if info.channel_format() not in NUMBERS:
        raise ValueError(
            f"lsl: the stream {quoted(info.name())} has no numbers, allowed: a stream of numbers"
        )
    channel = info.desc().child("channels").child("channel")
    labels = []
    units = []
    # a description with fewer of them has empty texts for the rest
    for _ in range(info.channel_count()):
        labels.append(channel.child_value("label"))
        units.append(channel.child_value("unit"))
        channel = channel.next_sibling("channel")
    return Channels(labels, units, asked, info.desc().child_value("manufacturer") == MANUFACTURER)


class LslSource(Stoppable, SampleSource):
    """Two channels of a stream, as samples. Gaps: the stream was lost, or its sender had a gap or began again."""

    zero_ns: int | None = None  # opening of the stream on the clock of the computer

    def __init__(
        self, info: Any, asked: Mapping[str, str], stamps: str | None = None, replug: float = 30.0
    ) -> None:
        self._pylsl = library()
        self._asked = asked
        self._stamps = stamps
        self._replug_s = replug
        super().__init__()
        self.zero_ns = time.monotonic_ns()
        self._to_t_ns = -ahead_ns(self._pylsl) - self.zero_ns
        self._streak = 0  # of samples whose stamps go back: they are refused
        self._away = ""  # why the next sample comes after a gap
        # of the last sample
        self._seq = -1
        self._t_ns = -(2**62)
        self._base = self._sender_gaps = (
            0  # the sender's number of sample 0; the sender's gaps so far
        )
        self._inlet: Any = self._connected(info)

    def __enter__(self) -> Self:
        """Begin to receive."""
        self._patiently(self._inlet.open_stream)
        return self

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the samples."""
        heard_s = time.monotonic()
        while not self._stopped.is_set() and (inlet := self._inlet):
            try:
                row, stamp_s = inlet.pull_sample(_TURN_S)
            except self._pylsl.util.LostError:
                row = None
                heard_s = -math.inf
            if row is not None:
                heard_s = time.monotonic()
                yield from self._read(row, stamp_s)
            elif time.monotonic() - heard_s > _SILENT_S:
                self._reconnect()
                heard_s = time.monotonic()

    def describe(self) -> dict[str, Any]:
        """Return the stream, its channels, and what its description says of the instrument."""
        info = self._info
        acquisition = self._info.desc().child("acquisition")
        # of palpate's own streams
        said = acquisition.child_value if self._channels.numbered else (lambda _: "")
        rate = info.nominal_srate()
        period_s = _positive(said("period_s")) or (1 / rate if rate > 0 else None)
        numbers = {"period_s": period_s, "full_scale_pF": _positive(said("full_scale_pF"))}
        own = {
            "name": info.name(),
            "type": info.type(),
            "source_id": info.source_id(),
            "host": info.hostname(),
        }
        return {
            "name": "LSL stream",
            "stream": own,
            "channels": self._channels.names,
            **({"unit": self._channels.unit} if self._channels.unit != "pF" else {}),
            "clock": f"{self._clock}; ns since the stream was opened",
            "stamps": self._stamps or ("converter" if said("stamps") == "converter" else "host"),
            **{name: value for name, value in numbers.items() if value},
        }

    def close(self) -> None:
        """Close the stream."""
        self._stopped.set()
        self._inlet = None

    def _connected(self, info: Any) -> Any:
        """Connect to a stream, read its description, and compare the clocks; return its inlet."""
        inlet = self._pylsl.StreamInlet(info, recover=False)
        self._info = self._patiently(inlet.info)
        self._channels = channels_of(self._info, self._asked)
        correction_s = self._patiently(inlet.time_correction)
        if self._info.hostname() == socket.gethostname() and abs(correction_s) < _AGREE_S:
            self._clock = "this computer"  # the correction is noise
            return inlet
        self._clock = "the sender, with LSL's time correction"
        return self._pylsl.StreamInlet(
            info, recover=False, processing_flags=self._pylsl.proc_clocksync
        )

    def _patiently(self, call: Callable[[float], Any]) -> Any:
        """Call a function of an inlet in turns, until it answers or this is stopped."""
        until = time.monotonic() + _ANSWER_S
        while time.monotonic() < until and not self._stopped.is_set():
            try:
                return call(_TURN_S)
            except self._pylsl.util.TimeoutError:
                continue
            except self._pylsl.util.LostError as error:
                raise DeviceNotFound(
                    "lsl: the stream ended while it was opened: start it again"
                ) from error
        raise errors.SourceTimeout(
            f"lsl: the stream does not answer within {_ANSWER_S:g} s: is TCP or UDP blocked?"
        )

    def _reconnect(self) -> None:
        """Look for a stream that was lost, or is silent."""
        info = self._info
        self._inlet = None
        name = told(info)
        if not self._away:
            self.notify(
                f"lsl: the stream {name} was lost, or is silent. Waiting for it, up to {self._replug_s:g} s."
            )
        wanted = {"name": info.name(), "type": info.type(), "source_id": info.source_id()}
        resolver = _resolver(
            {key: value for key, value in wanted.items() if value and '"' not in value}
        )

        def connect() -> bool:
            if not (found := resolver.results()):
                return False
            self._inlet = self._connected(found[0])
            self._patiently(self._inlet.open_stream)  # SourceError: it ended again
            self._away = self._away or f"the stream {name} was lost"
            return True

        gone = f"lsl: the stream {name} was lost: start its sender again"
        self._wait_for_replug(connect, max(self._replug_s, _LOOK_S), gone)

    def _read(self, row: Sequence[float], stamp_s: float) -> Iterator[Sample | SourceEvent]:
        """Yield a sample, and the gap before it; nothing if its stamp goes back."""
        if not abs(stamp_s - self._pylsl.local_clock()) < _FOREIGN_S:
            raise ProtocolError(
                f"lsl: got the time stamp {stamp_s:g}, allowed: within {_FOREIGN_S:g} s of LSL's clock"
            )
        t_ns = round(stamp_s * 1e9) + self._to_t_ns
        if t_ns < self._t_ns - _STEP_NS:
            self._errors = self._errors + 1
            self._streak = self._streak + 1
            if self._streak == _STREAK:
                raise ProtocolError(
                    f"lsl: the time stamps of {_STREAK} samples in a row go back, allowed: rising ones"
                )
            return
        self._streak = 0
        self._t_ns = max(t_ns, self._t_ns)
        values = self._channels.values(row)
        offset_s = self._channels.own(row, "soft_offset_s", -1, 1)
        status = (
            int(Status.LOST)
            if math.isnan(sum(values))
            else int(self._channels.own(row, "status", 0, 7))
        )
        gap = self._count(int(self._channels.own(row, "seq")), int(self._channels.own(row, "gaps")))
        if gap:
            yield gap
        yield Sample(
            self._seq, self._t_ns, self._t_ns + round(offset_s * 1e9), -1, -1, *values, status
        )

    def _count(self, number: int, gaps: int) -> Gap | None:
        """Take the number of the sender, which leaves out lost samples, else the next one; return the gap, if there is one."""
        following = self._seq + 1
        gap = Gap(GapCause.DISCONNECTED, self._away) if self._away else None
        self._reconnects += bool(self._away)
        seq = number - self._base if self._channels.numbered else following
        if seq < following or not following:
            if following and not gap:
                gap = Gap(GapCause.RESTARTED, "the sender began again")
            self._base = number - following
            seq = following
        elif gaps > self._sender_gaps and not gap:
            gap = Gap(GapCause.UPSTREAM, "the sender had a gap")
        self._seq = seq
        self._sender_gaps = gaps
        self._away = ""
        return gap


def _positive(text: str) -> float | None:
    """Return a number above 0; None: it is not one."""
    with suppress(ValueError):
        return float(number(0, above=True)("", text))
    return None


# Options that choose a stream -> property of LSL.
_WHICH = {"type": "type", "source_id": "source_id", "host": "hostname"}
_STREAM: dict[str, Check] = {"stamps": choice("converter", "host"), "replug": number(0, 86400)}


def open_lsl(address: str, options: Mapping[str, Any]) -> LslSource:
    """Return the source of `lsl:NAME`: the stream with this name and these options."""
    texts = dict.fromkeys((*_WHICH, "hard", "soft"), text)
    allowed = {**texts, **_STREAM, "unit": checked_unit, "wait": number(0, 86400)}
    given = checked("lsl", options, allowed)
    wanted = {"name": address} if address else {}
    wanted |= {_WHICH[name]: given[name] for name in _WHICH if name in given}
    if not wanted:
        raise ValueError(
            "lsl: got no stream, allowed: lsl:NAME or lsl:?type=TYPE; see `palpate devices --lsl`"
        )
    limit_s: float = given.get("wait", WAIT_S)
    found = search(wanted, limit_s)
    said = ", ".join(f"{name} {quoted(value)}" for name, value in wanted.items())
    if not found:
        ask = "is it running, in the same network? `palpate devices --lsl` lists those that answer"
        raise DeviceNotFound(f"lsl: no stream with {said} answered within {limit_s:g} s: {ask}")
    if len(found) > 1:
        there = f"{listed(list(map(told, found)))}; choose one by its name and ?type=, source_id= or host="
        raise DeviceNotFound(f"lsl: {len(found)} streams have {said}: {there}")
    return LslSource(found[0], given, **{name: given[name] for name in _STREAM if name in given})
