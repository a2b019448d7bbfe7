"""A stream of Lab Streaming Layer as a source, `lsl:NAME`; and the library with its clock."""

import math
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

from palpate.errors import DeviceNotFound, MissingExtra, ProtocolError, SourceTimeout, need
from palpate.files import Json
from palpate.importers.units import PICOFARADS, checked_unit, unit_read
from palpate.line_protocol import COLUMNS, LineColumn
from palpate.messages import listed, quoted, shortened
from palpate.samples import Sample, Status
from palpate.source_events import Gap, GapCause, SourceEvent
from palpate.sources.base import TURN_S, SampleSource, Stoppable
from palpate.sources.options import Options, choice, number, option, text

# Labels of the channels of palpate's own stream of samples; gaps: number of them so far.
SAMPLES = ("hard_pF", "soft_pF", "soft_offset_s", "seq", "status", "gaps")
MANUFACTURER = "palpate"  # in the description of palpate's own streams
NUMBERS = (1, 2, 4, 5, 6, 7)  # the formats of LSL but 3, text
# Fatal errors only: palpate itself reports what happens to a stream.
_LOG_SETTINGS = "[log]\nlevel = -3\n"

WAIT_S = 5.0
_POLL_S = 0.05
# The search waits this long for more streams after each answer: LSL asks twice in this time.
_OTHERS_S = 1.0
_ANSWER_S = 5.0
_SILENT_S = 5.0
_LOOK_S = 1.0  # of the search for a stream that was lost, at least
_STREAK = 100  # stamps in a row that go back are an error
# LSL's estimate is better than 0.2 ms. Clocks of two machines count from their starts: they agree
# to 1 ms by chance alone.
_AGREE_S = 1e-3
_FOREIGN_S = 600.0  # liblsl keeps 360 s of samples
# A new estimate of the clocks' difference may be this much below the last one.
_STEP_NS = 1_000_000
_LARGEST = 2.0**53  # whole number in a stream


@dataclass(frozen=True)
class LslOptions(Options):
    """Options of `lsl:`: the stream, its channels with their unit, and the kind of its times."""

    type: str = option(text, "")
    """Type of the stream, if several have the name."""
    source_id: str = option(text, "")
    """Identifier of the stream's source, if several have the name."""
    host: str = option(text, "")
    """Computer that sends the stream, if several do."""
    hard: str = option(text, "")
    """Channel of the hard bump: its label, or its position counted from 1."""
    soft: str = option(text, "")
    """Channel of the soft bump: its label, or its position counted from 1."""
    stamps: str = option(choice("converter", "host"), "")
    """Whose times the stream has: those of the conversions, or of a computer. Default: as the stream
    says, else host."""
    replug: float = option(number(0, 86400), 30.0)
    """Longest time to wait for a stream that has ended, s."""
    unit: str = option(checked_unit, "")
    """Unit of the channels. Default: as the stream says."""
    wait: float = option(number(0, 86400), WAIT_S)
    """Longest time until the stream answers, s."""


@cache
def library() -> Any:
    """Import pylsl; raises MissingExtra. liblsl prints nothing, unless the user configures it."""
    try:
        pylsl = need("pylsl", "lsl")
    except (RuntimeError, OSError) as error:  # from its search for liblsl
        reason = str(error).strip().split("\n")[0]
        do = "type: pip install --force-reinstall 'palpate[lsl]', or set PYLSL_LIB to the library"
        raise MissingExtra(f"pylsl finds no liblsl ({reason:.100}); {do}") from error
    # liblsl before 1.17.7 has no such call; or there is no home folder
    with suppress(RuntimeError):
        files = [
            Path("lsl_api.cfg"),
            Path("~/lsl_api/lsl_api.cfg").expanduser(),
            Path("/etc/lsl_api/lsl_api.cfg"),
        ]
        if "LSLAPICFG" not in os.environ and not any(file.exists() for file in files):
            pylsl.set_config_content(_LOG_SETTINGS)
    return pylsl


def ahead_ns(pylsl: Any) -> int:
    """Return LSL's clock minus `time.monotonic_ns()`, ns; 0 where they are the same clock."""
    read = [(time.monotonic_ns(), pylsl.local_clock(), time.monotonic_ns()) for _ in range(5)]
    before, lsl_s, after = min(read, key=lambda times: times[2] - times[0])
    lsl_ns = round(lsl_s * 1e9)
    return 0 if before <= lsl_ns <= after else lsl_ns - (before + after) // 2


