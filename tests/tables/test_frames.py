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


def chunked(columns: dict[str, NDArray[Any]]) -> pl.DataFrame:
    whole = pl.DataFrame(columns)
    return pl.concat([whole[:100], whole[100:]], rechunk=False)


KINDS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "pandas": pd.DataFrame,
    "pandas Float64": lambda columns: pd.DataFrame(columns).astype("Float64"),
    "pandas of Arrow": lambda columns: pd.DataFrame(columns).convert_dtypes(dtype_backend="pyarrow"),
    "pandas object": lambda columns: pd.DataFrame(columns).astype(object),
    "polars": pl.DataFrame,
    "polars in chunks": chunked,
    "Arrow table": pa.table,
    "Arrow batch": lambda columns: pa.table(columns).to_batches()[0],
    "Arrow reader": lambda columns: pa.table(columns).to_reader(max_chunksize=100),
    "dict": dict,
    "structured array": structured,
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_touches_of_a_frame_are_those_of_its_arrays(kind: str) -> None:
    found = palpate.read(KINDS[kind](BASE))
    assert palpate.touches(found) == palpate.touches(PLAY, full_scale=np.inf) != []
    assert palpate.touches(KINDS[kind](BASE)) == palpate.touches(found)
    assert [
        np.array_equal(getattr(found, name), getattr(PLAY, name)) for name in ("t_hard_s", "t_soft_s", "hard", "soft")
    ]
    assert found.understood.startswith("time = t")
    assert "hard = C1, pF; soft = C2, pF; 38.4" in found.understood


def address(values: Any) -> int:
    return int(values.__array_interface__["data"][0])


@pytest.mark.parametrize("kind", ["pandas", "pandas Float64", "polars", "Arrow table", "dict"])
def test_contiguous_float64_is_not_copied(kind: str) -> None:
    frame = KINDS[kind](BASE)
    arrays: dict[str, Callable[[str], Any]] = {
        "pandas": lambda name: frame[name].to_numpy(),
        "pandas Float64": lambda name: frame[name].to_numpy(),
        "polars": lambda name: frame[name].to_numpy(),
        "Arrow table": lambda name: frame[name].chunk(0).to_numpy(),
        "dict": lambda name: frame[name],
    }
    found = palpate.read(frame)
    columns = {"t": found.t_hard_s, "t_soft": found.t_soft_s, "C1": found.hard, "C2": found.soft}
    assert {name: address(values) for name, values in columns.items()} == {
        name: address(arrays[kind](name)) for name in columns
    }


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
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
        (pl.DataFrame(plain), None),
        (pa.table(plain), None),
        (pd.DataFrame(channels, index=pd.DatetimeIndex(dates)), None),
        (pd.DataFrame(channels, index=pd.DatetimeIndex(dates, name="when")), None),
        (pd.DataFrame(channels, index=pd.TimedeltaIndex(dates - dates[0])), None),
        (pl.DataFrame({**plain, "when": dates - dates[0]}), None),
        (pd.DataFrame({**plain, "when": zoned}), UTC_NS),
        (pd.DataFrame(channels, index=zoned.tz_convert("Europe/Berlin")), UTC_NS),
        (pd.DataFrame({**plain, "when": zoned}).convert_dtypes(dtype_backend="pyarrow"), UTC_NS),
        (berlin, UTC_NS),
        (berlin.to_arrow(), UTC_NS),
    ):
        found = palpate.read(frame)
        assert np.array_equal(found.t_hard_s - found.t_hard_s[0], expected), type(frame)
        first = utc and utc + int((dates[0] - DATES[0].astype("M8[s]")) / np.timedelta64(1, "ns"))
        assert found.zero_utc_ns == first


def test_an_index_without_name_and_dates_is_no_column() -> None:
    found = palpate.read(pd.DataFrame({"C1": PLAY.hard, "C2": PLAY.soft}, index=PLAY.t_hard_s))
    assert np.isnan(found.t_hard_s).all()
    named = pd.DataFrame({"C1": PLAY.hard, "C2": PLAY.soft}, index=pd.Index(PLAY.t_hard_s, name="t"))
    assert np.array_equal(palpate.read(named).t_hard_s, PLAY.t_hard_s)


