"""What is in a file: .gz is unpacked, and the name - is standard input."""

import errno
import gzip
import io
import os
import sys
import weakref
import zlib
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO, cast

from palpate.files import open_regular

_PART = 1 << 20
LARGEST = 500_000_000
"""Bytes of a table, at most, after decompression: it is read as a whole."""
STANDARD_INPUT = Path("-")
"""This name is standard input in every command and in `palpate.read`; ./folder/- is a file."""
GZIP = b"\x1f\x8b"


def opened(path: Path) -> BinaryIO:
    """Open what is in a file, or standard input, to read bytes.

    Raises
    ------
    OSError
        As `palpate.files.open_regular`; or, also while it is read: a damaged .gz, or more than `LARGEST` bytes in it.
    """
    file = io.BufferedReader(_Shared(_standard_input())) if path == STANDARD_INPUT else open_regular(path)
    begin = file.read(len(GZIP))
    file.seek(0)
    return cast(BinaryIO, io.BufferedReader(_Unpacked(file))) if begin == GZIP else file


def contents(path: Path) -> bytes:
    """Return what is in a file, or what comes from standard input.

    Raises
    ------
    OSError
        As `opened`; or it is larger than `LARGEST`.
    """
    with opened(path) as file:
        return _limited(file)


def is_packed(path: Path) -> bool:
    """Return whether a file is not itself what is read: standard input, or .gz."""
    if path == STANDARD_INPUT:
        return True
    with open_regular(path) as file:
        return file.read(len(GZIP)) == GZIP


def unpacked_name(path: Path) -> str:
    """Return the name of a file without .gz.

    Examples
    --------
    >>> unpacked_name(Path("monday/run.csv.gz"))
    'run.csv'
    """
    return path.stem if path.suffix.lower() == ".gz" else path.name


def _limited(file: BinaryIO) -> bytes:
    data = bytearray()
    while part := file.read(_PART):  # read(n) takes n bytes of memory first
        data += part
        if len(data) > LARGEST:
            raise _too_large()
    return bytes(data)


def _too_large() -> OSError:
    return OSError(errno.EFBIG, f"larger than {LARGEST:,} bytes, the most that such a file may have")


def _standard_input() -> "_Spool":
    if sys.stdin is None or not hasattr(sys.stdin, "buffer"):
        raise OSError(errno.EBADF, "there is no standard input")
    if sys.stdin.isatty():
        raise OSError(errno.EINVAL, "standard input is a terminal: send a file to it, as in palpate check - < run.csv")
    return _read_once(sys.stdin)


@lru_cache(maxsize=1)
def _read_once(stream: Any) -> "_Spool":
    """Return all bytes of a stream. It can be read only once, and a recording is read more than once."""
    return _Spool(stream.buffer)


class _Spool:
    """The bytes of a stream in a temporary file, which is closed when nobody reads it any more."""

    def __init__(self, stream: BinaryIO) -> None:
        import tempfile

        self.file = tempfile.TemporaryFile()  # noqa: SIM115 - the finalizer closes it
        weakref.finalize(self, self.file.close)
        while part := stream.read(_PART):
            self.file.write(part)
            if self.file.tell() > LARGEST:
                raise _too_large()


class _Shared(io.RawIOBase):
    """A file that several read, each from its own place."""

    def __init__(self, spool: _Spool) -> None:
        self._spool, self._at = spool, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        offset += self._at if whence == os.SEEK_CUR else 0
        self._at = self._spool.file.seek(offset, os.SEEK_END if whence == os.SEEK_END else os.SEEK_SET)
        return self._at

    def readinto(self, buffer: Any) -> int:
        self._spool.file.seek(self._at)
        count: int = self._spool.file.readinto(buffer)
        self._at += count
        return count


class _Unpacked(io.RawIOBase):
    """The bytes in a .gz file, all members of it."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._inside, self._left = file, gzip.GzipFile(fileobj=file), LARGEST

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        try:
            count = self._inside.readinto(buffer)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise OSError(errno.EIO, f"damaged, or not complete ({error}): make the .gz file again") from error
        self._left -= count
        if self._left < 0:
            raise _too_large()
        return count

    def close(self) -> None:
        self._inside.close()
        self._file.close()
        super().close()
