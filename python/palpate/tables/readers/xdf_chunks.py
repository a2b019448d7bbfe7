"""The chunks of an XDF file (specification 1.0): checked before pyxdf reads them, which believes every length."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from palpate.errors import RecordingError, quoted
from palpate.tables.text.parsing import MOST_COLUMNS

MAGIC = b"XDF:"
MOST_SAMPLES = 20_000_000
"""Samples of all streams, at most: some 6 days of a pair of channels."""
LONGEST_HEADER = 1_000_000
"""Bytes of the header of a stream, at most."""
TORN = "the last chunk is incomplete: left out"

_HEADER, _SAMPLES, _OFFSET, _FOOTER = 2, 3, 4, 6
_BYTES = {"float32": 4, "double64": 8, "int8": 1, "int16": 2, "int32": 4, "int64": 8}
_LENGTHS = {1: "<B", 4: "<I", 8: "<Q"}


class Streams(NamedTuple):
    """What a file has: its whole chunks, the numbers of its streams of numbers, and notes."""

    data: bytes
    numbers: list[int]
    notes: list[str]


class _Stream(NamedTuple):
    name: str
    channels: int
    kind: str


def checked(path: Path, data: bytes) -> Streams:
    """Check all chunks of a file.

    Raises
    ------
    RecordingError
        A chunk contradicts itself or the header of its stream: with the byte where it begins.
    """
    found: dict[int, _Stream] = {}
    samples, end = 0, len(MAGIC)
    for begin, tag, content in _chunks(path, data):
        try:
            samples += _samples_in(tag, content, found)
        except (ValueError, LookupError, struct.error, ElementTree.ParseError) as error:
            raise RecordingError(path, f"an XDF file that is damaged at byte {begin}: {error!s:.200}") from error
        end = begin + len(content)
        if samples > MOST_SAMPLES:
            raise RecordingError(path, f"got more than {MOST_SAMPLES:,} samples, allowed: {MOST_SAMPLES:,}")
    texts = [quoted(each.name) for each in found.values() if each.kind == "string"]
    notes = [f"streams of text are left out: {', '.join(texts)}"] if texts else []
    numbers = [number for number, each in found.items() if each.kind != "string"]
    return Streams(data[:end], numbers, notes + ([TORN] if end < len(data) else []))


def _chunks(path: Path, data: bytes) -> Iterator[tuple[int, int, memoryview]]:
    """Yield where the content of each whole chunk begins, its tag, and its content."""
    view, begin = memoryview(data), len(MAGIC)
    while begin < len(data):
        try:
            length, begin_of_tag = _number(view, begin)
            (tag,) = struct.unpack_from("<H", view, begin_of_tag)
        except struct.error:  # the file ends in it
            return
        except LookupError as error:
            raise RecordingError(path, f"an XDF file that is damaged at byte {begin}: {error}") from error
        end = begin_of_tag + length
        if length < 2:
            raise RecordingError(path, f"an XDF file that is damaged at byte {begin}: a chunk of {length} bytes")
        if end > len(data):
            return
        yield begin_of_tag + 2, tag, view[begin_of_tag + 2 : end]
        begin = end


def _number(view: memoryview, at: int) -> tuple[int, int]:
    """Return a number of 1, 4 or 8 bytes, and where it ends."""
    if at < len(view) and view[at] not in _LENGTHS:
        raise LookupError(f"got a number of {view[at]} bytes, allowed: 1, 4 or 8")
    (size,) = struct.unpack_from("<B", view, at)
    (number,) = struct.unpack_from(_LENGTHS[size], view, at + 1)
    return number, at + 1 + size


def _samples_in(tag: int, content: memoryview, found: dict[int, _Stream]) -> int:
    """Check a chunk, and return how many samples it has; add the stream of a header."""
    if tag not in (_HEADER, _SAMPLES, _OFFSET, _FOOTER):
        return 0
    (number,) = struct.unpack_from("<I", content)
    if tag == _HEADER:
        if number in found:
            raise ValueError(f"a second header of stream {number}")
        found[number] = _header(content[4:])
        return 0
    if number not in found:
        raise ValueError(f"a chunk of stream {number}, which has no header")
    if tag == _OFFSET and len(content) != 20:
        raise ValueError(f"got a clock offset of {len(content)} bytes, allowed: 20")
    return _count(content, found[number]) if tag == _SAMPLES else 0


def _header(xml: memoryview) -> _Stream:
    if len(xml) > LONGEST_HEADER:
        raise ValueError(f"got a header of {len(xml):,} bytes, allowed: {LONGEST_HEADER:,}")
    info = ElementTree.fromstring(bytes(xml).decode("utf-8", "replace"))
    name, count, kind = (info.findtext(tag) or "" for tag in ("name", "channel_count", "channel_format"))
    if not count.isdecimal() or not 1 <= int(count[:10]) <= MOST_COLUMNS:
        raise ValueError(f"channel_count: got {quoted(count)}, allowed: 1 to {MOST_COLUMNS}")
    if kind not in (*_BYTES, "string"):
        raise ValueError(f"channel_format: got {quoted(kind)}, allowed: {', '.join(_BYTES)}, string")
    return _Stream(name, int(count), kind)


def _count(content: memoryview, stream: _Stream) -> int:
    """Return how many samples a chunk has; each has 1 byte and its values, and 8 bytes more if it has its own time."""
    if stream.kind == "string":
        return 0  # not read
    count, at = _number(content, 4)
    times, rest = divmod(len(content) - at - count * (1 + stream.channels * _BYTES[stream.kind]), 8)
    if rest or not 0 <= times <= count:
        raise ValueError(f"got {len(content) - at} bytes for {count} samples of {stream.channels} channels")
    return count
