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


def let_record(
    way: str, folder: Path, seed: int, act: Callable[[int, int], None] | None, lasting_s: float = LASTING_S
) -> list[int]:
    """Start children, each with `folder`/NUMBER.csv; return their exit codes.

    Parameters
    ----------
    way : str
        As in `recording_child`.
    act : callable, optional
        Called once for each child, at a random moment, with its number and its process id.
    lasting_s : float
        Time of the latest moment, s, after all children are ready.
    """
    folder.mkdir()
    command = [sys.executable, str(ROOT / "tests" / "tools" / "recording_child.py"), way, str(folder), str(AT_ONCE)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        children = [int(word) for word in parent.stdout.readline().split()]
        moments, begun = random_of(f"{way} {seed}"), time.monotonic()
        for moment, child in sorted((moments.uniform(0, lasting_s), child) for child in children):
            if act:
                time.sleep(max(0.0, begun + moment - time.monotonic()))
                act(children.index(child), child)
        return [int(word) for word in parent.stdout.readline().split()]


def acknowledged(path: Path) -> int:
    """Return how many rows were said to have left the process."""
    lines = path.with_suffix(".acknowledged").read_text().split("\n")[-2:-1]
    return int(lines[0]) if lines else 0
