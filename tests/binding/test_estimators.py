"""The bound estimators: arrays in, arrays out, clear errors; pickles and copies."""

import copy
import math
import pickle
from typing import Any

import numpy as np
import palpate
import pytest
from measure import bits
from numeric import BANKS, dtype_of, every, every_block
from numpy.typing import NDArray

RANDOM = np.random.default_rng(1)
REGRESSOR = RANDOM.uniform(0.1, 0.5, 300)
OUTPUT = 2.5 * REGRESSOR + 0.004 * RANDOM.standard_normal(300)


def samples_of(kind: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the samples in the type of an estimator, or in rows of three for a bank."""
    output, regressor = (each.astype(dtype_of(kind)) for each in (OUTPUT, REGRESSOR))
    if kind in BANKS:
        return (output.reshape(-1, 3), regressor.reshape(-1, 3))
    return (output, regressor)


@every_block
@pytest.mark.parametrize(
    "convert",
    [
        lambda a: a.tolist(),
        lambda a: tuple(map(np.array, a)),
        lambda a: np.repeat(a, 2, axis=-1)[..., ::2],
        lambda a: a[::-1].copy()[::-1],
        lambda a: np.stack([a, a], -1)[..., 1],
        lambda a: a.astype(a.dtype.newbyteorder()),
        lambda a: a.astype(np.longdouble),
        lambda a: np.frombuffer(b"x" + a.tobytes(), np.uint8)[1:].view(a.dtype).reshape(a.shape),
    ],
    ids=[
        "list",
        "tuple",
        "every second",
        "reversed",
        "column",
        "swapped bytes",
        "longdouble",
        "unaligned",
    ],
)
def test_any_layout_gives_the_same_bits(kind: Any, convert: Any) -> None:
    output, regressor = samples_of(kind)
    for method in ("process", "trace")[: 1 if kind in BANKS else 2]:
        expected = getattr(kind(), method)(output, regressor)
        assert bits(getattr(kind(), method)(convert(output), convert(regressor))) == bits(expected)


@every
@pytest.mark.parametrize(
    ("output", "regressor", "error", "message"),
    [
        ([1.0, 2.0], [1.0], ValueError, r"regressor: got shape \(1,\), allowed: \(2,\)"),
        ([[1.0, 2.0]], [[1.0, 2.0]], ValueError, r"output: got shape \(1, 2\), allowed: \(n,\)"),
        ([1j], [1.0], TypeError, r"output: got dtype complex128, allowed: real numbers"),
        ([1.0], ["a"], TypeError, r"regressor: got dtype <U1, allowed: real numbers"),
        ([1.0, [2.0]], [1.0], ValueError, "inhomogeneous"),
    ],
)
def test_bad_blocks_are_refused_whole(
    kind: Any, output: Any, regressor: Any, error: Any, message: str
) -> None:
    estimator = kind()
    for method in (estimator.process, estimator.trace):
        with pytest.raises(error, match=message):
            method(output, regressor)
    assert estimator == kind()


@every
def test_a_bad_out_is_refused(kind: Any) -> None:
    estimator = kind()
    dtype = dtype_of(kind)
    read_only = np.empty(300, dtype)
    read_only.flags.writeable = False
    other = np.float32 if dtype == np.float64 else np.float64
    unaligned = np.empty(300 * dtype.itemsize + 1, np.uint8)[1:].view(dtype)
    for out, error, message in [
        (read_only, ValueError, "out: got a read-only or unaligned array"),
        (unaligned, ValueError, "out: got a read-only or unaligned array"),
        (np.empty(299, dtype), ValueError, r"out: got shape \(299,\), allowed: \(300,\)"),
        (np.empty((300, 1), dtype), ValueError, r"out: got shape \(300, 1\)"),
        (np.empty(300, other), TypeError, f"out: got dtype {np.dtype(other)}, allowed: {dtype}"),
        (
            np.lib.stride_tricks.as_strided(np.zeros(1, dtype), (300,), (0,)),
            ValueError,
            "items share one place",
        ),
        ([0.0] * 300, TypeError, "out: got <class 'list'>, allowed: a numpy array"),
    ]:
        with pytest.raises(error, match=message):
            estimator.process(OUTPUT, REGRESSOR, out=out)
    with pytest.raises(TypeError, match="out: got dtype"):
        estimator.trace(OUTPUT, REGRESSOR, out=np.empty(300, dtype))
    assert estimator == kind()


@every_block
@pytest.mark.parametrize("shift", [-3, -1, 0, 1, 3])
def test_out_may_overlap_the_samples(kind: Any, shift: int) -> None:
    output, regressor = samples_of(kind)
    end = len(output) - 5
    expected = kind().process(output[5:end], regressor[5:end])
    for shared in samples_of(kind):
        place = shared[5 + shift : end + shift]
        given = (shared, regressor) if np.array_equal(shared, output) else (output, shared)
        assert kind().process(*(each[5:end] for each in given), out=place) is place
        assert np.array_equal(place, expected)
    every_second = np.repeat(output, 2, axis=0)
    found = kind().process(every_second[::2], regressor, out=every_second[: len(output)])
    assert np.array_equal(found, kind().process(output, regressor))


@every
def test_out_may_be_reversed(kind: Any) -> None:
    output, regressor = samples_of(kind)
    expected = kind().process(output, regressor)
    kind().process(output, regressor, out=output[::-1])
    assert np.array_equal(output[::-1], expected)


@every
def test_repr_settings_and_equality(kind: Any) -> None:
    estimator = kind(initial_ratio=1.5)
    assert repr(estimator) == f"<{kind.__name__}(initial_ratio=1.5): ratio 1.50, 0 samples>"
    assert kind(**estimator.settings) == estimator != kind()
    assert (estimator == 1.5) is False
    assert math.isnan(estimator.innovation)
    with pytest.raises(TypeError, match="unhashable"):
        hash(estimator)
    estimator.update(1.0, math.nan)
    assert estimator != kind(initial_ratio=1.5)
    with pytest.raises(AttributeError):
        estimator.ratio = 1.0


def test_masked_values_are_no_values() -> None:
    output = np.ma.masked_array([0.5, 99, 0.5], mask=[False, True, False])
    estimator = palpate.AdaptiveRls()
    estimator.process(output, [0.25] * 3)
    assert (estimator.samples, estimator.rejected) == (2, 1)
    assert estimator.ratio == pytest.approx(2, rel=0.01)


class Named(palpate.AdaptiveRls):
    """A subclass with something of its own."""

    def __init__(self, name: list[str], **settings: float) -> None:
        super().__init__(**settings)
        self.name = name


def test_a_subclass_survives_pickle_and_copy() -> None:
    named = Named(["left"], drift=0.02)
    named.update(0.5, 0.25)
    pickled = [
        pickle.loads(pickle.dumps(named, protocol))
        for protocol in range(pickle.HIGHEST_PROTOCOL + 1)
    ]
    for twin in (*pickled, copy.copy(named), copy.deepcopy(named), named.copy()):
        assert type(twin) is Named
        assert twin == named
        assert twin.name == ["left"]
    assert copy.copy(named).name is named.name
    assert copy.deepcopy(named).name is not named.name


@every
def test_a_pickle_with_an_impossible_state_is_refused(kind: Any) -> None:
    settings, state, own = kind().__getstate__()
    numbers = len(state) - 3  # then the innovation and the two counts
    impossible = [(k, value) for k in range(numbers) for value in (math.nan, math.inf)]
    of_information = [] if "Handover" in kind.__name__ else [(1, 0.0), (1, -1.0)]
    for position, value in [*impossible, *of_information]:
        broken = (*state[:position], value, *state[position + 1 :])
        with pytest.raises(ValueError, match="pickled state: got"):
            kind.__new__(kind).__setstate__((settings, broken, own))
    with pytest.raises(ValueError, match="initial_ratio"):
        kind.__new__(kind).__setstate__(({**settings, "initial_ratio": math.inf}, state, own))


@pytest.mark.parametrize("kind", [palpate.HandoverRls, palpate.HandoverRls32])
def test_a_pickle_with_an_impossible_count_is_refused(kind: Any) -> None:
    """Of blocks of a size there are three at most; what waits to be learned are 128 samples at most."""
    settings, state, own = kind().__getstate__()
    refused = 0
    for position in range(len(state) - 3):
        try:
            kind.__new__(kind).__setstate__(
                (settings, (*state[:position], 1e9, *state[position + 1 :]), own)
            )
        except ValueError:
            refused += 1
    assert refused == 15  # the counts of 14 levels, and what waits
