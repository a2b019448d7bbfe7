"""A process that records and prints the number of written rows until it ends; arguments: mode, folder, count.

The children are forks of one process, so imports are done once. `endless`: until it is killed. `shutdown`: until its
main thread ends without closing anything, after a number of rows. `command`: `palpate record`, until it is interrupted.
"""

import itertools
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import click
from palpate.cli import main as palpate_command
from palpate.samples import Sample
from palpate.sources import Source, sim
from palpate.stream import Stream
from recording_bench import sample

assert sim.DEFAULT  # imported here, once


class Endless(Source):
    """A source of some thousand samples per second."""

    def __iter__(self) -> Iterator[Sample]:
        """Return samples without end."""
        for seq in itertools.count():
            yield sample(seq)
            time.sleep(0.0003)

    def describe(self) -> dict[str, Any]:
        return {"name": "endless"}


def rows_before_shutdown(number: int) -> int:
    """Return how many rows a child writes before it ends: none to some 0.3 s of them, however busy the machine is."""
    return 100 * number


def measure(path: Path, output: int, most: float) -> None:
    """Record, and print the written rows; return without closing anything."""
    stream = Stream(Endless(), record=path)
    stream.__enter__()
    assert stream.recorder
    for _ in stream.batches():
        rows = stream.recorder.rows
        os.write(output, f"{rows}\n".encode())
        if rows >= most:
            break


def command(path: Path, output: int) -> NoReturn:
    """Record with the command; keep what it says on standard error.

    Not from a simulated board: its driver refuses to go on if the machine is too busy.
    """
    setattr(sim, "open_sim", lambda *_: Endless())  # noqa: B010  mypy allows no other way
    make_context = click.Command.make_context

    def heard(*given: Any, **more: Any) -> Any:  # in the command line's own try: what comes before is of this child
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        return make_context(*given, **more)

    setattr(click.Command, "make_context", heard)  # noqa: B010
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(output, 2)
    palpate_command(["record", "sim:", "-o", str(path)])
    raise AssertionError("the command ends with an exit")


def child(way: str, folder: Path, number: int, ready: int) -> None:
    """Run a child in the given mode, and write to `ready` when a signal would end it as it should."""
    output = os.open(folder / f"{number}.acknowledged", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    if way == "command":
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    os.write(ready, b".")
    if way == "command":
        command(folder / f"{number}.csv", output)
    measure(folder / f"{number}.csv", output, rows_before_shutdown(number) if way == "shutdown" else float("inf"))


def main(way: str, folder: Path, count: int) -> None:
    """Fork the children, print their process ids when all are ready, wait for them and print how they ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    told, ready = os.pipe()
    children = []
    for number in range(count):
        if not (process := os.fork()):
            child(way, folder, number, ready)
            return  # with the shutdown of the interpreter
        children.append(process)
    for _ in children:
        os.read(told, 1)
    print(*children, flush=True)
    print(*(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) for process in children), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))
