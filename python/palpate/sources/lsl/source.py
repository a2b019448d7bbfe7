"""Samples of a stream of Lab Streaming Layer."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from threading import Event
from typing import Any, Self

from palpate.errors import DeviceNotFound, ProtocolError, SourceError, SourceTimeout
from palpate.samples import Sample
from palpate.sources.base import Gap, Source
from palpate.sources.lsl.channels import Asked, channels_of
from palpate.sources.lsl.finding import search, told
from palpate.sources.lsl.library import library
from palpate.sources.lsl.numbering import Numbering
from palpate.sources.lsl.times import Times

_TURN_S = 0.1  # of a call of liblsl: an interruption ends between two
_ANSWER_S = 5.0
_SILENT_S = 5.0
_LOOK_S = 1.0
_STREAK = 100


class LslSource(Source):
    """Two channels of a stream, as samples.

    Connections are not recovered by liblsl, which would do it without a word, but here: with a message, a gap, and the
    number of the samples that are missing, as far as it can be known.

    Parameters
    ----------
    info : pylsl.StreamInfo
        The stream.
    asked : Asked
        Its channels.
    stamps : str, optional
        "host" or "converter", as in `Source.describe`; default: as the stream says, else "host".
    replug : float
        Longest time to wait for a stream that is lost, s.

    Raises
    ------
    ValueError
        The channels or their unit are not known.
    SourceError
        The stream does not answer.
    """

    def __init__(self, info: Any, asked: Asked, stamps: str | None = None, replug: float = 30.0) -> None:
        self._asked, self._stamps, self._replug_s = asked, stamps, replug
        self._stopped = Event()
        self._zero = time.monotonic_ns()
        self._times, self._numbering = Times(self._zero), Numbering()
        self._gaps: list[Gap] = []
        self._errors = self._reconnects = self._streak = 0
        self._inlet: Any = None
        self._begun = self._silent = False
        self._heard_s = 0.0
        self._connect(info)

    def __enter__(self) -> Self:
        """Begin to receive."""
        self._begin()
        return self

    def __iter__(self) -> Iterator[Sample]:
        """Return the samples.

        Raises
        ------
        DeviceNotFound
            The stream is lost, and does not come back.
        ProtocolError
            Its stamps or its channels are not what they are said to be.
        """
        if not self._begun:
            self._begin()
        lost_error = library().util.LostError
        while not self._stopped.is_set() and (inlet := self._inlet):
            try:
                row, stamp_s = inlet.pull_sample(_TURN_S)
                is_lost = row is None and not self._answers()
            except lost_error:
                is_lost = True
            if is_lost:
                self._reconnect()
            elif row is not None and (sample := self._sample(row, stamp_s, inlet)):
                yield sample

    def describe(self) -> dict[str, Any]:
        """Return the stream, its channels, and what its description says of the instrument."""
        info, said = self._info, self._said()
        period_s = _positive(said.get("period_s", "")) or (1 / rate if (rate := info.nominal_srate()) > 0 else None)
        numbers = {"period_s": period_s, "full_scale_pF": _positive(said.get("full_scale_pF", ""))}
        return {
            "name": "LSL stream",
            "stream": {
                "name": info.name(),
                "type": info.type(),
                "source_id": info.source_id(),
                "host": info.hostname(),
            },
            "channels": self._channels.names,
            "clock": f"{self._times.clock}; ns since the stream was opened",
            "stamps": self._stamps or ("converter" if said.get("stamps") == "converter" else "host"),
            **{name: value for name, value in numbers.items() if value},
        }

    def _said(self) -> dict[str, str]:
        """Return what palpate's own stream says of its instrument; of another stream nothing."""
        acquisition = self._info.desc().child("acquisition")
        names = ("period_s", "full_scale_pF", "stamps") if self._channels.numbered else ()
        return {name: acquisition.child_value(name) for name in names}

    @property
    def counters(self) -> dict[str, int]:
        """Samples that were refused, because their stamps go back (`errors`), and `reconnects`."""
        return {"errors": self._errors, "reconnects": self._reconnects}

    @property
    def gaps(self) -> Sequence[Gap]:
        """Where the stream was lost, or its sender had a gap or began again."""
        return self._gaps

    @property
    def zero_ns(self) -> int | None:
        """Opening of the stream on the clock of the computer."""
        return self._zero

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped.set()

    def close(self) -> None:
        """Close the stream."""
        self._stopped.set()
        self._inlet = None

    def _connect(self, info: Any) -> None:
        """Connect to a stream, and read its description."""
        inlet = library().StreamInlet(info, recover=False)
        self._info = self._patiently(inlet.info)
        self._channels = channels_of(self._info, self._asked)
        self._inlet = inlet

    def _begin(self) -> None:
        """Measure the difference of the clocks, which takes some 0.5 s, and then let the samples come."""
        self._begun, self._silent = True, False
        try:
            correction_s = self._patiently(self._inlet.time_correction)
        except SourceTimeout:
            correction_s = None
        self._times.begin(correction_s, self._info.hostname())
        self._patiently(self._inlet.open_stream)
        self._heard_s = time.monotonic()

    def _patiently(self, call: Callable[[float], Any]) -> Any:
        """Call a function of an inlet in turns, until it answers or this is stopped."""
        until = time.monotonic() + _ANSWER_S
        while time.monotonic() < until and not self._stopped.is_set():
            try:
                return call(_TURN_S)
            except library().util.TimeoutError:
                continue
            except library().util.LostError as error:
                raise DeviceNotFound("lsl: the stream ended while it was opened: start it again") from error
        raise SourceTimeout(f"lsl: the stream does not answer within {_ANSWER_S:g} s: is TCP or UDP blocked?")

    def _answers(self) -> bool:
        """Return whether a stream that sends nothing is still there; asked every 5 s, and told once."""
        if time.monotonic() - self._heard_s < _SILENT_S:
            return True
        if not search({"uid": self._info.uid()}, _LOOK_S, self._stopped.is_set, others_s=0.0):
            return self._stopped.is_set()
        if not self._silent:
            self.notify(f"lsl: the stream {told(self._info)} sends no sample for {_SILENT_S:g} s")
        self._silent, self._heard_s = True, time.monotonic()
        return True

    def _reconnect(self) -> None:
        info, self._inlet = self._info, None
        name, begun = told(info), time.monotonic()
        self.notify(f"lsl: the stream {name} was lost. Waiting for it, up to {self._replug_s:g} s.")
        wanted = {"name": info.name(), "type": info.type(), "source_id": info.source_id()}
        wanted = {key: value for key, value in wanted.items() if value}
        while not self._stopped.is_set():
            for found in search(wanted, _LOOK_S, self._stopped.is_set, others_s=0.0)[:1]:
                with suppress(SourceError):  # it ended again
                    self._connect(found)
                    self._begin()
                    away_s = time.monotonic() - begun
                    self._reconnects += 1
                    self._numbering.reconnected(f"the stream {name} was away for {away_s:.1f} s", self._period_ns())
                    return
            if time.monotonic() - begun > self._replug_s:
                raise DeviceNotFound(f"lsl: the stream {name} was lost: start its sender again")

    def _period_ns(self) -> float:
        period_s: float = self.describe().get("period_s", math.inf)
        return period_s * 1e9

    def _sample(self, row: Sequence[float], stamp_s: float, inlet: Any) -> Sample | None:
        """Return a sample; None: it came before, or its stamp goes back."""
        self._silent, self._heard_s = False, time.monotonic()
        t_ns = self._times.t_ns(stamp_s, inlet)
        if self._times.remark:
            self.notify(f"lsl: the stream {told(self._info)}: {self._times.remark}")
            self._times.remark = ""
        if t_ns is None:
            self._refuse()
            return None
        self._streak = 0
        place = self._numbering.place(self._channels.count(row, "seq"), self._channels.count(row, "gaps"), t_ns)
        if place is None:
            return None
        if place.gap:
            self._gaps.append(Gap(place.seq, place.gap))
        values = self._channels.values(row)
        status = self._channels.status(row, values)
        return Sample(place.seq, t_ns, t_ns + self._channels.offset_ns(row), -1, -1, *values, status)

    def _refuse(self) -> None:
        self._errors, self._streak = self._errors + 1, self._streak + 1
        if self._streak == _STREAK:
            raise ProtocolError(
                f"lsl: the time stamps of {_STREAK} samples lie before the one before, allowed: rising ones"
            )


def _positive(text: str) -> float | None:
    """Return a number above 0; None: it is not one."""
    try:
        return found if 0 < (found := float(text)) < math.inf else None
    except ValueError:
        return None
