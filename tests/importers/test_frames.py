"""Data frames of pandas, polars and Arrow, dicts and structured arrays: read as they are, without a copy."""

from collections.abc import Callable
from typing import Any

import numpy as np
import palpate
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from numpy.typing import NDArray
from palpate.errors import RecordingError
from palpate.simulation import scenarios

PLAY = scenarios.run("stiff-steady")
N = len(PLAY.hard)
BASE = {"t": PLAY.t_hard_s, "t_soft": PLAY.t_soft_s, "C1": PLAY.hard, "C2": PLAY.soft}
DATES = np.datetime64("2026-03-01T10:00:00", "ns") + np.rint(PLAY.t_hard_s * 1e9).astype("m8[ns]")
UTC_NS = 1_772_359_200_000_000_000


def structured(columns: dict[str, NDArray[Any]]) -> NDArray[np.void]:
    made = np.zeros(N, [(name, values.dtype) for name, values in columns.items()])
    for name, values in columns.items():
        made[name] = values
    return made


KINDS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "pandas": pd.DataFrame,
    "pandas Float64": lambda columns: pd.DataFrame(columns).astype("Float64"),
    "pandas of Arrow": lambda columns: pd.DataFrame(columns).convert_dtypes(
        dtype_backend="pyarrow"
    ),
    "pandas object": lambda columns: pd.DataFrame(columns).astype(object),
    "polars": pl.DataFrame,
    "Arrow table": pa.table,
    "Arrow reader": lambda columns: pa.table(columns).to_reader(max_chunksize=100),
    "dict": dict,
    "structured array": structured,
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_touches_of_a_frame_are_those_of_its_arrays(kind: str) -> None:
    found = palpate.read(KINDS[kind](BASE))
    assert palpate.touches(found) == palpate.touches(PLAY, full_scale=np.inf) != []
    assert palpate.touches(KINDS[kind](BASE)) == palpate.touches(found)
    assert found.understood.startswith("time = t")
    assert "hard = C1, pF; soft = C2, pF; 38.4" in found.understood


def test_contiguous_float64_is_not_copied() -> None:
    for frame in (
        KINDS["pandas"](BASE),
        KINDS["pandas Float64"](BASE),
        KINDS["polars"](BASE),
        BASE,
    ):
        found = palpate.read(frame)
        for array, name in (
            (found.t_hard_s, "t"),
            (found.t_soft_s, "t_soft"),
            (found.hard, "C1"),
            (found.soft, "C2"),
        ):
            assert np.shares_memory(array, np.asarray(frame[name]))


@pytest.mark.parametrize("unit", ["ms", "ns"])
def test_dates_and_durations_are_times(unit: str) -> None:
    dates = DATES.astype(f"M8[{unit}]")
    plain = {"when": dates, "C1": PLAY.hard, "C2": PLAY.soft}
    zoned = pd.DatetimeIndex(dates).tz_localize("UTC")
    channels = {"C1": PLAY.hard, "C2": PLAY.soft}
    berlin = pl.DataFrame(plain).with_columns(
        pl.col("when").dt.replace_time_zone("UTC").dt.convert_time_zone("Europe/Berlin")
    )
    expected = (dates - dates[0]) / np.timedelta64(1, "s")
    for frame, utc in (
        (pd.DataFrame(plain), None),
        (pd.DataFrame(channels, index=pd.DatetimeIndex(dates)), None),
        (pd.DataFrame(channels, index=pd.TimedeltaIndex(dates - dates[0])), None),
        (pl.DataFrame({**plain, "when": dates - dates[0]}), None),
        (pd.DataFrame({**plain, "when": zoned}), UTC_NS),
        (pd.DataFrame(channels, index=zoned.tz_convert("Europe/Berlin")), UTC_NS),
        (pd.DataFrame({**plain, "when": zoned}).convert_dtypes(dtype_backend="pyarrow"), UTC_NS),
        (berlin, UTC_NS),
    ):
        found = palpate.read(frame)
        assert np.array_equal(found.t_hard_s - found.t_hard_s[0], expected), type(frame)
        first = utc and utc + int((dates[0] - DATES[0].astype("M8[s]")) / np.timedelta64(1, "ns"))
        assert found.zero_utc_ns == first


def test_an_index_is_a_column_if_it_has_a_name() -> None:
    for name, times in ((None, np.full(N, np.nan)), ("t", PLAY.t_hard_s)):
        frame = pd.DataFrame(
            {"C1": PLAY.hard, "C2": PLAY.soft}, index=pd.Index(PLAY.t_hard_s, name=name)
        )
        assert np.array_equal(palpate.read(frame).t_hard_s, times, equal_nan=True)


