"""Columns of data frames are taken by position: only if their indices are equal."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import palpate
import pandas as pd
import polars as pl
import pytest
from numeric import every

DAYS = pd.date_range("2026-01-01", periods=400)
RANDOM = np.random.default_rng(0)
X = pd.Series(RANDOM.standard_normal(400), DAYS)
Y = 1.238 * X + 0.01 * RANDOM.standard_normal(400)
FRAME = pd.DataFrame({"a": X, "b": X**2})
OTHERS = {
    "a day later": X.shift(1, freq="D"),
    "in another order": X[::-1],
    "one is missing": X.drop(DAYS[7]),
    "numbered": X.reset_index(drop=True),
    "with a time zone": X.tz_localize("UTC"),
}
Bank = palpate.Bank
VectorRls: Any = palpate.VectorRls


def block_of(estimator: Any, method: str) -> Callable[..., Any]:
    """Return one of the two methods that take blocks."""
    blocks: dict[str, Callable[..., Any]] = {
        "process": estimator.process,
        "trace": estimator.trace,
    }
    return blocks[method]


@every
@pytest.mark.parametrize("method", ["process", "trace"])
def test_equal_indices_have_the_result_of_arrays(kind: Any, method: str) -> None:
    expected = block_of(kind(), method)(Y.to_numpy(), X.to_numpy()).tobytes()
    same = X.set_axis(pd.DatetimeIndex(DAYS.tolist(), name="another name"))
    for output, regressor in (
        (Y, X),
        (Y, same),
        (Y, X.to_numpy()),
        (Y.tolist(), X),
        (pl.Series(Y), X),
        (pl.Series(Y), pl.Series(X)),
    ):
        assert block_of(kind(), method)(output, regressor).tobytes() == expected


@every
@pytest.mark.parametrize("method", ["process", "trace"])
@pytest.mark.parametrize("other", OTHERS)
def test_other_indices_are_refused(kind: Any, method: str, other: str) -> None:
    estimator = kind()
    message = r"^regressor: got another index than that of output \(.*: .*, not 2026-01-0.*\), allowed: the same"
    with pytest.raises(ValueError, match=message):
        block_of(estimator, method)(Y, OTHERS[other])
    with pytest.raises(ValueError, match=r"^regressor: got another index than that of output"):
        block_of(estimator, method)(regressor=Y, output=OTHERS[other])
    assert estimator == kind()


@pytest.mark.parametrize("other", ["a day later", "in another order", "one is missing"])
def test_the_message_is_a_program_that_aligns(other: str) -> None:
    """It is run; then the ratio is the true one. Rows by position give another one."""
    regressor = OTHERS[other]
    with pytest.raises(ValueError, match="write ") as caught:
        palpate.Rls().process(Y, regressor)
    program = str(caught.value).partition("write ")[2].partition(";")[0]
    names = {"output": Y, "regressor": regressor}
    exec(program, names)  # noqa: S102  palpate wrote it
    ratio = palpate.Rls().process(names["output"], names["regressor"])[-1]
    expected = Y.align(regressor, join="inner")
    assert ratio == palpate.Rls().process(*(each.to_numpy() for each in expected))[-1]
    if other != "a day later":  # it has another true ratio
        assert ratio == pytest.approx(1.238, rel=0.01)
        by_position = palpate.Rls().process(Y.to_numpy()[: len(regressor)], regressor.to_numpy())
        assert abs(by_position[-1]) < 0.5


def test_a_data_frame_of_regressors_is_aligned_with_a_column() -> None:
    expected = VectorRls(2).process(Y.to_numpy(), FRAME.to_numpy())
    assert VectorRls(2).process(Y, FRAME).tobytes() == expected.tobytes()
    for frame in (FRAME[1:], FRAME[::-1]):
        with pytest.raises(ValueError, match=r"^regressors: got another index") as caught:
            VectorRls(2).trace(Y, frame)
        program = str(caught.value).partition("write ")[2].partition(";")[0]
        names = {"output": Y, "regressors": frame}
        exec(program, names)  # noqa: S102  palpate wrote it
        found = VectorRls(2).process(names["output"], names["regressors"])
        assert found[-1] == pytest.approx([1.238, 0.0], abs=0.01)


def test_a_bank_takes_rows_and_columns_in_one_order() -> None:
    bank = Bank(palpate.Rls(), 2)
    upper = FRAME.rename(columns=str.upper)
    assert bank.process(FRAME, upper)[-1] == pytest.approx([1.0, 1.0])
    bank.process(FRAME, X)
    bank.update(FRAME.iloc[0], FRAME.iloc[1])
    before = bank.samples.tolist()
    for regressor in (FRAME[::-1], X[::-1]):
        with pytest.raises(ValueError, match=r"regressor: got another index .*align"):
            bank.process(FRAME, regressor)
    message = r"regressor: got the columns of output in another order \(column 0: b, not a\), .* "
    with pytest.raises(ValueError, match=message + r"write regressor\[output.columns\]$"):
        bank.process(FRAME, FRAME[["b", "a"]])
    with pytest.raises(ValueError, match=r"regressor: got another index .*row 0: b, not a"):
        bank.update(FRAME.iloc[0], FRAME.iloc[1][::-1])
    assert bank.samples.tolist() == before


READINGS = pd.Series(9 + RANDOM.standard_normal(400))
TIMES_S = pd.Series(0.026 * np.arange(400))
LATER = READINGS.shift()[1:]


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: palpate.Tracker().process(TIMES_S, TIMES_S, READINGS, READINGS[::-1]), "soft"),
        (lambda: palpate.Tracker().take(TIMES_S, TIMES_S[::-1], READINGS, READINGS), "t_soft"),
        (lambda: palpate.touches(READINGS, READINGS[::-1], rate_hz=40), "soft"),
        (lambda: palpate.touches(READINGS, READINGS, times_s=TIMES_S[::-1]), "times_s"),
        (lambda: palpate.touches({"hard": READINGS, "soft": READINGS[::-1]}), "soft"),
        (lambda: palpate.read({"hard": READINGS, "soft": LATER}), "soft"),
        (lambda: palpate.Recording(TIMES_S, TIMES_S, READINGS, READINGS[::-1]), "soft"),
    ],
)
def test_readings_and_times_have_one_index(call: Callable[[], Any], name: str) -> None:
    with pytest.raises(ValueError, match=f"^{name}: got another index than that of .*, allowed"):
        call()


@pytest.mark.parametrize("missing", [np.nan, pd.NA, pd.NaT, None])
def test_labels_that_are_missing_are_equal(missing: Any) -> None:
    some = pd.Series([1.0, 2.0], pd.Index([missing, "b"], dtype=object))
    assert palpate.Rls().process(some, some.copy()).shape == (2,)
    with pytest.raises(ValueError, match=r"row 1: c, not b"):
        palpate.Rls().process(some, some.set_axis(pd.Index([missing, "c"], dtype=object)))


def test_numbers_and_texts_that_look_the_same_are_refused() -> None:
    numbers = pd.Series([1.0, 2.0], [1, 2])
    with pytest.raises(ValueError, match=r"that of output \(labels of another type\)"):
        palpate.Rls().process(numbers, numbers.set_axis(["1", "2"]))


@every
def test_a_trace_is_a_data_frame_with_the_index_of_the_signals(kind: Any) -> None:
    rows = kind().trace(Y, X)
    frame = pd.DataFrame(rows, index=Y.index)
    assert frame.index.equals(DAYS)
    assert tuple(frame.columns) == rows.dtype.names
    for name in rows.dtype.names:
        assert np.array_equal(frame[name], rows[name], equal_nan=True)
    assert tuple(pl.from_numpy(rows).columns) == rows.dtype.names


def test_a_trace_of_several_coefficients_has_two_levels_of_columns() -> None:
    rows = VectorRls(2, intercept=True).trace(Y, FRAME)
    fields = {name: pd.DataFrame(rows[name], index=Y.index) for name in rows.dtype.names}
    frame = pd.concat(fields, axis=1)
    assert frame.index.equals(DAYS)
    assert frame["coefficients"].to_numpy().tobytes() == rows["coefficients"].tobytes()
    assert np.array_equal(frame["alarm"][0], rows["alarm"])
    assert frame.shape == (400, 9)


def test_arrays_need_no_pandas() -> None:
    program = "import sys, palpate; assert 'numpy' not in sys.modules; "
    program += "palpate.Rls().process([1.0, 2.0], (1.0, 2.0)); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert "numpy" in done.stdout.split()
    assert not {"pandas", "palpate.labels"} & set(done.stdout.split())
