"""A measurement on Lab Streaming Layer: outlets of samples, estimates and marks."""

import json
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from palpate import __version__, number_format
from palpate.source_events import Gap
from palpate.sources.base import described
from palpate.sources.lsl import MANUFACTURER, SAMPLES, ahead_ns, library
from palpate.stream import Batch, Listener, Stream
from palpate.touch import Touch

__all__ = ["Outlets"]

ESTIMATES = ("ratio", "standard_error", "contact", "touch", "alarm")
"""Labels of the channels of the stream of estimates."""
_UNITS = {"hard_pF": "pF", "soft_pF": "pF", "soft_offset_s": "s"}
_TYPES = {
    "hard_pF": "Capacitance",
    "soft_pF": "Capacitance",
    "soft_offset_s": "Time",
    "ratio": "Ratio",
    "standard_error": "Ratio",
}
_LAST_S = 0.5  # a closed outlet drops the samples that it has not sent yet


class Outlets(Listener):
    """Three streams of a measurement: NAME (samples), NAME-estimates, NAME-marks.

    The time stamp of a sample is its hard conversion, on the clock of LSL. Receivers stay connected
    while one measurement follows another one. If the outlets cannot be made, the stream is closed.

    Parameters
    ----------
    stream : Stream
        Not begun, or begun.
    name : str
        The name of the streams: another one for each measurement that runs at the same time on one
        computer.

    Raises
    ------
    ValueError
        The source is not in real time, so that its times have no place on the clock of LSL.
    MissingExtra
        pylsl is not installed.

    Examples
    --------
    >>> from palpate import Stream
    >>> with Stream("sim:stiff-steady?speed=1") as stream, Outlets(stream, "doctest") as outlets:
    ...     batch = next(stream.batches())
    >>> Outlets(Stream("sim:stiff-steady"))
    Traceback (most recent call last):
    ValueError: lsl: got a source whose times are not those of a clock \
(a file, or a simulation that is not at speed=1), allowed: one in real time
    """

    def __init__(self, stream: Stream, name: str = "palpate") -> None:
        with ExitStack() as on_failure:
            on_failure.callback(stream.close)
            self._pylsl = library()
            self._outlets: list[Any] = []
            self.follow(stream)
            device = described(stream.source)
            for suffix, kind, labels in (
                ("", "Capacitance", SAMPLES),
                ("-estimates", "Estimate", ESTIMATES),
                ("-marks", "Markers", ("mark",)),
            ):
                info = _info(self._pylsl, name + suffix, kind, labels, device)
                self._outlets.append(self._pylsl.StreamOutlet(info))
            on_failure.pop_all()

    def __enter__(self) -> Self:
        """Return the outlets."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close them."""
        self.close()

    def follow(self, stream: Stream) -> None:
        """Send another measurement of the same source; errors as in the constructor."""
        source = stream.source
        if not (source.live and source.real_time):
            raise ValueError(
                "lsl: got a source whose times are not those of a clock "
                "(a file, or a simulation that is not at speed=1), allowed: one in real time"
            )
        self._stream = stream
        self._zero_ns = 0
        self._gaps = 0
        self._gap_texts: list[str] = []  # gaps before the next sample
        self._last_s: float | None = None
        self._early: list[str] = []
        stream.listen(self)

    def gap(self, gap: Gap) -> None:
        """Keep a gap until the next sample."""
        self._gap_texts.append(gap.text)

    def batch(self, batch: Batch) -> None:
        """Send the samples and estimates of a batch, and a mark for each gap and touch."""
        if not self._outlets:
            return
        if len(batch.samples):
            stamps = self._send_samples(batch)
        elif self._last_s is None:
            return
        else:  # the end of the stream
            stamps = np.array([self._last_s])
        while self._early:  # another thread may add one meanwhile
            self._push(self._early.pop(0), stamps[0])
        for place, text in sorted(self._touches(batch)):
            self._push(text, stamps[place])

    def mark(self, kind: str, text: str = "") -> None:
        """Send a mark at the last sample that was sent, or at the first one.

        Parameters
        ----------
        kind : str
            One word: "note", "mark", "tare".
        text : str
        """
        mark = f"{kind} {text}".rstrip()
        if self._last_s is None:
            self._early.append(mark)
        else:
            self._push(mark, self._last_s)

    def close(self) -> None:
        """Close the streams after the pending samples have been sent."""
        if any(outlet.have_consumers() for outlet in self._outlets):
            for _ in range(10):  # a process that stands still loses one part, not all of the time
                time.sleep(_LAST_S / 10)
        self._outlets = []

    def _send_samples(self, batch: Batch) -> NDArray[np.float64]:
        """Return the time stamps."""
        samples = batch.samples
        if self._last_s is None or self._gap_texts:  # the computer may have slept
            epoch = self._stream.epoch
            assert epoch is not None  # of a source in real time, after its first sample
            self._zero_ns = epoch.monotonic_ns + ahead_ns(self._pylsl)
        stamps: NDArray[np.float64] = (samples["t_hard_ns"] + self._zero_ns) / 1e9
        for text in self._gap_texts:
            self._push(f"gap {text}", stamps[0])
        self._gaps += len(self._gap_texts)
        self._gap_texts = []
        values = np.column_stack(
            [
                samples["hard"],
                samples["soft"],
                (samples["t_soft_ns"] - samples["t_hard_ns"]) / 1e9,
                samples["seq"],
                samples["status"],
                np.full(len(samples), self._gaps),
            ]
        )
        self._outlets[0].push_chunk(values, stamps)
        rows = batch.rows
        estimates = np.column_stack([rows[name] for name in ESTIMATES]).astype(float)
        estimates[rows["touch"] == 0, :2] = np.nan  # there is no ratio without a touch
        self._outlets[1].push_chunk(estimates, stamps)
        self._last_s = float(stamps[-1])
        return stamps

    def _touches(self, batch: Batch) -> Iterator[tuple[int, str]]:
        """Yield place and text of each touch that ended or was revised in a batch."""
        rows = batch.rows
        zero_s = self._zero_ns / 1e9
        for number, touch in enumerate(batch.touches, batch.first):
            places = np.flatnonzero(rows["touch"] == number).tolist()
            first = (touch.first_ratio, touch.first_standard_error)  # also if it was revised
            text = _touch_text("touch", number, touch, *first, zero_s)
            yield max(places, default=0), text
        places = np.flatnonzero(rows["revised"]).tolist()
        # at the end of the stream there may be no row
        places += [len(rows) - 1] * (len(batch.revised) - len(places))
        for place, (number, touch) in zip(places, batch.revised, strict=True):
            latest = (touch.ratio, touch.standard_error)
            yield place, _touch_text("revised", number, touch, *latest, zero_s)

    def _push(self, text: str, stamp_s: float) -> None:
        self._outlets[2].push_sample([text], float(stamp_s))


