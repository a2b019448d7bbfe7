"""Ring and tracker for a long time: the memory stays as it is. `bench/soak.py` does the same for 1e9 samples."""

import mmap
import sys

import pytest
import soak
from conftest import Tally, need

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the resident set is read from /proc")


def test_native(tally: Tally) -> None:
    need("c++")
    found = soak.native(5_000_000)
    assert (found["samples"], found["dropped"]) == (5_000_000, 0)
    assert found["touches"] == pytest.approx(5_000_000 / 400, abs=2)
    assert found["ratio"] == pytest.approx(2.5, abs=1e-3)
    assert len(found["resident_kB"]) == 5
    assert min(found["resident_kB"]) > 0
    assert soak.growth_kb(found) < soak.ALLOWED_KB
    tally.note("growth of the resident set, native, kB", soak.growth_kb(found))


def test_python(tally: Tally) -> None:
    found = soak.python(4_000_000)
    assert found["dropped"] == 0
    assert found["touches"] == pytest.approx(found["samples"] / 512, rel=0.02)
    assert len(found["resident_kB"]) == 5
    assert soak.growth_kb(found) < soak.ALLOWED_KB
    tally.note("growth of the resident set, Python, kB", soak.growth_kb(found))


def test_a_leak_would_be_seen() -> None:
    before = soak.resident_kb()
    with mmap.mmap(-1, 8 << 20) as kept:
        kept.write(bytes([1]) * (8 << 20))
        assert soak.growth_kb({"resident_kB": [before, soak.resident_kb()]}) > soak.ALLOWED_KB