def _resolver(properties: Mapping[str, str]) -> Any:
    """Return a resolver of LSL for the streams with these properties."""
    conditions = []
    for name, value in properties.items():
        if '"' in value:
            raise ValueError(f"{name}: got {quoted(value)}, allowed: no text with double quotes")
        if value:
            conditions.append(f'{name}="{value}"')
    return library().ContinuousResolver(pred=" and ".join(conditions) or None)


def search(properties: Mapping[str, str], limit_s: float) -> list[Any]:
    """Return all streams with these properties, sorted; empty after the limit."""
    resolver = _resolver(properties)
    streams = list[Any]()
    until = time.monotonic() + limit_s
    while time.monotonic() < until:
        answered = resolver.results()
        if len(answered) > len(streams):
            streams = answered
            until = time.monotonic() + _OTHERS_S
        time.sleep(_POLL_S)
    return sorted(streams, key=stream_text)


def stream_text(info: Any) -> str:
    """Return a stream as a message shows it."""
    kind = shortened(info.type()) or "no type"
    marked = f", source_id {quoted(info.source_id())}" if info.source_id() else ""
    return f"{shortened(info.name())} ({kind}, on {shortened(info.hostname())}{marked})"


def _identity(info: Any) -> dict[str, str]:
    """Return the properties by which a stream is found again."""
    return {"name": info.name(), "type": info.type(), "source_id": info.source_id()}


class Channels:
    """Which channels of a stream are the two of the probe, with their unit."""

    def __init__(
        self,
        labels: Sequence[str],
        units: Sequence[str],
        options: LslOptions,
        is_own: bool = False,
    ) -> None:
        texts = [f"{i} ({label})" if label else f"{i}" for i, label in enumerate(labels, 1)]
        self.names = dict[str, str]()
        self._places = list[int]()
        self._factors = list[float]()  # pF of the units
        for name, wanted in (("hard", options.hard), ("soft", options.soft)):
            place = _place(name, labels, wanted, texts)
            unit = options.unit or units[place] or _column(labels[place]).unit
            if unit not in PICOFARADS and not options.unit:
                raise ValueError(
                    f"unit: the stream says {quoted(units[place])} for {name}, channel "
                    f"{texts[place]}; allowed: unit=, one of {', '.join(PICOFARADS)}, or another, "
                    "as N"
                )
            self.names[name] = f"{labels[place] or place + 1}, {unit}"
            self._places.append(place)
            self._factors.append(PICOFARADS.get(unit, 1.0))
        self.unit = unit_read(unit)
        if self._places == [place, place]:
            raise ValueError(f"hard, soft: got {texts[place]} for both, allowed: two channels")
        self._extra = dict[str, int]()
        for label in SAMPLES[2:]:
            if is_own and label in labels:
                self._extra[label] = labels.index(label)
        self.numbered = "seq" in self._extra  # each sample has the number of its sender

    def values(self, row: Sequence[float]) -> list[float]:
        """Return both capacitances of a sample, pF; nan: none."""
        values = []
        for place, factor in zip(self._places, self._factors, strict=True):
            value = float(row[place]) * factor
            values.append(value if math.isfinite(value) else math.nan)
        return values

    def own(self, row: Sequence[float], name: str, low: float = 0, high: float = _LARGEST) -> float:
        """Return a number that only palpate's own streams have; 0: this one has none."""
        value = row[self._extra[name]] if name in self._extra else 0
        if not low <= value <= high:
            raise ProtocolError(f"lsl: {name}: got {value:g}, allowed: {low:g} to {high:g}")
        return value


def _place(name: str, labels: Sequence[str], wanted: str, texts: Sequence[str]) -> int:
    """Return the channel with the wanted label or position, else with the name in its label."""
    places = []
    for place, label in enumerate(labels):
        fits = wanted in (label, str(place + 1)) if wanted else _column(label).role == name
        if fits:
            places.append(place)
    if len(places) != 1:
        got = quoted(wanted) if wanted else "nothing"
        raise ValueError(
            f"{name}: got {got}, allowed: {name}=LABEL or a position from 1, one of {listed(texts)}"
        )
    return places[0]


