"""A small writer of XDF files, by the specification 1.0 of the format (github.com/sccn/xdf)."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import ArrayLike

BOUNDARY = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_CODES = {"float32": "<f4", "double64": "<f8", "int16": "<i2", "int32": "<i4"}


@dataclass
class Stream:
    """A stream: times of the sender, s; values, shape (n, channels)."""

    name: str
    times: Sequence[float]
    values: ArrayLike
    labels: Sequence[str] = ()
    unit: str = "pF"
    kind: str = "double64"
    rate: float = 0.0
    offsets: Sequence[tuple[float, float]] = field(default_factory=list)

    @property
    def xml(self) -> str:
        channel = "<channel><label>{}</label><unit>{}</unit></channel>"
        each = "".join(channel.format(escape(label), escape(self.unit)) for label in self.labels)
        return (
            f'<?xml version="1.0"?><info><name>{escape(self.name)}</name><type>tactile</type>'
            f"<channel_count>{np.shape(self.values)[1]}</channel_count><nominal_srate>{self.rate}</nominal_srate>"
            f"<channel_format>{self.kind}</channel_format><desc><channels>{each}</channels></desc></info>"
        )


def chunk(tag: int, content: bytes) -> bytes:
    """Return a chunk with its length."""
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def written(*streams: Stream, part: int = 7) -> bytes:
    """Return an XDF file; the samples of a stream are in chunks of `part`."""
    data = b"XDF:" + chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>')
    data += b"".join(
        chunk(2, struct.pack("<I", at) + stream.xml.encode())
        for at, stream in enumerate(streams, 1)
    )
    for number, stream in enumerate(streams, 1):
        for begin in range(0, len(stream.times), part):
            data += chunk(3, _samples(number, stream, slice(begin, begin + part)))
        data += b"".join(
            chunk(4, struct.pack("<Idd", number, *offset)) for offset in stream.offsets
        )
        data += chunk(5, BOUNDARY) + chunk(
            6, struct.pack("<I", number) + b'<?xml version="1.0"?><info></info>'
        )
    return data


def _samples(number: int, stream: Stream, which: slice) -> bytes:
    times = stream.times[which]
    content = struct.pack("<IBI", number, 4, len(times))
    for time, row in zip(times, np.asarray(stream.values, object)[which], strict=True):
        content += struct.pack("<Bd", 8, time)
        content += b"".join(_value(stream.kind, value) for value in np.atleast_1d(row))
    return content


def _value(kind: str, value: object) -> bytes:
    if kind == "string":
        text = str(value).encode()
        return struct.pack("<BB", 1, len(text)) + text
    return np.asarray(value, _CODES[kind]).tobytes()
