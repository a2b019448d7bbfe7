"""What a table means: the times and capacitances of two channels, and one line that says how it was understood."""

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError
from palpate.tables.asked import Asked
from palpate.tables.cell.numbers import numbers
from palpate.tables.doubts import absent, clipped, frozen
from palpate.tables.roles import Side, said, sides
from palpate.tables.rows import in_turn, without_repeats
from palpate.tables.scales import units
from palpate.tables.table import Table
from palpate.tables.times.pairs import joined
from palpate.tables.times.steps import counted
from palpate.tables.times.times import Times, coarse_times, times
from palpate.tables.units import PICOFARADS

Array = NDArray[np.float64]
_Arrays = tuple[Array, Array, Array, Array]
_RATES_DIFFER = 0.2  # of the rows a second that are counted
UNTIMED = "no column of times found: start_s is unknown; name it with time=COL, or give the rate"

ONE_CLOCK = "the times of both files are taken as those of one clock"


@dataclass(frozen=True, eq=False)
class Channels:
    """Two channels of a table, and how it was understood.

    Attributes
    ----------
    t_hard_s, t_soft_s, hard, soft : numpy.ndarray, shape (n,)
        As those of `palpate.Recording`.
    said : str
        One line: which columns, which units, pairs a second, rows.
    notes : tuple of str
        What was left out or looks wrong.
    zero_utc_ns : int or None
    unused : list of str
        Names of the other columns of the table.
    lasting : tuple of str
        The notes that are not on rows: they hold for a longer table, too.
    """

    t_hard_s: Array
    t_soft_s: Array
    hard: Array
    soft: Array
    said: str
    notes: tuple[str, ...]
    zero_utc_ns: int | None
    unused: list[str]
    lasting: tuple[str, ...]


def channels(table: Table, asked: Asked, soft_table: Table | None = None) -> Channels:
    """Return the two channels of a table, or of two.

    Raises
    ------
    RecordingError
        A cell is wrong: with its line and column.
    ValueError
        The meaning is open: the message has what fits, and the option that settles it.
    """
    if table.width < 2 and soft_table is None:
        raise RecordingError(table.path, "not a recording: one column, two are needed", table.lines[0])
    hard, soft = sides(table, asked, soft_table)
    left_out: list[str] = []
    if asked.rate is None:
        hard, soft, left_out = without_repeats(hard, soft)
    (first, lost), (second, also_lost) = (
        absent(name, numbers(side.table, side.value, asked.decimal)) for name, side in (("hard", hard), ("soft", soft))
    )
    hard_unit, soft_unit, told = units(hard, soft, (first, second), asked)
    hard, soft, raw, turns = in_turn(hard, soft, (first, second))
    values = [each if (factor := PICOFARADS[unit]) == 1.0 else each * factor
              for each, unit in zip(raw, (hard_unit, soft_unit), strict=True)]  # fmt: skip
    stamps = _stamps(hard, soft, asked)
    by_row = hard.table is soft.table or asked.rate is not None or not any(each.said for each in stamps)
    arrays, apart = (_by_row if by_row else _by_time)(hard, soft, stamps, values)
    line = [_said_times(stamps), f"hard = {hard.name}, {hard_unit}", f"soft = {soft.name}, {soft_unit}"]
    rate = rate_of(arrays[0])
    line += [pace(rate), f"{len(arrays[0])} rows"]
    tables = [table] if soft_table is None else [table, soft_table]
    odd = [*left_out, *turns, *remarks(arrays, rate), *lost, *also_lost, *apart]
    of_times = [note for each in stamps for note in each.notes]
    notes = [*odd, *told, *of_times, *(note for each in tables for note in each.notes)]
    if table.header_rate and UNTIMED in notes:
        notes.append(f"the header says {table.header_rate} samples a second: --rate {table.header_rate}?")
    lasting = [note for note in notes if note == UNTIMED or note not in {*odd, *of_times}]
    for name, each, other in (("hard", *arrays[2:]), ("soft", *arrays[:1:-1])):
        notes += [*clipped(name, each), *frozen(name, each, other)]
    return Channels(
        *arrays,
        "; ".join(filter(None, line)),
        tuple(dict.fromkeys(notes)),
        stamps[0].zero_utc_ns,
        _unused(hard, soft),
        tuple(dict.fromkeys(lasting)),
    )


def _unused(hard: Side, soft: Side) -> list[str]:
    used = {hard.value, soft.value, *hard.times, *soft.times}
    same = hard.table is soft.table
    return [hard.table.name(column) for column in range(hard.table.width) if same and column not in used]


