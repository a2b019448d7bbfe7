"""Banks of streams against as many single estimators, bit for bit."""

import copy
import pickle
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numeric import ALL, BANKS, dtype_of

SETTINGS: dict[str, dict[str, float]] = {
    "Rls": {
        "forgetting": 0.97,
        "initial_ratio": 2.0,
        "initial_covariance": 1e4,
        "max_covariance": 2e4,
    },
    "AdaptiveRls": {
        "steady": 0.98,
        "alarmed": 0.8,
        "drift": 1e-4,
        "threshold": 3e-4,
        "clear_level": 2e-4,
        "initial_covariance": 50.0,
    },
    "HandoverRls": {
        "smallest_shift": 1.0,
        "false_alarm_interval": 300.0,
        "clip": 4.0,
        "smoothing": 0.25,
    },
}
FIELDS = ("ratio", "covariance", "innovation", "statistic", "alarm", "samples", "rejected")


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
        [
            copy.copy,
            copy.deepcopy,
            lambda bank: bank.copy(),
            lambda bank: pickle.loads(pickle.dumps(bank)),
        ]
    ),
    seed=st.integers(0, 99),
    chosen=st.booleans(),
)
def test_a_bank_is_many_estimators(
    bank_type: Any,
    single_type: Any,
    streams: int,
    frames: int,
    cut: int,
    again: Any,
    seed: int,
    *,
    chosen: bool,
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
    for s in {0, streams // 2, streams - 1, *range(min(streams, 9))}:
        single = single_type(**settings)
        assert single.settings == bank.settings
        assert single.process(output[:, s], regressor[:, s]).tobytes() == found[:, s].tobytes()
        assert bank[s] == bank[s - streams] == single
        for field in fields:
            assert np.array_equal(
                getattr(bank, field)[s], getattr(single, field), equal_nan=True
            ), field


@pytest.mark.parametrize("bank_type", BANKS)
def test_reset_and_equality(bank_type: Any) -> None:
    bank = bank_type(6)
    fresh = bank_type(6)
    bank.process(*samples(40, 6, 5, dtype_of(bank_type)))
    assert bank == copy.copy(bank) != fresh
    bank.reset()
    assert bank == fresh
    assert (len(bank), bank.streams, bank.ratio.tolist()) == (6, 6, [1.0] * 6)
    assert repr(bank) == f"<Bank of 6 {type(bank[0]).__name__}>"


@pytest.mark.parametrize("bank_type", BANKS)
def test_one_regressor_for_all_streams(bank_type: Any) -> None:
    output, regressor = samples(40, 6, 5, dtype_of(bank_type))
    shared = regressor[:, 0].copy()
    each = bank_type(6).process(output, np.repeat(shared[:, None], 6, axis=1))
    assert bank_type(6).process(output, shared).tobytes() == each.tobytes()


def test_streams_begin_in_the_state_of_the_estimator() -> None:
    estimator = palpate.AdaptiveRls(drift=0.005)
    estimator.process([0.5, 0.51], [0.25, 0.25])
    bank = palpate.Bank(estimator, 2)
    assert bank[0] == bank[1] == estimator
    bank.reset()
    assert bank[1] == palpate.AdaptiveRls(drift=0.005)


def test_what_a_block_refuses() -> None:
    bank = palpate.Bank(palpate.AdaptiveRls(), 3)
    good = np.ones((4, 3))
    before = bank.copy()
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
    with pytest.raises(ValueError, match=r"regressor: got shape \(3,\), allowed: \(4,\)"):
        bank.process(good, np.ones(3))
    with pytest.raises(
        AttributeError,
        match="standard_error: got a bank of estimators without it, allowed: HandoverRls",
    ):
        _ = bank.standard_error
    with pytest.raises(IndexError, match="stream: got 3, allowed: below 3"):
        bank[3]
    assert bank == before


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (
            (palpate.Tracker(), 3),
            TypeError,
            "estimator: got .*, allowed: an Rls, AdaptiveRls, HandoverRls or VectorRls",
        ),
        ((palpate.Rls, 3), TypeError, "estimator: got <class"),
        ((palpate.Rls(), 0), ValueError, r"streams: got 0, allowed: 1 <= streams <= 2\*\*32"),
        ((palpate.Rls(), 2.5), TypeError, "streams: got 2.5, allowed: a whole number"),
        ((palpate.Rls(),), TypeError, "incompatible constructor arguments"),
    ],
)
def test_what_the_constructor_refuses(arguments: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        palpate.Bank(*arguments)
