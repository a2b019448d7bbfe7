"""A recording as a data frame, and back with the same bits: all that its touches depend on is in the columns.

So it survives a polars frame, which has no metadata, and a part of the rows.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.extras import need
from palpate.recording.exchange.columns_out import NAMES
from palpate.recording.recording import Recording
from palpate.samples import DTYPE, usable
from palpate.tables.table import Table

_ARRAYS = {"t_hard_s": "t_hard_s", "t_soft_s": "t_soft_s", "hard": "hard_pF", "soft": "soft_pF"}
_UNITS = {"t_hard_s": "s", "t_soft_s": "s", "hard_pF": "pF", "soft_pF": "pF", "full_scale_pF": "pF"}
ROWS_ONLY = (
    "rows of a recording of palpate without its sidecar: they are not verified; its range, gaps and tares are not known"
)
"""Note of a frame of palpate's own Parquet file that another program read."""


def to_arrow(recording: Recording) -> Any:
    """Return a recording as a pyarrow.Table.

    Its columns are t_hard_s, t_soft_s, hard_pF, soft_pF; and, where they say something: utc; gap, True in a row from which
    on the baseline before does not hold; full_scale_pF and host_stamps, the same in all rows.
    """
    arrow = need("pyarrow", "export")
    rows = len(recording.hard)
    columns: dict[str, Any] = {name: arrow.array(getattr(recording, field)) for field, name in _ARRAYS.items()}
    if recording.zero_utc_ns is not None and np.isfinite(recording.t_hard_s).all():
        columns["utc"] = arrow.array(recording.utc_ns.view("M8[ns]"), arrow.timestamp("ns", "UTC"))
    if recording.gap_rows:
        columns["gap"] = arrow.array(np.isin(np.arange(rows), recording.gap_rows))
    if recording.full_scale_pF != SATURATED_PF:
        columns["full_scale_pF"] = arrow.array(np.full(rows, recording.full_scale_pF))
    if recording.host_stamps:
        columns["host_stamps"] = arrow.array(np.ones(rows, bool))
    fields = [
        arrow.field(name, column.type, metadata={"unit": _UNITS[name]} if name in _UNITS else None)
        for name, column in columns.items()
    ]
    return arrow.table(list(columns.values()), schema=arrow.schema(fields))


def own_frame(table: Table) -> Recording | None:
    """Return the recording of a data frame that palpate made; None: one of another program."""
    columns = {column.names[-1]: column for column in table.columns if column.names and column.kind != "T"}
    if columns.keys() >= set(NAMES.values()):
        return _of_rows({field: np.asarray(columns[name].cells) for field, name in NAMES.items()})
    if not columns.keys() >= set(_ARRAYS.values()) or any(columns[name].kind != "f" for name in _ARRAYS.values()):
        return None
    arrays: dict[str, Any] = {field: columns[name].cells for field, name in _ARRAYS.items()}
    facts = {
        name: np.asarray(columns[name].cells)
        for name in ("full_scale_pF", "host_stamps", "gap", "utc")
        if name in columns
    }
    return Recording(
        **arrays,
        full_scale_pF=float(_only(facts.get("full_scale_pF", np.array([SATURATED_PF])))),
        host_stamps=bool(_only(facts.get("host_stamps", np.array([False])))),
        gap_rows=tuple(row for row in np.flatnonzero(facts.get("gap", [])).tolist() if row),
        zero_utc_ns=_zero(facts.get("utc"), arrays["t_hard_s"]),
        understood=f"a recording of palpate as a data frame; {len(table)} rows",
    )


def _only(values: NDArray[Any]) -> Any:
    if (values != values[0]).any():
        raise ValueError(
            f"recording: got parts of different recordings in one frame ({values[0]} and others), allowed: one"
        )
    return values[0]


def _zero(utc: NDArray[Any] | None, t_hard_s: NDArray[np.float64]) -> int | None:
    """Return UTC of second 0, ns since 1970."""
    if utc is None or not len(utc) or np.isnat(utc[0]):
        return None
    return int(utc[0].astype("M8[ns]").astype(np.int64)) - round(float(t_hard_s[0]) * 1e9)


def _of_rows(fields: dict[str, NDArray[Any]]) -> Recording:
    block = np.zeros(len(fields["seq"]), DTYPE)
    for name, values in fields.items():
        if DTYPE[name].kind in "iu" and values.dtype.kind not in "iu":
            raise ValueError(f"{NAMES[name]}: got {values.dtype}, allowed: whole numbers, one in each row")
        block[name] = values
    full_scale = SATURATED_PF if block["hard_raw"][0] >= 0 else np.inf
    readings = usable(block, full_scale)
    times = block["t_hard_ns"] / 1e9, block["t_soft_ns"] / 1e9
    return Recording(
        *times, *readings, notes=(ROWS_ONLY,), full_scale_pF=full_scale, understood=f"{len(block)} rows of palpate"
    )
