"""What a numpy user expects of the bound classes: arrays in, arrays out, clear errors."""

import math
import pickle
import threading
import time
from typing import Any

import numpy as np
import palpate
import pytest
from estimators import every
from measure import bits
from palpate import reference

RANDOM = np.random.default_rng(1)
REGRESSOR = RANDOM.uniform(0.1, 0.5, 300)
OUTPUT = 2.5 * REGRESSOR + 0.004 * RANDOM.standard_normal(300)


def dtype_of(kind: Any) -> np.dtype[Any]:
    return np.dtype(np.float32 if kind.__name__.endswith("32") else np.float64)


@every
def test_process_returns_its_own_type(kind: Any) -> None:
    ratios = kind().process(OUTPUT, REGRESSOR)
    assert ratios.dtype == dtype_of(kind)
    assert ratios.shape == (300,)
    assert ratios[-1] == pytest.approx(2.5, rel=0.01)


@every
@pytest.mark.parametrize(
    "convert",
    [
        list,
        tuple,
        lambda a: np.repeat(a, 2)[::2],
        lambda a: a[::-1].copy()[::-1],
        lambda a: np.column_stack([a, a])[:, 1],
        lambda a: a.astype(a.dtype.newbyteorder()),
        lambda a: a.astype(np.longdouble),
        lambda a: np.frombuffer(b"x" + a.tobytes(), np.uint8)[1:].view(a.dtype),
    ],
    ids=["list", "tuple", "every second", "reversed", "column", "swapped bytes", "longdouble", "unaligned"],
)
def test_any_layout_gives_the_same_bits(kind: Any, convert: Any) -> None:
    output, regressor = OUTPUT.astype(dtype_of(kind)), REGRESSOR.astype(dtype_of(kind))
    expected = kind().trace(output, regressor)
    assert bits(kind().trace(convert(output), convert(regressor))) == bits(expected)


@every
def test_integers_and_booleans_are_numbers(kind: Any) -> None:
    assert (
        kind().process(np.array([2, 4], np.int16), [True, True]).tolist() == kind().process([2.0, 4.0], [1, 1]).tolist()
    )


@every
def test_an_empty_block_does_nothing(kind: Any) -> None:
    estimator = kind()
    assert estimator.process([], []).shape == (0,)
    assert estimator.trace(np.empty(0), []).shape == (0,)
    assert estimator == kind()


@every
@pytest.mark.parametrize(
    ("output", "regressor", "error", "message"),
    [
        ([1.0, 2.0], [1.0], ValueError, r"regressor: got shape \(1,\), allowed: \(2,\)"),
        ([[1.0, 2.0]], [[1.0, 2.0]], ValueError, r"output: got shape \(1, 2\), allowed: \(n,\)"),
        (1.0, 1.0, ValueError, r"output: got shape \(\), allowed: \(n,\)"),
        ([1j], [1.0], TypeError, r"output: got dtype complex128, allowed: real numbers"),
        ([1.0], ["a"], TypeError, r"regressor: got dtype <U1, allowed: real numbers"),
        ([None], [1.0], TypeError, r"output: got dtype object, allowed: real numbers"),
        ([1.0, [2.0]], [1.0], ValueError, "inhomogeneous"),
    ],
)
def test_bad_blocks_are_refused_whole(kind: Any, output: Any, regressor: Any, error: Any, message: str) -> None:
    estimator = kind()
    for method in (estimator.process, estimator.trace):
        with pytest.raises(error, match=message):
            method(output, regressor)
    assert estimator == kind()


@every
def test_out_is_written_and_returned(kind: Any) -> None:
    expected = kind().process(OUTPUT, REGRESSOR)
    out = np.full(600, np.nan, dtype_of(kind))
    assert kind().process(OUTPUT, REGRESSOR, out=out[:300]).base is out
    kind().process(OUTPUT, REGRESSOR, out[300:][::-1])
    assert np.array_equal(out[:300], expected)
    assert np.array_equal(out[300:][::-1], expected)
    rows = kind().trace(OUTPUT, REGRESSOR)
    out_rows = np.zeros(600, rows.dtype)[::2]
    assert kind().trace(OUTPUT, REGRESSOR, out=out_rows) is out_rows
    assert bits(out_rows) == bits(rows)


@every
def test_a_bad_out_is_refused(kind: Any) -> None:
    estimator, dtype = kind(), dtype_of(kind)
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
        (np.lib.stride_tricks.as_strided(np.zeros(1, dtype), (300,), (0,)), ValueError, "items share one place"),
        ([0.0] * 300, TypeError, "out: got <class 'list'>, allowed: a numpy array"),
    ]:
        with pytest.raises(error, match=message):
            estimator.process(OUTPUT, REGRESSOR, out=out)
    with pytest.raises(TypeError, match="out: got dtype"):
        estimator.trace(OUTPUT, REGRESSOR, out=np.empty(300, dtype))
    assert estimator == kind()