def test_values_of_other_types() -> None:
    short = {"t": np.arange(60) * 0.026, "C1": 5 + np.arange(60) / 8, "C2": 3 + np.arange(60) / 16}
    missing = np.where(np.arange(60) == 3, np.nan, short["C1"])
    nulls = [None if np.isnan(value) else value for value in missing.tolist()]
    whole = np.where(np.isnan(missing), 0, missing * 8).astype(int)
    for frame, expected in (
        (pd.DataFrame(short).astype({"C1": "float32"}), short["C1"]),
        (pa.table({**short, "C1": pa.array(short["C1"]).cast(pa.decimal128(20, 9))}), short["C1"]),
        (pl.DataFrame({**short, "C1": pl.Series(short["C1"]).cast(pl.Decimal(20, 9))}), short["C1"]),
        (pd.DataFrame({**short, "C1": pd.array(nulls, "Float64")}), missing),
        (pd.DataFrame({**short, "C1": nulls}).astype({"C1": object}), missing),
        (pl.DataFrame({**short, "C1": nulls}), missing),
        (pa.table({**short, "C1": nulls}), missing),
        (
            pd.DataFrame({**short, "C1": pd.array([None if value == 0 else value for value in whole], "Int64")}),
            missing * 8,
        ),
        (pa.table({**short, "C1": [None if value == 0 else int(value) for value in whole]}), missing * 8),
        ({**short, "C1": np.ma.masked_invalid(missing)}, missing),
        ({**short, "C1": np.where(np.arange(60) == 3, 9.9e37, short["C1"])}, missing),
    ):
        found = palpate.read(frame, unit="pF")
        assert np.array_equal(found.hard, expected, equal_nan=True), frame


def test_units_beside_the_names() -> None:
    channels = {"t": PLAY.t_hard_s, "C1": PLAY.hard * 1000, "C2": PLAY.soft * 1000}
    in_pandas = pd.DataFrame(channels)
    in_pandas.attrs["units"] = {"t": "s", "C1": "fF", "C2": "fF"}
    fields = [
        pa.field("t", pa.float64()),
        *(pa.field(name, pa.float64(), metadata={"unit": "fF"}) for name in ("C1", "C2")),
    ]
    for frame in (in_pandas, pa.table(list(channels.values()), schema=pa.schema(fields))):
        found = palpate.read(frame)
        assert "hard = C1, fF" in found.understood
        assert np.allclose(found.hard, PLAY.hard, rtol=1e-15)


def test_rows_of_names_are_header_rows() -> None:
    frame = pd.DataFrame({("hard", "pF"): PLAY.hard, ("soft", "pF"): PLAY.soft, ("time", "s"): PLAY.t_hard_s})
    assert np.array_equal(palpate.read(frame).hard, PLAY.hard)


@pytest.mark.parametrize("kind", ["pandas", "polars", "Arrow table"])
def test_a_long_frame_with_categories(kind: str) -> None:
    words = ["a", "b"] * N
    column: Any = {"pandas": pd.Categorical, "polars": lambda w: pl.Series(w, dtype=pl.Categorical),
                   "Arrow table": lambda w: pa.array(w).dictionary_encode()}[kind](words)  # fmt: skip
    frame = KINDS[kind]({"t": np.repeat(PLAY.t_hard_s, 2), "id": column, "C": np.c_[PLAY.hard, PLAY.soft].ravel()})
    found = palpate.read(frame, columns={"hard": "a", "soft": "b"})
    assert np.array_equal(found.hard, PLAY.hard)
    assert np.array_equal(found.soft, PLAY.soft)


class Untouchable:
    """A value that nothing can be made of."""

    def __str__(self) -> str:
        """Fail."""
        raise AssertionError("touched")

    __repr__ = __float__ = __str__


def test_a_column_that_is_not_wanted_is_not_touched() -> None:
    strange = [Untouchable()] * N
    for frame in (
        pd.DataFrame({**BASE, "x": strange}),
        pl.DataFrame({**BASE, "x": pl.Series(strange, dtype=pl.Object)}),
        pa.table({**BASE, "x": [[1.0]] * N}),
        {**BASE, "x": np.full(N, 1j)},
    ):
        assert len(palpate.read(frame)) == N
        assert len(palpate.read(frame, columns={"hard": "C1", "soft": "C2", "time": "t"})) == N


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (pd.DataFrame(BASE)[:0], "pandas.DataFrame: has no rows"),
        (pd.DataFrame(), "pandas.DataFrame: has no rows"),
        (pl.DataFrame({"C1": [1.0, 2.0]}), "polars.DataFrame: not a recording: 1 column, two are needed"),
        (pa.table({**BASE, "C1": [[1.0]] * N}), r"column C1: got values of type list<item: double>, allowed: numbers, times, or text"),
        ({**BASE, "C1": np.full(N, 1j)}, "column C1: got values of type complex128, allowed: numbers"),
        ({**BASE, "C1": DATES}, r"column 3 \(C1\): got times, allowed: numbers"),
        ({"C1": PLAY.hard, "C2": PLAY.soft[:9]}, r"got arrays of shapes \[\(9,\), \(.*,\)\], allowed: one shape"),
    ],
)  # fmt: skip
def test_what_is_no_recording(source: Any, message: str) -> None:
    with pytest.raises(RecordingError, match=message):
        palpate.read(source)


