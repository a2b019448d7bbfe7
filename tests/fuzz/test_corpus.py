"""Every parser against its corpus, against what fuzzing found, and against random changes of both."""

import json
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest
from effort import ALL, NIGHTLY, draws, random_of
from fuzz_parsers import TARGETS
from project import ROOT

CORPUS = ROOT / "tests" / "fuzz" / "corpus"
CHANGES = draws(40)
"""Of each file; `.ci/checks fuzz` goes on from there, and sees which branches are taken."""


def changed(data: bytes, rng: random.Random) -> bytes:
    """Return bytes with some left out, doubled, swapped or replaced."""
    out = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randint(0, len(out))
        size = rng.randint(0, 8)
        piece = bytes(out[at : at + size])
        out[at : at + size] = rng.choice(
            [b"", piece * 2, piece[::-1], rng.randbytes(size), b"9" * size, b"-1e999"]
        )
    return bytes(out)


@pytest.mark.parametrize("target", TARGETS)
def test_only_documented_errors(target: str) -> None:
    rng = random_of(target)
    files = sorted((CORPUS / target).iterdir())
    assert files
    for file in files:
        given = file.read_bytes()
        for data in (
            given,
            *(changed(given, rng) for _ in range(CHANGES)),
            *(given[:n] for n in range(0, 200, 9)),
        ):
            TARGETS[target](data)


def test_every_corpus_has_a_target() -> None:
    assert {folder.name for folder in CORPUS.iterdir()} == {*TARGETS, "rows", "tracker"}
    assert all(
        isinstance(path, Path) and path.stat().st_size < 4096
        for path in CORPUS.rglob("*")
        if path.is_file()
    )


STEP = 1 if NIGHTLY else 20 if ALL else 60


def test_hostile_files_end_as_documented() -> None:
    """The limits are those of a busy machine; what grows faster than the file is far beyond them."""
    pytest.importorskip("resource")
    if not sys.platform.startswith("linux"):
        pytest.skip("memory of a process is read from /proc")
    program = [sys.executable, str(ROOT / "tests" / "tools" / "hostile_files.py"), str(STEP)]
    surroundings = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # the children are forked
    done = subprocess.run(program, capture_output=True, text=True, check=False, env=surroundings)
    assert done.returncode == 0, done.stderr
    endings = {
        (parser, name): error
        for parser, files in json.loads(done.stdout).items()
        for name, error in files.items()
    }
    assert not {key: error for key, error in endings.items() if error}