@every
@pytest.mark.parametrize("shift", [-3, -1, 0, 1, 3])
def test_out_may_overlap_the_samples(kind: Any, shift: int) -> None:
    dtype = dtype_of(kind)
    expected = kind().process(OUTPUT[5:-5], REGRESSOR[5:-5])
    for name in ("output", "regressor"):
        output, regressor = OUTPUT.astype(dtype), REGRESSOR.astype(dtype)
        shared = output if name == "output" else regressor
        kind().process(output[5:-5], regressor[5:-5], out=shared[5 + shift : 295 + shift])
        assert np.array_equal(shared[5 + shift : 295 + shift], expected)
    every_second = np.repeat(OUTPUT, 2).astype(dtype)
    out = every_second[:300]
    assert np.array_equal(kind().process(every_second[::2], REGRESSOR, out=out), kind().process(OUTPUT, REGRESSOR))
    reverse = OUTPUT.astype(dtype)
    kind().process(reverse[5:-5], REGRESSOR[5:-5], out=reverse[5:-5][::-1])
    assert np.array_equal(reverse[5:-5][::-1], expected)


@every
def test_update_takes_numbers_only(kind: Any) -> None:
    estimator = kind()
    for good in [(1, 2), (np.float32(1), np.int8(2)), (True, 1.5)]:
        assert isinstance(estimator.update(*good), float)
    for bad in [("1", 2.0), (None, 1.0), (1.0,), (1.0, 2.0, 3.0), (1j, 1.0)]:
        with pytest.raises(TypeError):
            estimator.update(*bad)
    with pytest.raises(TypeError):
        estimator.update(output=1.0, regressor=1.0)
    assert estimator.samples == 3


@every
@pytest.mark.parametrize("bad", [(math.nan, 1.0), (1.0, math.inf), (-math.inf, math.nan), (1.0, 1e300)])
def test_a_sample_that_is_not_usable_is_refused_and_counted(kind: Any, bad: tuple[float, float]) -> None:
    estimator = kind()
    before = estimator.update(0.5, 0.25), estimator.covariance, estimator.innovation
    assert estimator.update(*bad) == before[0]
    assert (estimator.ratio, estimator.covariance, estimator.innovation) == before
    assert (estimator.samples, estimator.rejected) == (1, 1)


def test_a_sample_that_would_make_the_statistic_infinite_is_refused() -> None:
    estimator = palpate.AdaptiveRls()
    for _ in range(3):
        estimator.update(1.7e308, 1e-300)
    assert (estimator.samples, estimator.rejected) == (1, 2)
    assert math.isfinite(estimator.statistic)


@pytest.mark.parametrize("kind", [palpate.AdaptiveRls, palpate.AdaptiveRls32])
def test_an_alarm_is_cleared_at_zero_and_with_a_clear_level_earlier(kind: Any) -> None:
    # Regressor 0: the innovation is the output, and exact. g: 0.5, 1.25, 0.75, 0.25, 0, 0.5.
    outputs, regressors = [1.0, 1.25, 0.0, 0.0, 0.0, 1.0], [0.0] * 6
    settings: Any = {"drift": 0.5, "threshold": 1.0}
    expected = {
        0.0: [False, True, True, True, False, False],
        0.25: [False, True, True, False, False, False],  # not above the level is cleared
        0.5: [False, True, True, False, False, False],
        1.0: [False, True, False, False, False, False],
    }
    for clear_level, alarms in expected.items():
        rows = kind(**settings, clear_level=clear_level).trace(outputs, regressors)
        assert rows["statistic"].tolist() == [0.5, 1.25, 0.75, 0.25, 0.0, 0.5]
        assert rows["alarm"].tolist() == alarms
        exact = reference.adaptive_rls(outputs, regressors, **settings, clear_level=clear_level)
        assert exact.alarm.tolist() == alarms
    # The factor follows the alarm: R after each sample of regressor 0 is lambda R.
    rows = kind(**settings, initial_covariance=1.0).trace(outputs, regressors)
    steps = np.diff(np.log(rows["covariance"]), prepend=0.0)
    assert np.exp(-steps) == pytest.approx(np.where(rows["alarm"], 0.9, 0.995), rel=1e-5)


@pytest.mark.parametrize("kind", [palpate.AdaptiveRls, palpate.AdaptiveRls32])
def test_an_alarm_below_the_threshold_survives_what_changes_nothing(kind: Any) -> None:
    estimator = kind(drift=0.5, threshold=1.0)
    estimator.process([1.0, 1.25, 0.0, 0.0], [0.0] * 4)
    assert (estimator.statistic, estimator.alarm) == (0.25, True)
    estimator.update(math.nan, 0.0)
    twins = [estimator, estimator.copy(), pickle.loads(pickle.dumps(estimator))]
    for twin in twins:
        assert (twin.statistic, twin.alarm) == (0.25, True)
        twin.update(0.5, 0.0)
        assert (twin.statistic, twin.alarm) == (0.25, True)
        twin.reset()
        assert (twin.statistic, twin.alarm) == (0.0, False)


