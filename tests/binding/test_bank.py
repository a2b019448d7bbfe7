"""Banks of streams against as many single estimators, bit for bit."""

import copy
import hashlib
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numeric import ALL, BANKS, dtype_of
from palpate import _core
from project import ROOT

SETTINGS: dict[str, dict[str, float]] = {
    "Rls": {"forgetting": 0.97, "initial_ratio": 2.0, "initial_covariance": 1e4, "max_covariance": 2e4},
    "AdaptiveRls": {
        "steady": 0.98,
        "alarmed": 0.8,
        "drift": 1e-4,
        "threshold": 3e-4,
        "clear_level": 2e-4,
        "initial_covariance": 50.0,
    },
    "HandoverRls": {"steady": 0.98, "drift": 0.5, "threshold": 4.0, "clip": 4.0, "smoothing": 0.25},
}
FIELDS = ("ratio", "covariance", "statistic", "alarm", "rejected")


def samples(frames: int, streams: int, seed: int, dtype: Any) -> tuple[Any, Any]:
    """Make touches with steps, idle stretches and, here and there, a sample to refuse."""
    rng = np.random.default_rng(seed)
    regressor = 0.25 + 0.01 * rng.standard_normal((frames, streams))
    ratio = np.where(np.arange(frames)[:, None] < frames // 2, 2.5, rng.uniform(1.1, 8, streams))
    output = ratio * regressor + 1e-4 * rng.standard_normal((frames, streams))
    regressor[rng.random(regressor.shape) < 0.05] = 0.0
    bad = rng.random(regressor.shape) < 0.02
    output[bad] = rng.choice([np.nan, np.inf, -np.inf, 1e200, 3e38], bad.sum())
    with np.errstate(over="ignore"):
        return output.astype(dtype), regressor.astype(dtype)


pairs = pytest.mark.parametrize(("bank_type", "single_type"), list(zip(BANKS, ALL, strict=True)))


@pairs
@given(
    streams=st.one_of(st.integers(1, 40), st.sampled_from([255, 1024, 1031])),
    frames=st.integers(0, 40),
    cut=st.integers(0, 40),
    again=st.sampled_from(
        [copy.copy, copy.deepcopy, lambda bank: bank.copy(), lambda bank: pickle.loads(pickle.dumps(bank))]
    ),
    seed=st.integers(0, 99),
    chosen=st.booleans(),
)
def test_a_bank_is_many_estimators(
    bank_type: Any, single_type: Any, streams: int, frames: int, cut: int, again: Any, seed: int, *, chosen: bool
) -> None:
    """In a block, then, copied, row by row."""
    settings = SETTINGS[single_type.__name__.removesuffix("32")] if chosen else {}
    fields = (*FIELDS, "standard_error") if hasattr(single_type, "standard_error") else FIELDS
    output, regressor = samples(frames, streams, seed, dtype_of(bank_type))
    bank = bank_type(streams, **settings)
    found = bank.process(output[:cut], regressor[:cut])
    bank = again(bank)
    rows = [bank.update(y, x) for y, x in zip(output[cut:], regressor[cut:], strict=True)]
    found = np.concatenate([found, np.reshape(rows, (-1, streams)).astype(found.dtype)])
    assert bank.rows == frames
    for s in {0, streams // 2, streams - 1, *range(min(streams, 9))}:
        single = single_type(**settings)
        assert single.settings == bank.settings
        assert single.process(output[:, s], regressor[:, s]).tobytes() == found[:, s].tobytes()
        for field in (*fields, "samples"):
            assert np.array_equal(getattr(bank, field)[s], getattr(single, field), equal_nan=True), field


@pytest.mark.parametrize("bank_type", BANKS)
def test_reset_and_equality(bank_type: Any) -> None:
    bank, fresh = bank_type(6), bank_type(6)
    bank.process(*samples(40, 6, 5, dtype_of(bank_type)))
    assert bank == copy.copy(bank) != fresh
    bank.reset()
    assert bank == fresh
    assert (bank.rows, len(bank), bank.ratio.tolist()) == (0, 6, [1.0] * 6)
    assert repr(bank) == f"<{bank_type.__name__}(6) rows=0>"


def test_what_a_block_refuses() -> None:
    bank = palpate.AdaptiveRlsBank(3)
    good = np.ones((4, 3))
    before = bank.ratio
    cases: list[tuple[Any, Any, Any, type[Exception], str]] = [
        (np.ones((4, 2)), good, None, ValueError, r"output: got shape \(4, 2\), allowed: \(n, 3\)"),
        (good, good, np.ones((4, 3), np.float32), TypeError, "out: got dtype float32"),
        (good, good, np.ones((3, 4)).T, ValueError, "out: got shape .*strided"),
        (good.astype(str), good, None, TypeError, "output: got dtype"),
    ]
    for output, regressor, out, kind, message in cases:
        with pytest.raises(kind, match=message):
            bank.process(output, regressor, out)
    with pytest.raises(ValueError, match=r"output: got shape \(4, 3\), allowed: \(3,\)"):
        bank.update(good, good)
    assert bank.rows == 0
    assert np.array_equal(bank.ratio, before)


def print_bits() -> None:
    """Print the instructions that are used, and a hash of all that the banks compute."""
    found = hashlib.sha256()
    for bank_type in BANKS:
        for streams in (1, 7, 16, 45):
            bank = bank_type(streams)
            found.update(bank.process(*samples(300, streams, 4, dtype_of(bank_type))).tobytes())
            state = bank.__getstate__()[1]
            found.update(state[1].tobytes() + state[2].tobytes())
    print(_core.simd(), found.hexdigest())


def with_simd(name: str) -> tuple[str, str]:
    """Run all banks in a process of its own, with these instructions; return what it printed and its errors."""
    code = "import sys; sys.path[:0] = sys.argv[1:]; import test_bank; test_bank.print_bits()"
    command = [sys.executable, "-c", code, str(Path(__file__).parent), str(ROOT / "tests" / "tools")]
    done = subprocess.run(command, env=os.environ | {"PALPATE_SIMD": name}, capture_output=True, text=True, check=False)
    return done.stdout, done.stderr


def test_all_instruction_sets_give_the_same_bits() -> None:
    assert _core.simd() in ("baseline", "avx2", "avx512")
    _, error = with_simd("sse9")
    assert "environment variable PALPATE_SIMD: got 'sse9', allowed: " in error
    names = error.strip().rpartition(": ")[2].split(", ")
    assert names[-1] == "baseline"
    found = {name: with_simd(name)[0].split() for name in names}
    assert [used for used, _ in found.values()] == names
    assert len({bits for _, bits in found.values()}) == 1
