"""What is in a file: .gz is unpacked, and the name - is standard input."""

import errno
import gzip
import io
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO

from palpate.errors import RecordingError
from palpate.files import open_regular

_PART = 1 << 22
LARGEST = 500_000_000
"""Bytes of a table, and of what is packed or comes from standard input, at most: it is read as a whole."""
STANDARD_INPUT = Path("-")
"""This name is standard input in every command and in `palpate.read`; ./folder/- is a file."""
EXISTS = "already exists: choose another name"
_GZIP = b"\x1f\x8b"


def opened(path: Path) -> BinaryIO:
    """Open what is in a file, or standard input, to read bytes; OSError, too, for a damaged or too large .gz."""
    file = io.BytesIO(_standard_input(sys.stdin)) if path == STANDARD_INPUT else open_regular(path)
    begin = file.read(len(_GZIP))
    file.seek(0)
    if begin != _GZIP:
        return file
    try:
        with file, gzip.GzipFile(fileobj=file) as inside:
            return io.BytesIO(_limited(inside))
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise OSError(
            errno.EIO, f"damaged, or not complete ({error}): make the .gz file again"
        ) from error


@contextmanager
def file_errors(path: Path, what: str) -> Iterator[None]:
    """Turn OSError into RecordingError: what cannot be done with a file of a recording, and why."""
    try:
        yield
    except OSError as error:
        text = (
            EXISTS if isinstance(error, FileExistsError) else f"{what}: {error.strerror or error}"
        )
        raise RecordingError(path, text) from error


def contents(path: Path) -> bytes:
    """Return what is in a file, or what comes from standard input; RecordingError if it cannot be read, or is empty."""
    with file_errors(path, "cannot be read"), opened(path) as file:
        data = _limited(file)
    if not data:
        raise RecordingError(path, "is empty")
    return data


def unpacked_name(path: Path) -> str:
    """Return the name of a file without .gz."""
    return path.stem if path.suffix.lower() == ".gz" else path.name


def _limited(file: Any) -> bytes:
    parts, size = [], 0
    while part := file.read(_PART):  # read(n) takes n bytes of memory first
        parts.append(part)
        size += len(part)
        if size > LARGEST:
            raise OSError(
                errno.EFBIG, f"larger than {LARGEST:,} bytes, the most that such a file may have"
            )
    return b"".join(parts)


@lru_cache(maxsize=1)
def _standard_input(stream: Any) -> bytes:
    """Return all bytes of a stream. It can be read only once, and a recording is read more than once."""
    if stream.isatty():
        raise OSError(
            errno.EINVAL,
            "standard input is a terminal: send a file to it, as in palpate check - < run.csv",
        )
    return _limited(stream.buffer)
