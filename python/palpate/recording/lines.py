"""One pass over the bytes of a recording: whole lines, what is left after them, and checksums."""

import zlib
from collections.abc import Iterator
from itertools import chain, groupby
from pathlib import Path
from typing import NamedTuple

from palpate._core import OwnRows
from palpate.errors import RecordingError
from palpate.recording.rows import COLUMNS, unreadable
from palpate.tables.packed import opened

LONGEST_ROW = 256
"""Bytes; the longest row that palpate writes has some 150."""
_OWN = OwnRows()
_KEPT = 4096  # bytes of a line without an end that are kept: no row is that long


class Piece(NamedTuple):
    """Whole lines of a file.

    `left_out` bytes of the first one, after its first 4096, are not in `data`: it is too long for a row.
    """

    data: bytes
    offset: int
    line: int
    left_out: int


class Damage(NamedTuple):
    """A place in a file that is no row, and was not left by a writer that was stopped.

    Attributes
    ----------
    line, lines : int
        Number of its first line, from 1; number of lines. 0 lines: the header is missing there.
    offset, bytes : int
        Where it begins in the file, and its length.
    rows_before : int
        Rows of the file before it.
    reason : str
    """

    line: int
    lines: int
    offset: int
    bytes: int
    rows_before: int
    reason: str


class Pass:
    """Reads a file once.

    Parameters
    ----------
    path : pathlib.Path
    marked : int, optional
        Number of bytes whose CRC-32 is wanted, too.

    Attributes
    ----------
    size, checksum : int
        Bytes read so far, and their CRC-32.
    joined_checksum : int
        CRC-32 of the same without carriage returns: that of a file whose line ends were changed.
    marked_checksum : int or None
        CRC-32 of the first `marked` bytes; None: the file has not as many.
    filled : int
        Bytes of the file without the zeros at its end.
    tail, tail_offset, tail_line : bytes, int, int
        The first 4096 bytes after the last line end, where that is, and its line; after the last piece.
    complete : bool
        Whether all was read.
    """

    def __init__(self, path: Path, marked: int | None = None) -> None:
        self.path = path
        self._marked = marked
        self.size = self.checksum = self.joined_checksum = self.filled = self.tail_offset = 0
        self.marked_checksum: int | None = None
        self._returns = False
        self.tail, self.tail_line = b"", 1
        self.complete = False

    def pieces(self, chunk: int) -> Iterator[Piece]:
        """Yield the lines of the file that have an end, in order."""
        left_out = 0
        for data in self._chunks(chunk):
            end = data.rfind(b"\n") + 1
            rest = data[end:] if end else self.tail + data
            if end:
                lines = b"".join((self.tail, memoryview(data)[:end]))  # one copy
                yield Piece(lines, self.tail_offset, self.tail_line, left_out)
                self.tail_offset += len(lines) + left_out
                self.tail_line += _OWN.count_lines(lines)
                left_out = 0
            self.tail = rest[:_KEPT]
            left_out += len(rest) - len(self.tail)
        self.complete = True

    def _chunks(self, chunk: int) -> Iterator[bytes]:
        try:
            with opened(self.path) as file:
                while data := file.read(chunk):
                    self.count(data)
                    yield data
        except OSError as error:
            raise RecordingError(self.path, f"cannot be read: {error.strerror or error}") from error

    def count(self, data: bytes) -> None:
        """Count the next bytes."""
        to_mark = -1 if self._marked is None else self._marked - self.size
        if 0 <= to_mark <= len(data):
            self.marked_checksum = zlib.crc32(data[:to_mark], self.checksum)
        self.checksum = zlib.crc32(data, self.checksum)
        self._returns = self._returns or b"\r" in data
        joined = zlib.crc32(data.replace(b"\r", b""), self.joined_checksum) if self._returns else self.checksum
        self.joined_checksum = joined
        if filled := len(data.rstrip(b"\0")):
            self.filled = self.size + filled
        self.size += len(data)


def sift(piece: Piece, rows_before: int, columns: tuple[str, ...] = COLUMNS) -> tuple[bytes, list[Damage]]:
    r"""Return the lines that are rows, and the others as damaged places.

    Examples
    --------
    >>> row = b"7,0.026,0.039,8388608,8388608,0.0,0.0,-1,0\n"
    >>> good, [place] = sift(Piece(row + b"7,0.0\n???\n" + row, 100, 5, 0), 3)
    >>> good == row + row, place.line, place.lines, place.offset, place.bytes, place.rows_before
    (True, 6, 2, 143, 10, 4)
    """
    lines = piece.data.split(b"\n")[:-1]
    first = f"got a line of {len(lines[0]) + piece.left_out} bytes" if piece.left_out else _reason(lines[0], columns)
    reasons = chain([first], (_reason(line, columns) for line in lines[1:]))
    good, places = list[bytes](), list[Damage]()
    number, offset = piece.line, piece.offset
    for is_row, group in groupby(zip(lines, reasons, strict=True), key=lambda pair: pair[1] is None):
        alike, reason = _run(group)
        size = sum(map(len, alike)) + len(alike) + (piece.left_out if number == piece.line else 0)
        if is_row:
            good += alike
        else:
            places.append(Damage(number, len(alike), offset, size, rows_before + len(good), str(reason)))
        number, offset = number + len(alike), offset + size
    return b"".join(line + b"\n" for line in good), places


def _run(group: Iterator[tuple[bytes, str | None]]) -> tuple[list[bytes], str | None]:
    """Return lines, and the reason of the first one."""
    line, reason = next(group)
    return [line, *(line for line, _ in group)], reason


def _reason(line: bytes, columns: tuple[str, ...]) -> str | None:
    return unreadable(line.removesuffix(b"\r"), columns)


def add(places: list[Damage], place: Damage) -> None:
    """Add a damaged place to those before it; one that adjoins the last one makes that longer."""
    if places and places[-1].offset + places[-1].bytes == place.offset:
        last = places.pop()
        place = last._replace(lines=last.lines + place.lines, bytes=last.bytes + place.bytes)
    places.append(place)


def begin_of(path: Path, most: int) -> bytes:
    """Return the first bytes of what is in a file.

    Raises
    ------
    RecordingError
        It cannot be read.
    """
    try:
        with opened(path) as file:
            return file.read(most)
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror or error}") from error
