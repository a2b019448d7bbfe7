"""Records, and says how many rows have left it, until it is killed; run with a folder and a count.

The children are forks of one process: what they import is imported once.
"""

import itertools
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from palpate.sample import Sample
from palpate.sources import Source
from palpate.stream import Stream
from recording_bench import sample


class Endless(Source):
    """Some thousand samples a second."""

    def __iter__(self) -> Iterator[Sample]:
        """Return samples for ever."""
        for seq in itertools.count():
            yield sample(seq)
            time.sleep(0.0003)

    def describe(self) -> dict[str, Any]:
        return {"name": "endless"}


def measure(path: Path, output: int) -> None:
    """Record, and acknowledge."""
    with Stream(Endless(), record=path) as stream:
        assert stream.recorder
        for _ in stream.batches():
            os.write(output, f"{stream.recorder.rows}\n".encode())


def main(folder: Path, count: int) -> None:
    """Fork the children, print their process ids and wait for them."""
    children = []
    for number in range(count):
        output = os.open(folder / f"{number}.acknowledged", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        if not (child := os.fork()):
            measure(folder / f"{number}.csv", output)
        children.append(child)
    print(*children, flush=True)
    for child in children:
        os.waitpid(child, 0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
