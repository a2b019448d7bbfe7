"""Processes that record at the same time, and what happens to each of them at a random moment."""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from effort import random_of
from project import ROOT

AT_ONCE = 10
LASTING_S = 1.0


def wait(ready: Callable[[], object]) -> None:
    """Wait until something holds."""
    until = time.monotonic() + 60
    while not ready():
        assert time.monotonic() < until
        time.sleep(0.002)


def let_record(
    way: str,
    folder: Path,
    seed: int,
    act: Callable[[int, int], None] | None = None,
    begins: Callable[[Path], object] = lambda _: True,
) -> list[int]:
    """Start children, each with `folder`/NUMBER.csv; return their exit codes.

    Parameters
    ----------
    way : str
        As in `recording_child`.
    act : callable, optional
        Called once for each child, at a random moment, with its number and its process id.
    begins : callable
        The moments are within 1 s after it holds for all recordings: however busy the machine is, they have begun.
    """
    folder.mkdir()
    command = [sys.executable, str(ROOT / "tests" / "tools" / "recording_child.py"), way, str(folder), str(AT_ONCE)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        children = [int(word) for word in parent.stdout.readline().split()]
        for child in range(AT_ONCE):
            wait(lambda path=folder / f"{child}.csv": begins(path))  # type: ignore[misc]
        moments, begun = random_of(f"{way} {seed}"), time.monotonic()
        for moment, child in sorted((moments.uniform(0, LASTING_S), child) for child in children):
            if act:
                time.sleep(max(0.0, begun + moment - time.monotonic()))
                act(children.index(child), child)
        return [int(word) for word in parent.stdout.readline().split()]


def acknowledged(path: Path) -> int:
    """Return how many rows were said to have left the process."""
    told = path.with_suffix(".acknowledged")
    lines = told.read_text().split("\n")[-2:-1] if told.exists() else []
    return int(lines[0]) if lines else 0