def test_two_columns_of_one_name_are_told_apart_by_position() -> None:
    frame = pd.DataFrame(np.c_[PLAY.t_hard_s, PLAY.hard, PLAY.soft], columns=["t", "C", "C"])
    with pytest.raises(ValueError, match=r"hard and soft, two of 1 \(t\), 2 \(C\), 3 \(C\)"):
        palpate.read(frame)
    with pytest.raises(ValueError, match="the name of several columns, allowed: one of the positions 2, 3"):
        palpate.read(frame, columns={"hard": "C", "soft": 3})
    assert np.array_equal(palpate.read(frame, columns={"hard": 2, "soft": 3}).soft, PLAY.soft)


@pytest.mark.parametrize("source", [5, None, [1.0, 2.0], np.zeros((3, 2)), pl.DataFrame(BASE).lazy()])
def test_what_is_no_frame(source: Any) -> None:
    with pytest.raises(TypeError, match="allowed: a path, a data frame of pandas, polars or Arrow"):
        palpate.read(source)


def test_what_is_masked_is_no_value() -> None:
    masked = np.arange(N) % 50 == 7
    garbage = np.where(masked, 3.5, PLAY.hard)
    expected = np.where(masked, np.nan, PLAY.hard)
    rows = structured({**BASE, "C1": garbage})
    masks = np.zeros(N, [(name, bool) for name in BASE])
    masks["C1"] = masked
    for frame in (
        {**BASE, "C1": np.ma.masked_array(garbage, masked)},
        {**BASE, "C1": np.ma.masked_array(garbage.astype(str), masked)},
        {**BASE, "C1": np.ma.masked_array(garbage.astype(object), masked)},
        np.ma.masked_array(rows, masks),
    ):
        found = palpate.read(frame, unit="pF")
        assert np.array_equal(found.hard, expected, equal_nan=True)
        assert found.notes == (f"{masked.sum()} of {N} rows have no value in a channel: left out",)
    for times in (BASE["t"], DATES):
        with pytest.raises(RecordingError, match=r"line 8: .* in column 1 \(t\): no time"):
            palpate.read({"t": np.ma.masked_array(times, masked), "C1": PLAY.hard, "C2": PLAY.soft})


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "pandas Float64"])  # there they are numbers
def test_true_and_false_are_no_capacitances(kind: str) -> None:
    with pytest.raises(RecordingError, match=r"True|False"):
        palpate.read(KINDS[kind]({**BASE, "C1": PLAY.hard > PLAY.hard.mean()}), unit="pF")


def test_true_false_and_missing_are_no_capacitances() -> None:
    values = [None, *(PLAY.hard > PLAY.hard.mean()).tolist()[1:]]
    for frame in (
        pd.DataFrame({**BASE, "C1": pd.array(values, "boolean")}),
        pl.DataFrame({**BASE, "C1": values}),
        pa.table({**BASE, "C1": values}),
    ):
        with pytest.raises(RecordingError, match="got True and False, allowed: numbers"):
            palpate.read(frame, unit="pF")


def test_labels_that_are_numbers() -> None:
    columns = [PLAY.t_hard_s, PLAY.hard, PLAY.soft]
    unclear = pd.DataFrame(np.column_stack(columns))  # labels 0, 1, 2
    with pytest.raises(
        ValueError, match=r'got 1, a position and the label of another column, allowed: .* "1" for column 2'
    ):
        palpate.read(unclear, columns={"hard": 1, "soft": 2, "time": "0"}, unit="pF")
    clear = pd.DataFrame(dict(enumerate(columns, 1)))
    named = pl.DataFrame({"3": PLAY.soft, "2": PLAY.hard, "1": PLAY.t_hard_s})
    cases: list[tuple[Any, dict[str, str | int]]] = [
        (unclear, {"hard": "1", "soft": "2", "time": "0"}),
        (clear, {"hard": 2, "soft": 3, "time": 1}),
        (named, {"hard": "2", "soft": "3", "time": "1"}),
        (pl.DataFrame(dict(zip(("t", "x", "y"), columns, strict=True))), {"hard": 2, "soft": "3", "time": 1}),
    ]
    for frame, asked in cases:
        found = palpate.read(frame, columns=asked, unit="pF")
        for field, values in (("t_hard_s", columns[0]), ("hard", columns[1]), ("soft", columns[2])):
            assert np.array_equal(getattr(found, field), values)


@pytest.mark.parametrize("one", [pl.Series, pd.Series, pa.array])
def test_a_series_is_no_recording(one: Callable[[Any], Any]) -> None:
    with pytest.raises(TypeError, match=r"got one column, .*, allowed: a data frame with both channels"):
        palpate.read(one(PLAY.hard))
