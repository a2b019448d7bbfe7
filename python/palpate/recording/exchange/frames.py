"""A recording as a data frame, and back with the same bits: all that its touches depend on is in the columns.

So it survives a polars frame, which has no metadata, and a part of the rows.
"""

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.errors import RecordingError, quoted
from palpate.extras import need
from palpate.recording.exchange.columns_out import NAMES
from palpate.recording.recording import Recording
from palpate.recording.rows import LARGEST_STATUS
from palpate.samples import DTYPE, blank, usable
from palpate.tables.cell.numbers import numbers
from palpate.tables.table import Table
from palpate.tables.times.steps import typical_step
from palpate.tables.times.times import Times, times
from palpate.tables.understanding import pace, rate_of, remarks

_ARRAYS = {"t_hard_s": "t_hard_s", "t_soft_s": "t_soft_s", "hard": "hard_pF", "soft": "soft_pF"}
_UNITS = {"t_hard_s": "s", "t_soft_s": "s", "hard_pF": "pF", "soft_pF": "pF", "full_scale_pF": "pF"}
_Array = NDArray[np.float64]
_MOST_STEPS = 10  # between the times of the channels in a row
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
    """Return the recording of a data frame that palpate made, or of its rows as text; None: one of another program.

    Raises
    ------
    RecordingError
        A cell is wrong, or a time is missing or goes back: with its row.
    ValueError
        Rows of different recordings, or a column that has not what palpate writes there.
    """
    names = {column.names[-1] for column in table.columns if column.names}
    rows = names >= set(NAMES.values())
    if not rows and not names >= set(_ARRAYS.values()):
        return None
    if rows:
        _require_whole(table)
    full_scale = _full_scale(table, names)
    stamps, seconds = _stamps(table, ("t_hard_ns", "t_soft_ns") if rows else ("t_hard_s", "t_soft_s"))
    readings = _readings(table, names, full_scale)
    rate = rate_of(seconds[0])
    notes = [*remarks((*seconds, *readings), rate), *table.notes, *(note for each in stamps for note in each.notes)]
    gaps = np.flatnonzero(_flags(table, "gap")).tolist() if "gap" in names else []
    known = stamps[0].zero_utc_ns if stamps else None
    return Recording(
        *seconds,
        *readings,
        notes=(*dict.fromkeys(notes), *([ROWS_ONLY] if "status" in names else [])),
        full_scale_pF=full_scale,
        host_stamps="host_stamps" in names and bool(_only(_flags(table, "host_stamps"))),
        gap_rows=tuple(row for row in gaps if row),
        zero_utc_ns=_zero(table, seconds[0]) if "utc" in names else known,
        understood=f"a recording of palpate as a data frame; {pace(rate)}; {len(table)} rows",
    )


def _full_scale(table: Table, names: Collection[str]) -> float:
    if "full_scale_pF" in names:
        cells = table.columns[table.column("full_scale_pF")].cells
        return float(_only(np.asarray(cells, float)))  # inf is a value here
    return np.inf if "hard_raw" in names and _numbers(table, "hard_raw")[0] < 0 else SATURATED_PF


def _readings(table: Table, names: Collection[str], full_scale_pF: float) -> tuple[_Array, _Array]:
    """Return the capacitances; with a status only those that a tracker may use."""
    hard, soft = _numbers(table, "hard_pF"), _numbers(table, "soft_pF")
    if "status" not in names:
        return hard, soft
    block = blank(len(table))
    block["hard"], block["soft"], block["status"] = hard, soft, _status(table)
    return usable(block, full_scale_pF)


def _stamps(table: Table, names: tuple[str, str]) -> tuple[list[Times], tuple[_Array, _Array]]:
    """Return the times of both channels, checked as those of other programs; none of a recording without times."""
    columns = [table.column(name) for name in names]
    if all(_are_missing(table, column) for column in columns):
        untimed = np.full(len(table), np.nan)
        return [], (untimed, untimed)
    hard, soft = (times(table, column) for column in columns)
    soft = soft.since(hard)
    apart, step = float(np.median(np.abs(soft.seconds - hard.seconds))), typical_step(hard.seconds)
    if step and apart > _MOST_STEPS * step:
        raise ValueError(
            f"{names[1]}: got times {apart:.3g} s from those of {names[0]}, allowed: less than {_MOST_STEPS} rows "
            f"({_MOST_STEPS * step:.3g} s)"
        )
    return [hard, soft], (hard.seconds, soft.seconds)


def _are_missing(table: Table, column: int) -> bool:
    first = str(table.columns[column].cells[0]).strip().casefold()
    return first in ("", "nan") and bool(np.isnan(numbers(table, column)).all())


def _numbers(table: Table, name: str) -> _Array:
    return numbers(table, table.column(name))


def _flags(table: Table, name: str) -> NDArray[np.bool_]:
    """Return the values of a column of True and False, or of texts of them."""
    column = table.columns[table.column(name)]
    if isinstance(column.cells, np.ndarray) and column.cells.dtype.kind == "b":
        return column.cells
    texts = [str(cell).strip().casefold() for cell in column.cells]
    wrong = next((text for text in texts if text not in ("true", "false")), None)
    if wrong is not None:
        raise ValueError(f"{name}: got {quoted(wrong)}, allowed: True or False in each row")
    return np.array([text == "true" for text in texts])


def _only(values: NDArray[Any]) -> Any:
    if (values != values[0]).any():
        raise ValueError(
            f"recording: got parts of different recordings in one frame ({values[0]} and others), allowed: one"
        )
    return values[0]


def _zero(table: Table, t_hard_s: _Array) -> int | None:
    """Return UTC of second 0, ns since 1970."""
    date_ns = times(table, table.column("utc")).date_ns
    return None if date_ns is None or np.isnan(t_hard_s[0]) else date_ns - round(float(t_hard_s[0]) * 1e9)


def _status(table: Table) -> _Array:
    values = _numbers(table, "status")
    wrong = ~((values >= 0) & (values <= LARGEST_STATUS) & (values == np.rint(values)))
    if wrong.any():
        row = int(np.argmax(wrong))
        reason = f"column status: got {values[row]:g}, allowed: whole numbers, 0 to {LARGEST_STATUS}"
        raise RecordingError(table.path, reason, table.lines[row])
    return values


def _require_whole(table: Table) -> None:
    for field, name in NAMES.items():
        cells: Any = table.columns[table.column(name)].cells
        if DTYPE[field].kind in "iu" and (not isinstance(cells, np.ndarray) or cells.dtype.kind not in "iu"):
            kind = cells.dtype if isinstance(cells, np.ndarray) else "text"
            raise RecordingError(
                table.path, f"column {name}: got {kind}, allowed: whole numbers, one in each row (int64)"
            )
