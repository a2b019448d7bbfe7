"""The zip file of an Office Open XML document, as openpyxl uses it, with limits: openpyxl has none."""

import zipfile
from io import BufferedIOBase, BytesIO
from pathlib import Path
from typing import IO

from palpate.errors import RecordingError
from palpate.tables.packed import LARGEST

MOST_PARTS = 10_000
MOST_TAGS = 2_000_000
"""Tags in a part, or between two rows of a sheet, at most: a tree of XML takes 100 bytes for each."""
MOST_BYTES = 32_000_000
"""Bytes of a part, or between two rows of a sheet, at most."""

_CHUNK = 1 << 20  # expat begins again with a long tag at each piece of it, and openpyxl asks for small ones


class Package:
    """The parts of a document.

    Parameters
    ----------
    path : pathlib.Path
        For messages.
    data : bytes

    Raises
    ------
    RecordingError
        It is larger than `LARGEST` after decompression, or has more than `MOST_PARTS` parts.
    zipfile.BadZipFile
        Damaged; the other methods raise this and more.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self._zip = zipfile.ZipFile(BytesIO(data))
        parts = self._zip.infolist()
        size = sum(part.file_size for part in parts)  # zipfile never unpacks more of a part than it declares
        if size > LARGEST or len(parts) > MOST_PARTS:
            raise RecordingError(
                path,
                f"got {size:,} bytes in {len(parts):,} parts after decompression, allowed: {LARGEST:,} bytes in "
                f"{MOST_PARTS:,} parts",
            )
        self.names: list[str] = self._zip.namelist()

    def open(self, name: str) -> "Part":
        """Open a part; KeyError if there is none of this name."""
        return Part(self._zip.open(name))

    def read(self, name: str) -> bytes:
        """Return what is in a part; KeyError if there is none of this name."""
        with self.open(name) as part:
            return part.read()


class Part(BufferedIOBase):
    """A part of a document, read up to a limit."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file, self._least = file, 0
        self.restart()

    def restart(self) -> None:
        """Begin to count again: what was read is no longer in memory."""
        self._bytes, self._tags = MOST_BYTES, MOST_TAGS

    def read(self, size: int | None = -1) -> bytes:
        """Read bytes, in a long tag more than asked for; ValueError if there are too many, or too many tags."""
        data = self._file.read(MOST_BYTES + 1 if size is None or size < 0 else max(size, self._least))
        self._bytes -= len(data)
        tags = data.count(b"<")
        self._tags -= tags
        self._least = 0 if tags else _CHUNK
        if self._bytes < 0 or self._tags < 0:
            raise ValueError(
                f"more than {MOST_BYTES:,} bytes or {MOST_TAGS:,} tags without a row: save the table as CSV"
            )
        return data

    def close(self) -> None:
        """Close the part."""
        self._file.close()
        super().close()
