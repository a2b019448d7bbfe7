"""Ring and tracker for a long time: the memory stays as it is. `python -m bench.soak.memory` does the same for 1e9 samples."""

import mmap
import sys

import pytest
from project import need
from tally import Tally

from bench.soak import memory

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the resident set is read from /proc")


def test_native(tally: Tally) -> None:
    need("c++")
    found = memory.native(5_000_000)
    assert (found["samples"], found["dropped"]) == (5_000_000, 0)
    assert found["touches"] == pytest.approx(5_000_000 / 400, abs=2)
    assert found["ratio"] == pytest.approx(2.5, abs=1e-3)
    assert len(found["resident_kB"]) == 5
    assert min(found["resident_kB"]) > 0
    assert memory.growth_kb(found) < memory.ALLOWED_KB
    tally.note("growth of the resident set, native, kB", memory.growth_kb(found))


def test_python(tally: Tally) -> None:
    found = memory.python(4_000_000)
    assert found["dropped"] == 0
    assert found["touches"] == pytest.approx(found["samples"] / 512, rel=0.02)
    assert len(found["resident_kB"]) == 5
    assert memory.growth_kb(found) < memory.ALLOWED_KB
    tally.note("growth of the resident set, Python, kB", memory.growth_kb(found))


def test_a_leak_would_be_seen() -> None:
    before = memory.resident_kb()
    with mmap.mmap(-1, 8 << 20) as kept:
        kept.write(bytes([1]) * (8 << 20))
        assert memory.growth_kb({"resident_kB": [before, memory.resident_kb()]}) > memory.ALLOWED_KB
