"""What tests build with a compiler, in build/tests: it stays from run to run, and the workers of a run share it."""

import hashlib
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from project import ROOT, run

FOLDER = ROOT / "build" / "tests"
_SOURCES = {".cpp", ".hpp", ".ld", ".py"}


@contextmanager
def kept_folder(name: str, *compilers: str) -> Iterator[Path]:
    """Give a folder for a build by these programs, and those of this environment; no other process has it meanwhile.

    The build tool finds out what has changed in it.
    """
    fcntl = pytest.importorskip("fcntl", reason="no lock of files on this system")
    folder = FOLDER / _hash(name, sys.prefix, *(run(compiler, "--version") for compiler in compilers))
    folder.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield folder


def kept_json(name: str, inputs: tuple[Path, ...], programs: tuple[str, ...], make: Callable[[Path], object]) -> Any:
    """Return what `make` writes to the file that it gets, or what it wrote for the same inputs and programs before.

    `inputs` are folders of sources, all of whose files count.
    """
    with kept_folder(name, *programs) as folder:
        files = sorted(path for each in inputs for path in each.rglob("*") if path.suffix in _SOURCES)
        texts = (f"{path.relative_to(ROOT)}\n{path.read_text(encoding='utf-8')}" for path in files)
        made = folder / f"{_hash(*texts)}.json"
        if not made.exists():
            for old in folder.glob("*.json"):
                old.unlink()
            make(made)
        return json.loads(made.read_text(encoding="utf-8"))


def _hash(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]
