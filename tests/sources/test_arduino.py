"""The sketch of cpp/examples/arduino on a simulated Uno with a simulated AD7746, read by `palpate record`."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import palpate
import pytest
from arduino import build
from effort import NIGHTLY
from numpy.typing import NDArray
from palpate.samples import Block, Status
from project import need, need_file

pytest.importorskip("pty")

PAIRS = 10_000 if NIGHTLY else 300
LIMIT_S = 60 + 2 * PAIRS  # a loaded machine takes its time; the simulated one stands still meanwhile


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the sketch and the board."""
    for tool in build.TOOLS:
        need(tool)
    for file in build.FILES:
        need_file(file)
    folder = tmp_path_factory.mktemp("arduino")
    flash, ram = build.bytes_of(build.build_sketch(folder))
    assert (flash <= 8000, ram <= 600) == (True, True), (flash, ram)
    build.build_board(folder)
    return folder


@contextmanager
def board(built: Path, folder: Path, pairs: int, *events: str) -> Iterator[Path]:
    """Run the board, which waits until its port is opened; at the end check that it used the chip as it must."""
    link, log = folder / "port", folder / "log"
    command = [built / "board", built / "sketch.elf", link, log, str(pairs), *events]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        try:
            wait(link.is_symlink)
            yield link
            assert process.wait(LIMIT_S) == 0
        finally:
            process.kill()


def wait(condition) -> None:
    until = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)
