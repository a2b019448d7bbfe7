"""Folder of the project, the programs and packages that its tests need, functions that run programs, and what is made once.

What tests build with a compiler is in build/tests: it stays from run to run, and the workers of a run share it.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import Distribution
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NoReturn

import pytest

ROOT = Path(__file__).parents[2]
FOUR = ROOT / "tests" / "data" / "four-specimens.csv"


def is_editable() -> bool:
    """Return whether palpate is installed by a link to its sources."""
    origin = Distribution.from_name("palpate").read_text("direct_url.json") or "{}"
    return bool(json.loads(origin).get("dir_info", {}).get("editable"))


of_a_wheel = pytest.mark.skipif(is_editable(), reason="palpate is installed as editable")
"""For tests of the files that a wheel installs."""


def copied(path: Path, source: Path = FOUR) -> Path:
    """Copy a recording of palpate, with its sidecar."""
    path.parent.mkdir(parents=True, exist_ok=True)
    for copy, kept in ((path, source), (path.with_suffix(".json"), source.with_suffix(".json"))):
        copy.write_bytes(kept.read_bytes())
    return path


def need(tool: str) -> str:
    """Return the path of a program or a folder. If it is missing, the test is skipped, or fails if no test may be skipped."""
    path = tool if Path(tool).is_absolute() and Path(tool).is_dir() else shutil.which(tool)
    if path is None:
        _without(tool)
    return path


def need_package(name: str) -> None:
    """As `need`, for a package that is imported."""
    if find_spec(name) is None:
        _without(name)


def _without(name: str) -> NoReturn:
    message = f"{name} is not installed"
    if os.environ.get("PALPATE_NO_SKIP"):
        pytest.fail(message)
    pytest.skip(message)


STRICT = ("-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


def run(*command: str | Path) -> str:
    """Run a program, which must succeed, and return its output."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def configure(cmake: str, source: Path, build: Path, *options: str) -> None:
    """Configure and build a CMake project."""
    run(cmake, "-S", source, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", *options)
    run(cmake, "--build", build)


def asked(option: str) -> str:
    """Return the output of the installed command `palpate` with this option."""
    return run(sys.executable, "-m", "palpate", option).strip()


def compiles(compiler: str, text: str, folder: Path) -> None:
    """Check that a compiler accepts a program, with all warnings as errors."""
    source = folder / "block.cpp"
    source.write_text(text)
    run(need(compiler), *STRICT, asked("--includes"), "-fsyntax-only", source)


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Return the folder that `make` fills in the first worker that needs it; all other workers wait, and fail if it failed."""
    base = factory.getbasetemp()
    folder = (base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base) / name
    made = folder.with_suffix(".made")
    failed = folder.with_suffix(".failed")
    try:
        folder.mkdir()
    except FileExistsError:
        while not made.exists():
            assert not failed.exists(), f"{name}: not made, see the test of another worker"
            time.sleep(0.1)
        return folder
    try:
        make(folder)
    except BaseException:
        failed.touch()
        raise
    made.touch()
    return folder


KEPT = ROOT / "build" / "tests"
_SOURCES = {".cpp", ".hpp", ".ld", ".py"}


@contextmanager
def kept_folder(name: str, *compilers: str) -> Iterator[Path]:
    """Give a folder for a build by these programs, and those of this environment; no other process has it meanwhile.

    The build tool finds out what has changed in it.
    """
    fcntl = pytest.importorskip("fcntl", reason="no lock of files on this system")
    folder = KEPT / _hash(name, sys.prefix, *(run(compiler, "--version") for compiler in compilers))
    folder.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield folder


def kept_json(
    name: str, inputs: tuple[Path, ...], programs: tuple[str, ...], make: Callable[[Path], object]
) -> Any:
    """Return what `make` writes to the file that it gets, or what it wrote for the same inputs and programs before.

    `inputs` are folders of sources, all of whose files count.
    """
    with kept_folder(name, *programs) as folder:
        files = sorted(
            path for each in inputs for path in each.rglob("*") if path.suffix in _SOURCES
        )
        texts = (f"{path.relative_to(ROOT)}\n{path.read_text(encoding='utf-8')}" for path in files)
        made = folder / f"{_hash(*texts)}.json"
        if not made.exists():
            for old in folder.glob("*.json"):
                old.unlink()
            make(made)
        return json.loads(made.read_text(encoding="utf-8"))


def _hash(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]
