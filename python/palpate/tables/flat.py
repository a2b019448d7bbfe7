"""A table of any length, understood by its first rows and by bounds of what all rows have.

What `channels` finds in the first rows holds for all of them if the bounds prove that it would say the same of the whole:
times that rise at one pace, readings above zero that are not frozen, not clipped, and of one size. The proofs only err to
the safe side: without one, the table is read as a whole.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError
from palpate.tables.asked import Asked
from palpate.tables.bounds import Doubtful, Readings, Steps, require
from palpate.tables.cell.decimals import MARKS
from palpate.tables.cell.numbers import OVERLOAD, numbers
from palpate.tables.clean_cells import NumberCells
from palpate.tables.long import IDS
from palpate.tables.roles import Side, sides
from palpate.tables.scales import are_of_one_size, units
from palpate.tables.table import CHANGED, Stream, Table
from palpate.tables.times.steps import median_step, typical_step, window_of
from palpate.tables.times.time_units import GUESSED, LONGEST_S, POSSIBLE, TimeUnit, named_unit, time_unit
from palpate.tables.times.time_units import LIKELY as LIKELY_RATES
from palpate.tables.times.times import LATEST_S
from palpate.tables.understanding import LIKELY, Channels, channels, pace
from palpate.tables.units import PICOFARADS, SECONDS, bare_name

Array = NDArray[np.float64]
_Seconds = Callable[[int, list[Array]], Array]
"""Of a row (from 0), and a part of the columns that begins there: the times, s."""
_SAFE = 1e-9  # of 1: more than all roundings of a mean
_FEW = 100  # cells
_FINEST = 1e-13  # of the latest time; steps below it are lost when seconds are rounded
_FINE_S = 1e-6  # steps of dates, which are rounded to ns


@dataclass(frozen=True, eq=False)
class Flat:
    """Two channels of a table that is read in parts.

    Attributes
    ----------
    first : Channels
        Of the first rows; `said` and `notes` are those of all.
    """

    first: Channels
    _stream: Stream
    _columns: list[int]
    _scale: tuple[float, float]
    _seconds: _Seconds
    _sums: list[list[int]]
    """Of each part, as it was proved."""

    def parts(self) -> Iterator[tuple[Array, Array, Array, Array]]:
        """Yield the times of the hard and the soft readings, s, and the readings, pF, of all rows, part by part.

        Raises
        ------
        RecordingError
            The file has changed.
        """
        row = 0
        for part, sums in zip_longest(self._stream.parts(self._columns), self._sums):
            if part is None or sums is None or _sums(part) != sums:
                raise RecordingError(self._stream.first.path, CHANGED)
            hard, soft = _scaled(part, self._scale)
            seconds = self._seconds(row, part)
            yield seconds, seconds, hard, soft
            row += len(hard)


def flat(stream: Stream, asked: Asked) -> Flat | None:
    """Return the channels as `channels` finds them in all rows; None: only the whole table can say them.

    Raises
    ------
    OSError
        The file cannot be read again.
    """
    try:
        return _flat(stream, asked)
    except (Doubtful, RecordingError, ValueError):
        return None


def _flat(stream: Stream, asked: Asked) -> Flat | None:
    table = stream.first
    side, soft = sides(table, asked)
    names = {bare_name(name) for column in range(table.width) for name in table.names(column)}
    timed = bool(side.times)
    if names & IDS or side.table is not table or soft.times != side.times or len(side.times) > (asked.rate is None):
        return None
    columns = [side.value, soft.value, *side.times]
    first = channels(table, asked)
    if not all(_is_sure(table, column, asked) for column in columns):
        return None
    raw = [numbers(table, column, asked.decimal) for column in columns]
    found = units(side, soft, (raw[0], raw[1]), asked)[:2]
    scale = PICOFARADS[found[0]], PICOFARADS[found[1]]
    readings, steps = (Readings(), Readings()), Steps(window_of(stream.rows))
    sums: list[list[int]] = []
    for part in stream.parts(columns):
        require(bool(sums) or all(map(_begins_alike, part, raw)))
        sums.append(_sums(part))
        hard_pF, soft_pF = _scaled(part, scale)
        readings[0].add(hard_pF)
        readings[1].add(soft_pF)
        readings[0].add_runs(hard_pF, soft_pF)
        readings[1].add_runs(soft_pF, hard_pF)
        if timed:
            steps.add(part[2])
    _require_plain(side, soft, readings, found, asked)
    seconds, step_s = _times(side, asked, raw[2:], steps)
    said = "; ".join([*first.said.split("; ")[:-2], _pace(step_s), f"{stream.rows} rows"])
    return Flat(replace(first, said=said, notes=first.lasting), stream, columns, scale, seconds, sums)


def _sums(part: list[Array]) -> list[int]:
    """Return the rows of a part, and a checksum of each column: its bits, added up."""
    return [len(part[0]), *(int(each.view(np.int64).sum()) for each in part)]


def _begins_alike(values: Array, known: Array) -> bool:
    size = min(len(values), len(known))
    return np.array_equal(values[:size], known[:size])


def _scaled(part: list[Array], scale: tuple[float, float]) -> list[Array]:
    return [each if factor == 1.0 else each * factor for each, factor in zip(part[:2], scale, strict=True)]


def _is_sure(table: Table, column: int, asked: Asked) -> bool:
    """Return whether the cells of a column are numbers, of which nothing is open in any row."""
    cells: Any = table.columns[column].cells
    if not isinstance(cells, NumberCells):
        return isinstance(cells, np.ndarray) and cells.dtype == np.float64
    if not cells.mark or cells.mark == asked.decimal:
        return cells.known
    is_checked = cells.sure or any(MARKS[cells.mark] in cell for cell in cells[:_FEW])
    return cells.known and asked.decimal is None and is_checked


def _require_plain(
    side: Side, soft: Side, readings: tuple[Readings, Readings], found: tuple[str, str], asked: Asked
) -> None:
    """Raise Doubtful unless no value is odd, and the units are those of the first rows."""
    readings[0].require_plain(readings[1].span)
    readings[1].require_plain(readings[0].span)
    spans = readings[0].span / PICOFARADS[found[0]], readings[1].span / PICOFARADS[found[1]]
    require(max(float(span[1]) for span in spans) < OVERLOAD / 2)
    require(asked.unit is not None or are_of_one_size(side, soft, spans, found))


def _times(side: Side, asked: Asked, first: list[Array], steps: Steps) -> tuple[_Seconds, tuple[float, float]]:
    """Return how to get the seconds of rows, and the usual step, s, with its uncertainty; 0: unknown."""
    if asked.rate is not None:
        rate = asked.rate
        return lambda row, part: np.arange(row, row + len(part[0])) / rate, (1 / rate, 0.0)
    if not first:
        return lambda _, part: np.full(len(part[0]), math.nan), (0.0, 0.0)
    kind = time_unit(side.table, side.times[0], first[0], asked.time_unit)
    size, unit_s = max(abs(steps.first), abs(steps.last)), SECONDS[kind.unit]
    require(steps.first == first[0][0] and size < OVERLOAD and size * unit_s < LATEST_S / 2)
    require(steps.least > _FINEST * size and (not kind.epoch or steps.least * unit_s > _FINE_S))
    named = asked.time_unit or named_unit(side.table, side.times[0])
    if not named:  # a later last time leaves fewer units, if any
        _require_one_pace(steps.median(), median_step(first[0]))
        _require_one_pace(steps.typical(), typical_step(first[0]))
        require(size * unit_s < LONGEST_S / 2 or kind.epoch is not None)
    elif not asked.time_unit:
        require(all(POSSIBLE[0] < 1 / (step * unit_s) < POSSIBLE[1] for step in steps.typical()))
    rounded_s = 2e-9 if kind.epoch else 1e-15 * size * unit_s
    return lambda _, part: _seconds(kind, steps.first, part[2]), (steps.usual() * unit_s, rounded_s)


def _require_one_pace(bounds: tuple[float, float], step: float) -> None:
    """Raise Doubtful unless steps within these bounds are on the same side of all limits as that of the first rows."""
    require(step > 0)  # the first part may have one row
    places = sorted({*GUESSED, *LIKELY_RATES, *POSSIBLE})
    low, high = bounds[0] * (1 - _SAFE), bounds[1] * (1 + _SAFE)
    for unit_s in SECONDS.values():
        require(len({bisect_left(places, 1 / (each * unit_s)) for each in (low, step, high)}) == 1)


def _seconds(kind: TimeUnit, first: float, values: Array) -> Array:
    """Return times as `times` does, if `first` is the first one of all."""
    if kind.epoch is None:
        return kind.seconds(values)
    return kind.since_ns(np.concatenate([[first], values]))[1:] / 1e9


def _pace(step_s: tuple[float, float]) -> str:
    """Return the pairs a second as text; raises Doubtful if they are unusual, or the last digit is not sure."""
    usual, uncertain = step_s
    if not usual:
        return pace(0.0)
    share = _SAFE + uncertain / usual
    low, high = (1 - share) / usual, (1 + share) / usual
    require(LIKELY[0] < low and high < LIKELY[1] and pace(low) == pace(high))
    return pace(high)