def _info(
    pylsl: Any, name: str, kind: str, labels: Sequence[str], device: Mapping[str, Any]
) -> Any:
    """Return a stream without a rate: each sample has its own stamp."""
    form = pylsl.cf_string if kind == "Markers" else pylsl.cf_double64
    # The same when palpate is started again, so that receivers continue.
    identity = f"{MANUFACTURER} {name} {socket.gethostname()}"
    info = pylsl.StreamInfo(name, kind, len(labels), pylsl.IRREGULAR_RATE, form, identity)
    description = info.desc()
    description.append_child_value("manufacturer", MANUFACTURER)
    info.set_channel_labels(list(labels))
    info.set_channel_units([_UNITS.get(label, "none") for label in labels])
    info.set_channel_types([_TYPES.get(label, "Misc") for label in labels])
    acquisition = description.append_child("acquisition")
    acquisition.append_child_value("version", __version__)
    instrument = device.get("name") or device.get("converter") or ""
    acquisition.append_child_value("instrument", str(instrument))
    acquisition.append_child_value("stamps", device.get("stamps", "converter"))
    for key in ("period_s", "full_scale_pF"):
        if key in device:
            acquisition.append_child_value(key, str(device[key]))
    return info


def _touch_text(
    kind: str, number: int, touch: Touch, ratio: float, standard_error: float, zero_s: float
) -> str:
    """Return the mark of a touch: its kind, and a JSON object with all digits."""
    values = {
        "number": number,
        "ratio": ratio,
        "standard_error": standard_error,
        "start": zero_s + touch.start_s,
        "samples": touch.samples,
        "flags": touch.flags,
    }
    return f"{kind} {json.dumps(number_format.plain(values))}"
