"""What Python cannot see of the headers: ctest, and the same bits here and there."""

import platform
import sys
from typing import Any

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from project import ROOT, configure, kept_folder, need, run


def fnv(*arrays: NDArray[Any]) -> str:
    """Hash the bytes of the arrays' items in turn, as tests/cpp/bits.cpp does."""
    value = 14695981039346656037
    for row in zip(*arrays, strict=True):
        for item in row:
            for byte in item.tobytes():
                value = ((value ^ byte) * 1099511628211) & 0xFFFFFFFFFFFFFFFF
    return f"{value:016x}"


def touch_samples(ratio: int) -> tuple[list[float], list[float]]:
    """Make the samples of tests/cpp/samples.hpp."""
    output = []
    regressor = []
    state = 12345
    for i in range(250):
        state = (state * 1664525 + 1013904223) & 0xFFFFFFFF
        noise = (state >> 20) - 2048
        press = 400 + (4 * i if i < 100 else 400)
        regressor.append(press / 2048)
        eighths = ratio if i < 180 else ratio + 6
        output.append((press * eighths * 16 + int(noise / 8)) / 262144)
    return output, regressor


def touch_hash(name: str) -> str:
    """Hash two touches through an estimator of the extension."""
    rows = np.concatenate(
        [getattr(palpate, name)().trace(*touch_samples(ratio)) for ratio in (20, 63)]
    )
    return fnv(*(rows[f] for f in ("ratio", "innovation", "covariance", "statistic")))


def bank_hash(name: str) -> str:
    """Hash 21 touches through a bank of the extension."""
    output, regressor = np.transpose([touch_samples(20 + s) for s in range(21)], (1, 2, 0))
    bank = palpate.Bank(getattr(palpate, name.replace("Bank", ""))(), 21)
    ratios = bank.process(output, regressor)
    return fnv(
        np.concatenate([ratios.ravel(), np.ravel([bank.covariance, bank.statistic], order="F")])
    )


def has_the_hashes(hashes: dict[str, str]) -> None:
    """Check the extension against what tests/cpp/bits.cpp prints."""
    assert len(hashes) == 12
    for name, value in hashes.items():
        assert (bank_hash if "Bank" in name else touch_hash)(name) == value, name


@pytest.mark.parametrize("compiler", ["c++", "clang++"])
def test_ctest_and_the_bits_of_the_extension(cmake: str, compiler: str) -> None:
    """The headers alone, in constant expressions and under every flag; then the extension."""
    with kept_folder("ctest", need(compiler)) as build:
        configure(cmake, ROOT, build, f"-DCMAKE_CXX_COMPILER={need(compiler)}")
        out = run("ctest", "--test-dir", build, "--output-on-failure", "--no-tests=error")
        assert "100% tests passed" in out
        hashes = dict(line.split() for line in run(build / "tests" / "cpp" / "bits").splitlines())
    has_the_hashes(hashes)


if __name__ == "__main__":  # on another processor: .ci/aarch64
    has_the_hashes(dict(line.split() for line in sys.stdin))
    print(platform.machine(), palpate.__file__, "has the hashes of tests/cpp/bits.cpp")
