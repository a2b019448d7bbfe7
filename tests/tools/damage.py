"""Recordings that were killed, and what can happen to their files afterwards."""

import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random

from palpate.recording import sidecar
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import block_of
from recording_bench import sample


def rows_of(count: int, first: int = 0) -> list[bytes]:
    """Return the lines of some samples."""
    return format_rows(block_of([sample(i) for i in range(first, first + count)])).splitlines(keepends=True)


def checkpoint(data: bytes) -> dict[str, int]:
    return {"rows": data.count(b"\n") - 1, "bytes": len(data), "crc32": zlib.crc32(data)}


def killed(path: Path, rows: int, synced: int, torn: int = 0) -> Path:
    """Write a recording that was killed: rows, the number of them in its checkpoint, and bytes of one more row."""
    lines = [HEADER.encode(), *rows_of(rows)]
    path.write_bytes(b"".join(lines) + rows_of(1, rows)[0][:torn])
    document = sidecar.fresh({"name": "a board"}, {}, []) | {"checkpoint": checkpoint(b"".join(lines[: synced + 1]))}
    sidecar.save(sidecar.sidecar_path(path), document)
    return path


def finished(path: Path, rows: int) -> Path:
    """Write a recording that was closed."""
    data = b"".join([HEADER.encode(), *rows_of(rows)])
    path.write_bytes(data)
    sidecar.save(sidecar.sidecar_path(path), sidecar.made({"name": "a board"}, rows, data))
    return path


def _zeros(data: bytes, random: Random) -> bytes:
    at, size = random.randrange(len(data)), random.choice((1, 16, 512, 4096))
    return data[:at] + bytes(min(size, len(data) - at)) + data[at + size :]


def _noise(data: bytes, random: Random) -> bytes:
    at, size = random.randrange(len(data)), random.choice((1, 16, 512))
    return data[:at] + random.randbytes(min(size, len(data) - at)) + data[at + size :]


def _cut(data: bytes, random: Random) -> bytes:
    at, size = random.randrange(len(data)), random.choice((1, 7, 60, 700))
    return data[:at] + data[at + size :]


def _inserted(data: bytes, random: Random) -> bytes:
    at = random.randrange(len(data))
    what = random.choice((b"\n", b"\n\n\n", b"\r", b",", b"\0" * 8, "Grüße\n".encode(), random.randbytes(300)))
    return data[:at] + what + data[at:]


def _merged(data: bytes, random: Random) -> bytes:
    ends = [i for i, byte in enumerate(data) if byte == ord("\n")]
    at = random.choice(ends or [0])
    return data[:at] + data[at + 1 :]


def _ended(data: bytes, random: Random) -> bytes:
    return data[: random.randrange(len(data))] + bytes(random.choice((0, 0, 1, 512, 9000)))


def _changed(data: bytes, random: Random) -> bytes:
    at = random.randrange(len(data))
    return data[:at] + bytes([data[at] ^ random.randrange(1, 256)]) + data[at + 1 :]


DAMAGES: dict[str, Callable[[bytes, Random], bytes]] = {
    "zeros": _zeros,
    "random bytes": _noise,
    "bytes cut out": _cut,
    "bytes inserted": _inserted,
    "lines merged": _merged,
    "end cut off, or zeros": _ended,
    "one byte changed": _changed,
}


def survivors(data: bytes, rows: list[bytes]) -> list[bytes]:
    """Return the rows that are still there as they were written: whole lines of the file."""
    known = set(rows)
    return [line + b"\n" for line in data.split(b"\n")[:-1] if line + b"\n" in known]