@pytest.mark.parametrize(
    ("kind", "settings", "message"),
    [
        (palpate.Rls, {"forgetting": 0.0}, "forgetting: got 0.0, allowed: 0 < forgetting <= 1"),
        (palpate.Rls, {"forgetting": 1.5}, "forgetting: got 1.5"),
        (palpate.Rls, {"forgetting": math.nan}, "forgetting: got nan"),
        (palpate.AdaptiveRls, {"steady": -1}, "steady: got -1.0"),
        (palpate.AdaptiveRls, {"alarmed": 0.999}, r"alarmed: got 0.999, allowed: 0 < alarmed <= steady \(0.995\)"),
        (palpate.AdaptiveRls, {"drift": -0.1}, "drift: got -0.1, allowed: 0 <= drift, finite"),
        (palpate.AdaptiveRls, {"drift": math.inf}, "drift: got inf"),
        (palpate.AdaptiveRls, {"threshold": math.nan}, "threshold: got nan, allowed: 0 <= threshold"),
        (
            palpate.AdaptiveRls,
            {"clear_level": -1e-9},
            r"clear_level: got -1e-09, allowed: 0 <= clear_level <= threshold",
        ),
        (palpate.AdaptiveRls, {"clear_level": 0.06}, r"clear_level: got 0.06, .* threshold \(0.05\)"),
        (palpate.AdaptiveRls, {"clear_level": math.nan}, "clear_level: got nan"),
        (palpate.Rls, {"initial_ratio": math.inf}, "initial_ratio: got inf, allowed: a finite number"),
        (palpate.Rls, {"initial_covariance": 0}, "initial_covariance: got 0.0, allowed: 2.2"),
        (
            palpate.Rls,
            {"initial_covariance": 1e13},
            r"initial_covariance: got 10000000000000.0, .* \(1000000000000.0\)",
        ),
        (palpate.Rls, {"max_covariance": math.inf}, "max_covariance: got inf, allowed: 2.2"),
        (palpate.Rls32, {"max_covariance": 1e39}, "max_covariance: got 1e.39, allowed: 1.17"),
        (palpate.Rls32, {"initial_ratio": 1e39}, "initial_ratio: got 1e.39"),
    ],
)
def test_parameters_are_checked(kind: Any, settings: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        kind(**settings)


@every
def test_parameters_are_keywords(kind: Any) -> None:
    with pytest.raises(TypeError):
        kind(0.995)
    with pytest.raises(TypeError):
        kind(colour=1)


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


@every
def test_long_blocks_let_other_threads_run(kind: Any) -> None:
    """A long block leaves the interpreter free, and the estimator says so to whoever touches it meanwhile."""
    size = 2_000_000
    regressor = np.ones(size, dtype_of(kind))
    estimator = kind()
    refused = threading.Event()
    started = threading.Event()

    def meddle() -> None:
        started.wait()
        while not refused.is_set() and worker.is_alive():
            try:
                estimator.update(math.nan, 1.0)
            except RuntimeError as error:
                assert "another thread" in str(error)  # noqa: PT017
                refused.set()

    def work() -> None:
        started.set()
        end = time.monotonic() + 60
        while not refused.is_set() and time.monotonic() < end:
            try:
                estimator.process(regressor, regressor)
            except RuntimeError:
                continue

    worker, other = threading.Thread(target=work), threading.Thread(target=meddle)
    other.start()
    worker.start()
    worker.join()
    other.join()
    assert refused.is_set()
    assert estimator.samples % size == 0
    assert estimator.update(1.0, 1.0) == pytest.approx(1.0)


@every
def test_idle_for_a_million_samples(kind: Any) -> None:
    short = {"forgetting": 0.9, "steady": 0.9, "alarmed": 0.5}
    estimator = kind(**{name: value for name, value in short.items() if name in kind().settings})
    estimator.process(OUTPUT, REGRESSOR)
    ratio = estimator.ratio
    estimator.process(np.zeros(1_000_000), np.zeros(1_000_000))
    assert estimator.ratio == ratio
    assert estimator.covariance == pytest.approx(estimator.settings["max_covariance"])
    assert estimator.process(OUTPUT, REGRESSOR)[20] == pytest.approx(2.5, rel=0.05)


@pytest.mark.parametrize("magnitude", [1e-300, 1e-150, 1e-30, 1e30, 1e150])
def test_extreme_magnitudes_stay_finite(magnitude: float) -> None:
    estimator = palpate.AdaptiveRls()
    rows = estimator.trace(OUTPUT * magnitude, REGRESSOR * magnitude)
    assert np.isfinite(rows["ratio"]).all()
    assert (rows["covariance"] > 0).all()
    assert estimator.rejected == 0
    # So small that the prior outweighs them: the initial ratio stays, and the covariance says so.
    expected = 2.5 if magnitude > 1 else 1.0
    assert estimator.ratio == pytest.approx(expected, rel=0.01)
    assert (estimator.covariance > 1e4) == (magnitude < 1)
