"""Recordings that were killed, and what can happen to their files afterwards."""

import zlib
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


DAMAGES = ("zeros", "noise", "cut out", "inserted", "lines merged", "end cut off", "one byte changed")


def damaged(kind: str, data: bytes, random: Random) -> bytes:
    """Return a file after one of `DAMAGES` at a random place."""
    at, size = random.randrange(len(data)), random.choice((1, 16, 60, 512, 4096))
    before, hit, after = data[:at], data[at : at + size], data[at + size :]
    odd = (b"\n", b"\n\n\n", b"\r", b",", b"\0" * 8, "Grüße\n".encode(), random.randbytes(300))
    begin, _, rest = data[at:].partition(b"\n")
    return {
        "zeros": before + bytes(len(hit)) + after,
        "noise": before + random.randbytes(len(hit)) + after,
        "cut out": before + after,
        "inserted": before + random.choice(odd) + hit + after,
        "lines merged": before + begin + rest,
        "end cut off": before + bytes(random.choice((0, 0, 1, 512, 9000))),
        "one byte changed": before + bytes([data[at] ^ random.randrange(1, 256)]) + data[at + 1 :],
    }[kind]


def survivors(data: bytes, rows: list[bytes]) -> list[bytes]:
    """Return the rows that are still there as they were written: whole lines of the file."""
    known = set(rows)
    return [line + b"\n" for line in data.split(b"\n")[:-1] if line + b"\n" in known]
