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
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from palpate import Sample, Source, Stream

LENGTHS_S = (0.3, 2.5, 10.0)
PERIOD_S = 0.004


class Paced(Source):
    """Some hundred samples per second, for a time."""

    live = True

    def __init__(self, length_s: float) -> None:
        self._length_s = length_s

    def __iter__(self) -> Iterator[Sample]:
        """Return one sample after the other."""
        ends = time.monotonic() + self._length_s
        for seq in itertools.count():
            if time.monotonic() >= ends:
                return
            yield Sample(seq, seq * 26_000_000, seq * 26_000_000 + 13_000_000, -1, -1, seq / 1e6, 0.0)
            time.sleep(PERIOD_S)

    def describe(self) -> dict[str, Any]:
        return {"name": "paced"}


def main(folder: Path, device: str, offset: int, seconds: float) -> None:
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
        with Stream(Paced(LENGTHS_S[number % len(LENGTHS_S)]), record=path) as stream:
            for _ in stream.batches():
                pass
        say(path, path.stat().st_size, closed=True)
        if time.monotonic() >= until:
            return


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