def _stamps(hard: Side, soft: Side, asked: Asked) -> tuple[Times, Times]:
    first = _of_side(hard, asked)
    same = soft.table is hard.table and soft.times == hard.times
    return first, first if same else _of_side(soft, asked).since(first)


def _of_side(side: Side, asked: Asked) -> Times:
    if asked.rate is not None:
        _require_rate(side, asked, asked.rate)
        notes = ["the times of the file are not used: a rate was given"] if side.times else []
        return Times(np.arange(len(side.table)) / asked.rate, "as the rate says", notes=notes)
    found: list[Times] = []
    wrong: list[Exception] = []
    for column in side.times:
        try:
            one = times(side.table, column, asked.time_unit, asked.decimal)
        except (ValueError, RecordingError) as error:
            wrong.append(error)
        else:
            found.append(replace(one, said=f"{said(side.table, column)}, {one.said}"))
    if found:
        return min(found, key=lambda each: int(np.count_nonzero(np.diff(each.seconds) == 0)))
    if wrong:
        raise wrong[0]
    return Times(np.full(len(side.table), math.nan), "")


def _require_rate(side: Side, asked: Asked, rate: float) -> None:
    """Refuse a rate that is far from that of the stamps of the file, if they can be read."""
    found: list[float] = []
    for column in side.times:
        with suppress(ValueError, RecordingError):
            found += filter(None, [counted(coarse_times(side.table, column, asked.time_unit, asked.decimal).seconds)])
    if found and not any(abs(rate / each - 1) <= _RATES_DIFFER for each in found):
        raise ValueError(
            f"rate: got {rate:g}, but {found[0]:.3g} rows a second by the times of the file, allowed: a rate within "
            f"{_RATES_DIFFER:.0%} of it, or the unit of these times (--time-unit)"
        )


def _by_row(hard: Side, soft: Side, stamps: tuple[Times, Times], values: list[Array]) -> tuple[_Arrays, list[str]]:
    """Return times and values of the rows, and notes."""
    if len(values[0]) != len(values[1]):
        raise ValueError(
            f"time: got none for channels of {len(values[0])} and {len(values[1])} rows, allowed: times in both, or equal "
            "numbers of rows"
        )
    told = [] if hard.table is soft.table else ["the channels are paired row by row, as they have no times"]
    return (stamps[0].seconds, stamps[1].seconds, values[0], values[1]), told


def _by_time(hard: Side, soft: Side, stamps: tuple[Times, Times], values: list[Array]) -> tuple[_Arrays, list[str]]:
    """Return times and values of readings that are near each other, and notes."""
    pairs = joined(stamps[0], values[0], stamps[1], values[1])
    one_clock = [ONE_CLOCK] if hard.table.path != soft.table.path and stamps[0].date_ns is None else []
    return (pairs.t_hard_s, pairs.t_soft_s, pairs.hard, pairs.soft), [*pairs.notes, *one_clock]


def _said_times(stamps: tuple[Times, Times]) -> str:
    names = list(dict.fromkeys(each.said for each in stamps if each.said))
    return f"time = {' and '.join(names)}" if names else ""


LIKELY = 5.0, 2000.0  # pairs a second of a probe
_FEWEST = 50  # rows that show a pace


def pace(rate: float) -> str:
    """Return the pairs a second as text."""
    return f"{rate:.4g} pairs a second" if rate else "rate unknown"


def rate_of(t: Array) -> float:
    """Return the pairs a second of some times, s; 0: unknown."""
    steps = np.diff(t)
    rise = steps > 0
    steps = steps if rise.all() else steps[rise]
    if not len(steps):
        return 0.0
    even = steps.max() <= 10 * steps.min()  # then so are all to the median
    usual = steps if even else steps[steps <= 10 * np.median(steps)]
    return (len(t) - 1) / len(steps) / float(usual.mean())


def remarks(arrays: _Arrays, rate: float) -> list[str]:
    """Return notes on missing values and on times: `arrays` as the first four of `Channels`."""
    time_s, _, hard, soft = arrays
    missing = int(np.count_nonzero(~(np.isfinite(hard) & np.isfinite(soft))))
    back = int(np.count_nonzero(time_s[1:] < time_s[:-1]))
    odd = bool(rate) and len(time_s) >= _FEWEST and not LIKELY[0] <= rate <= LIKELY[1]
    notes = {
        f"{rate:.4g} pairs a second are unusual for a probe: is the unit of the times right (--time-unit)?": odd,
        f"{missing} of {len(hard)} rows have no value in a channel: left out": missing,
        f"time goes back at {back} of {len(hard)} rows: the order of the file is used": back,
        UNTIMED: bool(len(time_s)) and bool(np.isnan(time_s).all()),
    }
    return [note for note, holds in notes.items() if holds]
