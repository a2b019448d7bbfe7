"""Every parser against its corpus, against what fuzzing found, and against random changes of both."""

import random
from pathlib import Path

import pytest
from effort import draws, random_of
from fuzz_parsers import TARGETS
from project import ROOT
from tally import Tally

CORPUS = ROOT / "tests" / "fuzz" / "corpus"
CHANGES = draws(40)
"""Of each file; `.ci/fuzz` goes on from there, and sees which branches are taken."""


def changed(data: bytes, rng: random.Random) -> bytes:
    """Return bytes with some left out, doubled, swapped or replaced by others."""
    out = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at, size = rng.randint(0, len(out)), rng.randint(0, 8)
        piece = bytes(out[at : at + size])
        out[at : at + size] = rng.choice([b"", piece * 2, piece[::-1], rng.randbytes(size), b"9" * size, b"-1e999"])
    return bytes(out)


@pytest.mark.parametrize("target", TARGETS)
def test_only_documented_errors(target: str, tally: Tally) -> None:
    rng = random_of(target)
    files = sorted((CORPUS / target).iterdir())
    assert files
    for file in files:
        given = file.read_bytes()
        for data in (given, *(changed(given, rng) for _ in range(CHANGES)), *(given[:n] for n in range(0, 200, 9))):
            tally.count("bytes for a parser")
            TARGETS[target](data)


def test_every_corpus_has_a_target() -> None:
    assert {folder.name for folder in CORPUS.iterdir()} == {*TARGETS, "rows", "tracker"}
    assert all(isinstance(path, Path) and path.stat().st_size < 4096 for path in CORPUS.rglob("*") if path.is_file())
