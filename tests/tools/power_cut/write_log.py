"""The writes of a guest to a disk, from QEMU's blklogwrites, and what a power cut may leave of them.

The format is Linux's dm-log-writes: Documentation/admin-guide/device-mapper/log-writes.rst, and
drivers/md/dm-log-writes.c for the bytes.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random

SECTOR = 512  # of the log
WHOLE = 4096  # bytes that a disk writes whole, its physical sector
_MAGIC, _VERSION = 0x6A736677736872, 1
_SUPER, _ENTRY = struct.Struct("<QQQI"), struct.Struct("<4Q")
_FLUSH, _FUA = 1, 2


@dataclass(frozen=True)
class Write:
    """A request: data at an offset in bytes, or a flush of all before it."""

    offset: int
    data: bytes
    flush: bool
    through: bool  # on the disk when it is done, without a flush


def read_log(path: Path) -> list[Write]:
    """Return the requests in their order."""
    log, at, writes = path.read_bytes(), SECTOR, []
    magic, version, count, sector = _SUPER.unpack_from(log)
    assert (magic, version, sector) == (_MAGIC, _VERSION, SECTOR), f"{path}: not a log of writes"
    for _ in range(count):
        begin, sectors, flags, _ = _ENTRY.unpack_from(log, at)
        assert flags & ~(_FLUSH | _FUA) == 0, f"a request with flags {flags}: neither write nor flush"
        data = log[at + SECTOR : at + SECTOR + sectors * SECTOR]
        at += SECTOR + len(data)
        writes.append(Write(begin * SECTOR, data, bool(flags & _FLUSH), bool(flags & _FUA)))
    return writes


def apply(image: bytearray, writes: Sequence[Write]) -> None:
    for write in writes:
        image[write.offset : write.offset + len(write.data)] = write.data


def cut(image: bytearray, writes: Sequence[Write], random: Random) -> None:
    """Apply what a power cut leaves of writes: all before the last flush, and any sectors of the rest, in their order."""
    flushed = max((number for number, write in enumerate(writes) if write.flush), default=0)
    apply(image, writes[:flushed])
    share = random.choice((0.0, 0.1, 0.5, 0.9, 1.0))
    for write in writes[flushed:]:
        for at in range(0, len(write.data), WHOLE):
            if write.through or random.random() < share:
                apply(image, [replace(write, offset=write.offset + at, data=write.data[at : at + WHOLE])])
