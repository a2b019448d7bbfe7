"""What is made once in a run of the tests: the first worker that needs it makes it, the others wait."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Return the folder of this name that `make` has filled, which it gets empty.

    Raises
    ------
    AssertionError
        In the other workers, if `make` failed in the first.
    """
    base = factory.getbasetemp()
    root = base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base
    folder, said = root / name, root / f"{name}.said"
    try:
        folder.mkdir()
    except FileExistsError:
        while not said.exists():
            time.sleep(0.1)
        failure = said.read_text(encoding="utf-8")
        assert failure == "", failure
        return folder
    failure = f"{name}: not made, see the test of another worker"
    try:
        make(folder)
        failure = ""
    finally:
        said.with_suffix(".part").write_text(failure, encoding="utf-8")
        said.with_suffix(".part").rename(said)
    return folder