def test_values_of_other_types() -> None:
    short = {"t": np.arange(60) * 0.026, "C1": 5 + np.arange(60) / 8, "C2": 3 + np.arange(60) / 16}
    missing = np.where(np.arange(60) == 3, np.nan, short["C1"])
    nulls = [None if np.isnan(value) else value for value in missing.tolist()]
    whole = np.where(np.isnan(missing), 0, missing * 8).astype(int)
    for frame, expected in (
        (pd.DataFrame(short).astype({"C1": "float32"}), short["C1"]),
        (pa.table({**short, "C1": pa.array(short["C1"]).cast(pa.decimal128(20, 9))}), short["C1"]),
        (
            pl.DataFrame({**short, "C1": pl.Series(short["C1"]).cast(pl.Decimal(20, 9))}),
            short["C1"],
        ),
        (pd.DataFrame({**short, "C1": pd.array(nulls, "Float64")}), missing),
        (pl.DataFrame({**short, "C1": nulls}), missing),
        (pa.table({**short, "C1": nulls}), missing),
        (
            pa.table({**short, "C1": [None if value == 0 else int(value) for value in whole]}),
            missing * 8,
        ),
        ({**short, "C1": np.where(np.arange(60) == 3, 9.9e37, short["C1"])}, missing),
    ):
        found = palpate.read(frame, unit="pF")
        assert np.array_equal(found.hard, expected, equal_nan=True), frame


def test_units_beside_the_names() -> None:
    channels = {"t": PLAY.t_hard_s, "C1": PLAY.hard * 1000, "C2": PLAY.soft * 1000}
    in_pandas = pd.DataFrame(channels)
    in_pandas.attrs["units"] = {"t": "s", "C1": "fF", "C2": "fF"}
    fields = [
        pa.field(name, pa.float64(), metadata={"unit": "fF"} if name != "t" else None)
        for name in channels
    ]
    two_rows = in_pandas.set_axis(
        pd.MultiIndex.from_tuples([("t", "s"), ("C1", "fF"), ("C2", "fF")]), axis=1
    )
    for frame in (in_pandas, two_rows, pa.table(list(channels.values()), schema=pa.schema(fields))):
        found = palpate.read(frame)
        assert "hard = C1, fF" in found.understood
        assert np.allclose(found.hard, PLAY.hard, rtol=1e-15)


def test_a_masked_value_is_none() -> None:
    masked = np.ma.masked_array(np.where(np.arange(N) == 7, 1e3, PLAY.hard), np.arange(N) == 7)
    found = palpate.read({**BASE, "C1": masked})
    assert np.flatnonzero(np.isnan(found.hard)).tolist() == [7]
    assert [note for note in found.notes if "1 of" in note and "left out" in note]


def test_a_column_that_is_not_wanted_may_have_anything() -> None:
    assert len(palpate.read(pa.table({**BASE, "x": [[1.0]] * N}))) == N


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (pd.DataFrame(BASE)[:0], r"pandas.DataFrame: .* got columns of shapes \[\(0,\)\]"),
        (pl.DataFrame({"C1": [1.0, 2.0]}), "polars.DataFrame: not a recording: .* two columns or more"),
        (pa.table({**BASE, "C1": [[1.0]] * N}), r"in column 3 \(C1\) is neither a number"),
        ({**BASE, "C1": np.full(N, 1j)}, r"in column 3 \(C1\) is neither a number"),
        ({**BASE, "C1": PLAY.hard > 7}, r"'(True|False)' in column 3 \(C1\) is neither a number"),
        ({**BASE, "C1": DATES}, r"'2026-03-01T10.*' in column 3 \(C1\) is neither a number"),
        ({"C1": PLAY.hard, "C2": PLAY.soft[:9]}, r"got columns of shapes \[\(9,\), \(.*,\)\], allowed: .* one shape"),
    ],
)  # fmt: skip
def test_what_is_no_recording(source: Any, message: str) -> None:
    with pytest.raises(RecordingError, match=message):
        palpate.read(source)


@pytest.mark.parametrize(
    "source",
    [
        5,
        None,
        [1.0, 2.0],
        np.zeros((3, 2)),
        pl.DataFrame(BASE).lazy(),
        pl.Series([1.0]),
        pd.Series([1.0]),
    ],
)
def test_what_is_no_frame(source: Any) -> None:
    with pytest.raises(TypeError, match="allowed: a path, a data frame of pandas, polars or Arrow"):
        palpate.read(source)


def test_labels_that_are_numbers() -> None:
    columns = [PLAY.t_hard_s, PLAY.hard, PLAY.soft]
    unclear = pd.DataFrame(np.column_stack(columns))  # labels 0, 1, 2
    with pytest.raises(ValueError, match="got 1, the name or position of 2 columns"):
        palpate.read(unclear, columns={"hard": 1, "soft": 2, "time": "0"}, unit="pF")
    found = palpate.read(
        pd.DataFrame(dict(enumerate(columns, 1))), columns={"hard": 2, "soft": "3"}, unit="pF"
    )
    assert (found.hard.tolist(), found.soft.tolist()) == (PLAY.hard.tolist(), PLAY.soft.tolist())


def test_the_decimal_mark_of_texts_in_a_frame() -> None:
    texts = [f"{value:.4f}".replace(".", ",") for value in PLAY.hard]
    frame = pd.DataFrame({**BASE, "C1": texts})
    assert np.allclose(
        palpate.read(frame, unit="pF", decimal="comma").hard, PLAY.hard, rtol=0, atol=1e-4
    )
    with pytest.raises(RecordingError, match="is neither a number with a decimal point"):
        palpate.read(frame, unit="pF")