def _column(label: str) -> LineColumn:
    return COLUMNS.get(label.strip().casefold(), LineColumn(""))


def channels_of(info: Any, options: LslOptions) -> Channels:
    """Return the channels of a stream with its description; errors as `Channels`."""
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
    is_own = info.desc().child_value("manufacturer") == MANUFACTURER
    return Channels(labels, units, options, is_own)


class LslSource(Stoppable, SampleSource):
    """Two channels of a stream; gaps: it was lost, or its sender had a gap or began again."""

    zero_ns: int | None = None  # opening of the stream on the clock of the computer

    def __init__(self, info: Any, options: LslOptions) -> None:
        self._pylsl = library()
        self._options = options
        super().__init__()
        self.zero_ns = time.monotonic_ns()
        self._to_t_ns = -ahead_ns(self._pylsl) - self.zero_ns
        self._streak = 0  # of samples whose stamps go back: they are refused
        self._away = ""  # why the next sample comes after a gap
        # of the last sample
        self._seq = -1
        self._t_ns = -(2**62)
        self._sender_gaps = 0
        self._first_number = 0  # of the sender, for sample 0
        self._inlet: Any = self._connected(info)

    def __enter__(self) -> Self:
        """Begin to receive."""
        self._answer(self._inlet.open_stream)
        return self

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the samples."""
        received_s = time.monotonic()
        while not self._stopped.is_set() and self._inlet:
            try:
                row, stamp_s = self._inlet.pull_sample(TURN_S)
            except self._pylsl.util.LostError:
                row = None
                received_s = -math.inf
            if row is not None:
                received_s = time.monotonic()
                yield from self._read(row, stamp_s)
            elif time.monotonic() - received_s > _SILENT_S:
                self._reconnect()
                received_s = time.monotonic()

    def describe(self) -> Json:
        """Return the stream, its channels, and the instrument in its description."""
        info = self._info
        device: Json = {
            "name": "LSL stream",
            "stream": {**_identity(info), "host": info.hostname()},
            "channels": self._channels.names,
            "clock": f"{self._clock}; ns since the stream was opened",
            "stamps": self._options.stamps or "host",
        }
        if self._channels.unit != "pF":
            device["unit"] = self._channels.unit
        if info.nominal_srate() > 0:
            device["period_s"] = 1 / info.nominal_srate()
        if self._channels.numbered:  # one of palpate's own streams
            acquisition = info.desc().child("acquisition")
            for name in ("period_s", "full_scale_pF"):
                with suppress(ValueError):
                    device[name] = number(0, above=True)(name, acquisition.child_value(name))
            if not self._options.stamps and acquisition.child_value("stamps") == "converter":
                device["stamps"] = "converter"
        return device

    def close(self) -> None:
        """Close the stream."""
        self._stopped.set()
        self._inlet = None

    def _connected(self, info: Any) -> Any:
        """Connect to a stream, read its description, and compare the clocks; return its inlet."""
        inlet = self._pylsl.StreamInlet(info, recover=False)
        self._info = self._answer(inlet.info)
        self._channels = channels_of(self._info, self._options)
        correction_s = self._answer(inlet.time_correction)
        if self._info.hostname() == socket.gethostname() and abs(correction_s) < _AGREE_S:
            self._clock = "this computer"  # the correction is noise
            return inlet
        self._clock = "the sender, with LSL's time correction"
        return self._pylsl.StreamInlet(
            info, recover=False, processing_flags=self._pylsl.proc_clocksync
        )

    def _answer(self, call: Callable[[float], Any]) -> Any:
        """Call a function of an inlet in turns, until it answers or this is stopped."""
        until = time.monotonic() + _ANSWER_S
        while time.monotonic() < until and not self._stopped.is_set():
            try:
                return call(TURN_S)
            except self._pylsl.util.TimeoutError:
                continue
            except self._pylsl.util.LostError as error:
                raise DeviceNotFound(
                    "lsl: the stream ended while it was opened: start it again"
                ) from error
        raise SourceTimeout(
            f"lsl: the stream does not answer within {_ANSWER_S:g} s: is TCP or UDP blocked?"
        )

    def _reconnect(self) -> None:
        """Look for a stream that was lost, or is silent."""
        info = self._info
        self._inlet = None
        lost = f"the stream {stream_text(info)} was lost"
        if not self._away:
            self.notify(
                f"lsl: {lost}, or is silent. Waiting for it, up to {self._options.replug:g} s."
            )
        properties = _identity(info).items()
        resolver = _resolver({name: value for name, value in properties if '"' not in value})

        def connect() -> bool:
            streams = resolver.results()
            if not streams:
                return False
            self._inlet = self._connected(streams[0])
            self._answer(self._inlet.open_stream)  # SourceError: it ended again
            self._away = self._away or lost
            return True

        limit_s = max(self._options.replug, _LOOK_S)
        self._wait_for_replug(connect, limit_s, f"lsl: {lost}: start its sender again")

    def _read(self, row: Sequence[float], stamp_s: float) -> Iterator[Sample | SourceEvent]:
        """Yield a sample, and the gap before it; nothing if its stamp goes back."""
        if not abs(stamp_s - self._pylsl.local_clock()) < _FOREIGN_S:
            raise ProtocolError(
                f"lsl: got the time stamp {stamp_s:g}, allowed: within {_FOREIGN_S:g} s of LSL's "
                "clock"
            )
        t_ns = round(stamp_s * 1e9) + self._to_t_ns
        if t_ns < self._t_ns - _STEP_NS:
            self._errors += 1
            self._streak += 1
            if self._streak == _STREAK:
                raise ProtocolError(
                    f"lsl: the time stamps of {_STREAK} samples in a row go back, allowed: rising "
                    "ones"
                )
            return
        self._streak = 0
        self._t_ns = max(t_ns, self._t_ns)
        channels = self._channels
        hard, soft = channels.values(row)
        offset_ns = round(channels.own(row, "soft_offset_s", -1, 1) * 1e9)
        status = int(Status.LOST)
        if not math.isnan(hard + soft):
            status = int(channels.own(row, "status", 0, 7))
        gap = self._count(int(channels.own(row, "seq")), int(channels.own(row, "gaps")))
        if gap:
            yield gap
        yield Sample(self._seq, self._t_ns, self._t_ns + offset_ns, -1, -1, hard, soft, status)

    def _count(self, number: int, gaps: int) -> Gap | None:
        """Count a sample, and those that the sender's numbers leave out; return the gap before it."""
        following = self._seq + 1
        if following == 0:
            self._first_number = number
            self._sender_gaps = gaps
        self._seq = following
        if self._channels.numbered:
            self._seq = number - self._first_number
        gap = None
        if self._away:
            gap = Gap(GapCause.DISCONNECTED, self._away)
            self._reconnects += 1
        elif self._seq < following:
            gap = Gap(GapCause.RESTARTED, "the sender began again")
        elif gaps > self._sender_gaps:
            gap = Gap(GapCause.UPSTREAM, "the sender had a gap")
        if self._seq < following:
            self._first_number = number - following
            self._seq = following
        self._sender_gaps = gaps
        self._away = ""
        return gap


def open_lsl(address: str, values: Mapping[str, object]) -> LslSource:
    """Return the source of `lsl:NAME`: the stream with this name and these options."""
    options = LslOptions.parse("lsl", values)
    properties = {
        "name": address,
        "type": options.type,
        "source_id": options.source_id,
        "hostname": options.host,
    }
    wanted = ", ".join(f"{name} {quoted(value)}" for name, value in properties.items() if value)
    if not wanted:
        raise ValueError(
            "lsl: got no stream, allowed: lsl:NAME or lsl:?type=TYPE; see `palpate devices --lsl`"
        )
    streams = search(properties, options.wait)
    if not streams:
        raise DeviceNotFound(
            f"lsl: no stream with {wanted} answered within {options.wait:g} s: is it running, in "
            "the same network? `palpate devices --lsl` lists those that answer"
        )
    if len(streams) > 1:
        names = listed(list(map(stream_text, streams)))
        raise DeviceNotFound(
            f"lsl: {len(streams)} streams have {wanted}: {names}; choose one by its name and "
            "?type=, source_id= or host="
        )
    return LslSource(streams[0], options)
