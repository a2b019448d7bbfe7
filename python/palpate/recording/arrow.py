"""A recording as a data frame, and back with the same bits.

Its columns have everything that touches depend on.

So it survives a polars frame, which has no metadata, and a part of the rows.
"""

import math
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.registers import SATURATED_PF
from palpate.dataframe import arrow_field
from palpate.errors import need
from palpate.files import Json
from palpate.importers.table import Table
from palpate.importers.table_checks import channel_notes, rate_of, rate_text
from palpate.importers.times import read_times
from palpate.messages import quoted
from palpate.recording.recording import Recording
from palpate.recording.rows import LARGEST_STATUS
from palpate.samples import blank, usable_readings

_UNITS = {
    "t_hard_s": "s",
    "t_soft_s": "s",
    "hard_pF": "pF",
    "soft_pF": "pF",
    "full_scale_pF": "pF",
    "period_s": "s",
}
_TIMES = (("t_hard_s", "t_soft_s"), ("t_hard_ns", "t_soft_ns"))
ROWS_ONLY = (
    "rows of a recording of palpate without its sidecar: they are not verified; "
    "its range, gaps and tares are not known"
)
"""Note of a frame of palpate's own Parquet file that another program read."""


def to_arrow(recording: Recording) -> Any:
    """Return a recording as a pyarrow.Table.

    Its columns are t_hard_s, t_soft_s (if it has times), hard_pF, soft_pF; and, where they say
    something: utc; gap, True in a row from which on the earlier baseline is not valid;
    full_scale_pF, host_stamps and period_s, the same in all rows.
    """
    arrow = need("pyarrow", "tables")
    rows = len(recording.hard)
    timed = recording.timed
    columns: Json = {}
    if timed:
        columns["t_hard_s"] = arrow.array(recording.t_hard_s)
        columns["t_soft_s"] = arrow.array(recording.t_soft_s)
    columns["hard_pF"] = arrow.array(recording.hard)
    columns["soft_pF"] = arrow.array(recording.soft)
    if recording.zero_utc_ns is not None and timed:
        columns["utc"] = arrow.array(recording.utc_ns.view("M8[ns]"), arrow.timestamp("ns", "UTC"))
    if recording.gap_rows:
        columns["gap"] = arrow.array(np.isin(np.arange(rows), recording.gap_rows))
    if recording.full_scale_pF != SATURATED_PF:
        columns["full_scale_pF"] = arrow.array(np.full(rows, recording.full_scale_pF))
    if recording.host_stamps:
        columns["host_stamps"] = arrow.array(np.full(rows, True))
    if recording.period_s:
        columns["period_s"] = arrow.array(np.full(rows, recording.period_s))
    fields = [arrow_field(name, cells.type, _UNITS.get(name)) for name, cells in columns.items()]
    return arrow.table(list(columns.values()), schema=arrow.schema(fields))


def own_frame(table: Table) -> Recording | None:
    """Return the recording of a frame that palpate made; None: another frame. Errors as `read`."""
    names = {column.name for column in table.columns}
    stamps = next((pair for pair in _TIMES if names >= {*pair}), None)
    is_own = names >= {"hard_pF", "soft_pF"} and (stamps or "full_scale_pF" in names)
    if not is_own:
        return None
    full_scale_pF = _full_scale_pF(table, names)
    hard = table.column("hard_pF").numbers()
    soft = table.column("soft_pF").numbers()
    if "status" in names:
        block = blank(len(table))
        block["hard"] = hard
        block["soft"] = soft
        block["status"] = _status(table)
        hard, soft = usable_readings(block, full_scale_pF)
    t_hard = t_soft = np.full(len(table), np.nan)
    if stamps:
        t_hard, t_soft = (read_times(table.column(name)).seconds for name in stamps)
    zero_utc_ns = None
    if "utc" in names:
        first_ns = read_times(table.column("utc")).zero_ns
        if first_ns is not None:
            zero_utc_ns = first_ns - round(float(t_hard[0]) * 1e9)
    gap_rows = list[int]()
    if "gap" in names:
        gap_rows = np.flatnonzero(_flags(table, "gap")).tolist()
    period_s = 0.0
    if "period_s" in names:
        period_s = float(_only(table.column("period_s").numbers()))
    rate = rate_of(t_hard)
    notes = [*channel_notes(t_hard, t_soft, hard, soft, rate), *table.notes]
    if "status" in names:
        notes.append(ROWS_ONLY)
    return Recording(
        t_hard,
        t_soft,
        hard,
        soft,
        notes=tuple(dict.fromkeys(notes)),
        full_scale_pF=full_scale_pF,
        host_stamps="host_stamps" in names and bool(_only(_flags(table, "host_stamps"))),
        period_s=period_s,
        gap_rows=tuple(row for row in gap_rows if row),
        zero_utc_ns=zero_utc_ns,
        understood=f"a recording of palpate as a data frame; {rate_text(rate)}; {len(table)} rows",
    )


def _full_scale_pF(table: Table, names: Collection[str]) -> float:
    """Return the full scale in the rows, else the one of the AD7746 if the rows have codes."""
    if "full_scale_pF" in names:
        cells = np.asarray(table.column("full_scale_pF").cells, float)  # numbers() refuses inf
        return float(_only(np.nan_to_num(cells, nan=np.inf, posinf=np.inf)))
    if "hard_raw" in names and table.column("hard_raw").numbers()[0] < 0:
        return math.inf
    return SATURATED_PF


def _flags(table: Table, name: str) -> NDArray[np.bool_]:
    """Return the values of a column of True and False, or of texts of them."""
    texts = [str(cell).strip().casefold() for cell in table.column(name).cells]
    wrong = set(texts) - {"true", "false"}
    if wrong:
        raise ValueError(f"{name}: got {quoted(min(wrong))}, allowed: True or False in each row")
    return np.array([text == "true" for text in texts])


def _only(values: NDArray[Any]) -> Any:
    if (values != values[0]).any():
        got = f"parts of different recordings in one frame ({values[0]} and others)"
        raise ValueError(f"recording: got {got}, allowed: one")
    return values[0]


def _status(table: Table) -> NDArray[np.float64]:
    column = table.column("status")
    values = column.numbers()
    wrong = ~np.isin(values, np.arange(LARGEST_STATUS + 1))
    column.refuse(wrong, f"is no status, allowed: whole numbers, 0 to {LARGEST_STATUS}")
    return values
