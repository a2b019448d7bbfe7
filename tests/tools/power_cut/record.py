"""In the guest: records again and again, and writes behind the file system what is on the disk.

Arguments: folder, device, offset, seconds. After each sync of a recording, and after each close, a line of JSON goes to
the device at the offset, past every cache; so the log of the device's writes has it in its place.
"""

import itertools
import json
import mmap
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate import Stream

LENGTHS_S = (0.3, 2.5, 10.0)
SOURCE = "sim:drift-both?speed=12&idle=120"  # some hundred pairs a second, for longer than the longest


def main(folder: Path, device: str, offset: int, seconds: float) -> None:
    """Record again and again, for a time."""
    disk = os.open(device, os.O_WRONLY | os.O_DIRECT)
    sector = memoryview(mmap.mmap(-1, mmap.PAGESIZE))[:512]  # O_DIRECT takes whole sectors from an aligned address

    def say(path: Path, size: int, *, closed: bool) -> None:
        sector[:] = json.dumps({"name": path.name, "bytes": size, "closed": closed}).encode().ljust(512)
        os.pwritev(disk, [sector], offset)

    def saying(sync: Callable[[int], None]) -> Callable[[int], None]:
        def synced(descriptor: int) -> None:
            size, path = os.fstat(descriptor).st_size, Path(f"/proc/self/fd/{descriptor}").readlink()
            sync(descriptor)
            if path.suffix == ".csv":
                say(path, size, closed=False)

        return synced

    system: Any = os
    system.fdatasync, system.fsync = saying(os.fdatasync), saying(os.fsync)
    until = time.monotonic() + seconds
    for number in itertools.count():
        path = folder / f"{number}.csv"
        with Stream(SOURCE, record=path) as stream:
            ends_s = time.monotonic() + LENGTHS_S[number % len(LENGTHS_S)]
            for _ in itertools.takewhile(lambda _, ends_s=ends_s: time.monotonic() < ends_s, stream.batches()):
                pass
        say(path, path.stat().st_size, closed=True)
        if time.monotonic() >= until:
            return


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
