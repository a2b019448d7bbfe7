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
            yield Sample(seq, seq * 26_000_000, seq * 26_000_000 + 13_000_000, 8388608 + seq, 8388608, seq / 1e6, 0.0)
            time.sleep(PERIOD_S)

    def describe(self) -> dict[str, Any]:
        return {"name": "paced"}


class Said:
    """Tells the log of the device how many bytes of which file are on the disk."""

    def __init__(self, device: str, offset: int) -> None:
        self._device = os.open(device, os.O_WRONLY | os.O_DIRECT)
        self._offset = offset
        self._page = mmap.mmap(-1, mmap.PAGESIZE)  # O_DIRECT takes whole sectors from an aligned address

    def say(self, name: str, size: int, *, closed: bool = False) -> None:
        line = json.dumps({"name": name, "bytes": size, "closed": closed})
        self._page[:512] = line.encode().ljust(512)
        os.pwritev(self._device, [memoryview(self._page)[:512]], self._offset)

    def after(self, sync: Callable[[int], None]) -> Callable[[int], None]:
        """Return a sync that says what it has synced."""

        def synced(descriptor: int) -> None:
            size, name = os.fstat(descriptor).st_size, Path(f"/proc/self/fd/{descriptor}").readlink().name
            sync(descriptor)
            if name.endswith(".csv"):
                self.say(name, size)

        return synced


def main(folder: Path, device: str, offset: int, seconds: float) -> None:
    said = Said(device, offset)
    system: Any = os
    system.fdatasync, system.fsync = said.after(os.fdatasync), said.after(os.fsync)
    until = time.monotonic() + seconds
    for number in itertools.count():
        path = folder / f"{number}.csv"
        with Stream(Paced(LENGTHS_S[number % len(LENGTHS_S)]), record=path) as stream:
            for _ in stream.batches():
                pass
        said.say(path.name, path.stat().st_size, closed=True)
        if time.monotonic() >= until:
            return


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
