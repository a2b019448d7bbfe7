"""What tests build with a compiler, in build/tests: it stays from run to run, and the workers of a run share it."""

import hashlib
import json
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from project import ROOT, run

try:
    import fcntl
except ImportError:  # pragma: no cover: Windows, where every test builds for itself
    fcntl = None  # type: ignore[assignment]

FOLDER = ROOT / "build" / "tests"


@contextmanager
def kept_folder(name: str, *compilers: str) -> Iterator[Path]:
    """Give a folder for a build by these programs, and those of this environment; no other process has it meanwhile.

    The build tool finds out what has changed in it. A new one where the tree cannot be written, or there are no locks.
    """
    key = _hash(name, sys.prefix, *(run(compiler, "--version") for compiler in compilers))
    try:
        if fcntl is None:
            raise OSError
        (FOLDER / key).mkdir(parents=True, exist_ok=True)
        file = (FOLDER / f"{key}.lock").open("w")
    except OSError:
        with tempfile.TemporaryDirectory() as folder:
            yield Path(folder)
    else:
        with file:
            fcntl.flock(file, fcntl.LOCK_EX)
            yield FOLDER / key


def kept_json(name: str, inputs: tuple[Path, ...], programs: tuple[str, ...], make: Callable[[Path], object]) -> Any:
    """Return what `make` writes to the file that it gets, or what it wrote for the same inputs and programs before.

    `inputs` are folders of sources, all of whose files count.
    """
    with kept_folder(name, *programs) as folder:
        made = folder / f"{_hash(*_texts(inputs))}.json"
        if not made.exists():
            for old in folder.glob("*.json"):
                old.unlink()
            make(made)
        return json.loads(made.read_text(encoding="utf-8"))


def _texts(folders: Iterable[Path]) -> Iterator[str]:
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.suffix in {".cpp", ".hpp", ".ld", ".py"}:
                yield f"{path.relative_to(ROOT)}\n{path.read_text(encoding='utf-8')}"


def _hash(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]
