"""What a table means: which columns are the two channels, their units and times; what must be asked or refused."""

import re
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.extras import need
from palpate.tables.table import Array, Asked, Column, Table, numbers
from palpate.tables.times import Times, times, typical_step
from palpate.tables.units import PAIRS, PICOFARADS, SECONDS, SOFT_TIMES, TIMES, simple_name, stated_unit, unit_in

_SURE = {"pF": (0.05, 100.0), "F": (0.05e-12, 100e-12)}
"""Sizes that leave no doubt about a unit: gauges have some pF, and change by some tenths."""
_FAR = 100.0  # the two gauges of a probe differ by less
_SOME = 10_000  # readings that show the size of all
_PACE = 5.0, 2000.0  # pairs a second of a probe
_SHOWN_PACE = 50  # rows that show it
_CHANNEL = re.compile("(?:c|cin|cap|capacitance|ch)[0-9]")
_FEWEST = 20  # readings at the end of a range that are no chance
_PILE = 5  # times as many as have the next values
_MOVED = 0.01  # of its range: a channel that changes; one at rest moves by a thousandth
_SAME = 3  # equal readings that are no chance
_CODES = (0.0, -1.0, -9.0, -99.0, -999.0, -9999.0, 999.0, 9999.0, 99999.0)
_MOST = 0.2  # of the readings: a channel that rests at a value has it more often
_TAIL = 0.005  # of the other readings at each end: single wrong ones


class Channels(NamedTuple):
    """Two channels of a table, as in `palpate.Recording`; `said` is one line on how it was understood."""

    t_hard_s: Array
    t_soft_s: Array
    hard: Array
    soft: Array
    said: str
    notes: tuple[str, ...]
    zero_utc_ns: int | None
    unused: list[str]


class Side(NamedTuple):
    """One channel: its table, its column of values, and the columns that may be its times."""

    table: Table
    value: int
    times: list[int]

    @property
    def name(self) -> str:
        """The name of its column, without its unit."""
        return self.table.label(self.value)

    @property
    def unit(self) -> str:
        """What the metadata, or the header, says as unit, also one that is no capacitance; "" if nothing."""
        column = self.table.columns[self.value]
        return stated_unit(f"({column.unit})" if column.unit else column.name)


def channels(table: Table, asked: Asked, soft_table: Table | None = None) -> Channels:
    """Return the two channels of a table, or of two; ValueError: the meaning is open, with what settles it."""
    hard, soft = _sides(table, asked, soft_table)
    read = [absent(name, numbers(side.table, side.value)) for name, side in (("hard", hard), ("soft", soft))]
    units, told = _units((hard, soft), (read[0][0], read[1][0]), asked)
    values = [each * PICOFARADS[unit] if unit != "pF" else each for (each, _), unit in zip(read, units, strict=True)]
    stamps = _both_times(hard, soft, asked)
    arrays, notes = (stamps[0].seconds, stamps[1].seconds, values[0], values[1]), list[str]()
    if hard.table is not soft.table:
        arrays, notes = _by_time(stamps, values)
    rate, clocks = rate_of(arrays[0]), dict.fromkeys(each.said for each in stamps if each.said)
    said = [f"time = {' and '.join(clocks)}"] if clocks else []
    said += [f"hard = {hard.name}, {units[0]}", f"soft = {soft.name}, {units[1]}", pace(rate), f"{len(arrays[0])} rows"]
    notes = [*remarks(arrays, rate), *read[0][1], *read[1][1], *notes, *told, *table.notes]
    notes += soft_table.notes if soft_table else []
    if asked.rate is not None and hard.times:
        notes.append("the times of the file are not used: a rate was given")
    notes += [*clipped("hard", arrays[2]), *clipped("soft", arrays[3])]
    notes += [*frozen("hard", *arrays[2:]), *frozen("soft", *arrays[:1:-1])]
    used = {hard.value, soft.value, *hard.times, *soft.times}
    unused = [] if soft_table else [table.name(at) for at in range(len(table.columns)) if at not in used]
    zero_utc_ns = stamps[0].zero_ns if stamps[0].is_utc else None
    return Channels(*arrays, "; ".join(said), tuple(dict.fromkeys(notes)), zero_utc_ns, unused)


def _sides(table: Table, asked: Asked, soft: Table | None) -> tuple[Side, Side]:
    """Return the hard and the soft channel; both of one table, or each of its own. ValueError where it is open."""
    wanted = dict(asked.columns or {})
    if soft is not None:
        hard_side = _alone(table, wanted.get("hard"), wanted.get("time"))
        return hard_side, _alone(soft, wanted.get("soft"), wanted.get("soft_time", wanted.get("time")))
    both = [table.column(wanted[name]) for name in ("hard", "soft")] if wanted else _guessed(table)
    if both[0] == both[1]:
        raise ValueError(f"columns: got {quoted(wanted['hard'])} for both channels, allowed: two columns")
    stamps = _times(table, wanted.get("time"), both)
    own = [table.column(wanted["soft_time"])] if "soft_time" in wanted else table.named(SOFT_TIMES)
    own = own if len(own) == 1 and own[0] not in both and stamps else stamps
    return Side(table, both[0], stamps), Side(table, both[1], own)


def _alone(table: Table, wanted: str | int | None, time: str | int | None) -> Side:
    """Return the channel of a table that has one."""
    stamps = _times(table, time, [])
    found = [at for at in _likely(table) if at not in stamps] if wanted is None else [table.column(wanted)]
    if len(found) != 1:
        what = f"{len(found)} columns that can be the channel in {table.path.name}"
        raise ValueError(f"columns: got {what}, allowed: one of {table.describe()} (--map hard=COL,soft=COL)")
    return Side(table, found[0], [at for at in stamps if at != found[0]])


def _times(table: Table, wanted: str | int | None, taken: list[int]) -> list[int]:
    if wanted is not None:
        return [table.column(wanted)]
    spans = [at for at, each in enumerate(table.columns) if each.cells.dtype.kind in "mM"]
    return [at for at in _time_columns(table) or spans if at not in taken]


def _time_columns(table: Table) -> list[int]:
    """Return the columns (from 0) that have a name for times; a capital T without a unit of time is a temperature."""
    named = [at for at in table.named(TIMES) if not _in_farads(table.columns[at])]
    return [at for at in named if table.label(at) != "T" or unit_in(table.name(at), SECONDS)]


def _guessed(table: Table) -> list[int]:
    """Return the columns (from 0) of the channels by names that leave no doubt."""
    for names in PAIRS:
        hard, soft = (table.named([name]) for name in names)
        rest = [each for at, each in enumerate(table.columns) if [at] not in (hard, soft)]
        more = any(_in_farads(each) or _CHANNEL.fullmatch(simple_name(each.name)) for each in rest)
        if len(hard) == len(soft) == 1 and not more:
            return [*hard, *soft]
    found = [at + 1 for at in _likely(table)]
    example = f", as in --map hard={found[-2]},soft={found[-1]}" if len(found) > 1 else ""
    raise ValueError(
        f"columns: got none for a table of another program, allowed: hard and soft, two of {table.describe()}{example}"
    )


def _likely(table: Table) -> list[int]:
    """Return the columns that may be channels: those in a unit of capacitance, else all that are no times."""
    stamps = _time_columns(table)
    found = [at for at in range(len(table.columns)) if at not in stamps]
    return [at for at in found if _in_farads(table.columns[at])] or found


def _in_farads(column: Column) -> bool:
    return unit_in(column.unit or column.name, PICOFARADS) is not None


def _units(both: tuple[Side, Side], values: tuple[Array, Array], asked: Asked) -> tuple[tuple[str, str], list[str]]:
    """Return the units of the channels, and notes: as asked, by the header, or by the size of the values."""
    if asked.unit is not None:
        odd = [each for each in both if each.unit and PICOFARADS.get(each.unit) != PICOFARADS[asked.unit]]
        told = [f"the header of {each.name} says {each.unit}: {asked.unit} is used, as asked" for each in odd]
        return (asked.unit, asked.unit), told
    for side in both:
        if side.unit and side.unit not in PICOFARADS:
            raise ValueError(
                f"column: got {quoted(side.table.name(side.value))}, in {side.unit}, allowed: a capacitance in one of "
                f"{', '.join(PICOFARADS)}, without a scale; numbers that are proportional to it, both on one scale: --unit aF"
            )
    sizes = [_size(each) for each in values]
    fitting = [unit for unit, (low, high) in _SURE.items() if low <= max(sizes) <= high or max(sizes) == 0]
    stated = both[0].unit or both[1].unit
    known = stated or next(iter(fitting), "")
    if not known:
        where, allowed = f"{max(sizes):.3g} in {both[0].name}", f"allowed: one of {', '.join(PICOFARADS)} (--unit)"
        raise ValueError(f"unit: got none in the header, and values of about {where}, {allowed}")
    assumed = f"{known}, as the other channel" if stated else f"{known} assumed, by the size of the values"
    told = [f"no unit in the header of {side.name}: {assumed}" for side in both if not side.unit]
    found = (both[0].unit or known, both[1].unit or known)
    sizes = [size * PICOFARADS[unit] for size, unit in zip(sizes, found, strict=True)]
    if min(sizes) > 0 and max(sizes) / min(sizes) > _FAR:
        raise ValueError(
            f"unit: got about {sizes[0]:.3g} pF in {both[0].name} and {sizes[1]:.3g} pF in {both[1].name}, allowed: channels "
            "of similar size; if this is right, give their unit (--unit)"
        )
    return found, told


def _size(values: Array) -> float:
    """Return the size of the larger values, but not of single wrong ones, of some thousand; 0 without values."""
    some = np.abs(values[:: max(1, len(values) // _SOME)])
    return float(np.nanquantile(some, 0.99)) if np.isfinite(some).any() else 0.0


def _both_times(hard: Side, soft: Side, asked: Asked) -> tuple[Times, Times]:
    """Return the times of both channels, with one second 0; ValueError if only one has dates, or a zone."""
    first = _stamps(hard, asked)
    if (soft.table, soft.times) == (hard.table, hard.times):
        return first, first
    second = _stamps(soft, asked, first.zero_ns)
    if (first.zero_ns is None, first.is_utc) != (second.zero_ns is None, second.is_utc):
        raise ValueError(f"time: got {first.said} for hard and {second.said} for soft, allowed: the same kind for both")
    return first, second


def _stamps(side: Side, asked: Asked, zero_ns: int | None = None) -> Times:
    """Return the times of a channel: by the rate, or the first column of times that can be read."""
    if asked.rate is not None:
        return Times(np.arange(len(side.table)) / asked.rate, "as the rate says")
    wrong: Exception | None = None
    for column in side.times:
        try:
            one = times(side.table, column, asked, zero_ns)
        except (ValueError, RecordingError) as error:
            wrong = wrong or error
        else:
            return replace(one, said=f"{side.table.label(column)}, {one.said}")
    if wrong:
        raise wrong
    return Times(np.full(len(side.table), np.nan), "")


_Arrays = tuple[Array, Array, Array, Array]


def _by_time(stamps: tuple[Times, Times], values: list[Array]) -> tuple[_Arrays, list[str]]:
    """Return times and values of readings of two files that are near each other, in the order of time, and notes."""
    if not (stamps[0].said and stamps[1].said):
        raise ValueError(
            "time: got none for a channel in a file of its own, allowed: times in both files, or rate (--rate)"
        )
    first, second = partners(*(each.seconds for each in stamps))
    if not len(first):
        raise ValueError("time: got none of one file near one of the other, allowed: times that overlap, of one clock")
    left = [f"{len(each) - len(first)} of {len(each)}" for each in values]
    said = f"{left[0]} hard and {left[1]} soft readings have no reading of the other channel near in time: left out"
    notes = [said] if max(map(len, values)) > len(first) else []
    notes += ["the times of both files are taken as those of one clock"] if stamps[0].zero_ns is None else []
    return (stamps[0].seconds[first], stamps[1].seconds[second], values[0][first], values[1][second]), notes


def partners(hard_s: Array, soft_s: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the positions of pairs in two sequences of times, each reading once, at most a period of the slower one apart."""
    pandas = need("pandas", "tables")
    hard, soft = (pandas.DataFrame({"t": t, "at": range(len(t)), "own": t}).sort_values("t") for t in (hard_s, soft_s))
    period = max(typical_step(each["t"].to_numpy()) for each in (hard, soft))

    def paired(way: str) -> Any:
        both = pandas.merge_asof(hard, soft, on="t", direction=way, tolerance=period, suffixes=("", "_soft")).dropna()
        nearest = (both["own"] - both["own_soft"]).abs().sort_values(kind="stable").index
        return both.loc[nearest].drop_duplicates("at_soft").sort_index()

    # Channels that are read in turn: the partner is always the reading after, or always the one before.
    most = max(map(paired, ("nearest", "forward", "backward")), key=len)
    return most["at"].to_numpy(np.intp), most["at_soft"].to_numpy(np.intp)


def pace(rate: float) -> str:
    """Return the pairs a second as text."""
    return f"{rate:.4g} pairs a second" if rate else "rate unknown"


def rate_of(t: Array) -> float:
    """Return the pairs a second of some times, s, without the gaps; 0: unknown."""
    steps = np.diff(t)
    steps = steps[steps > 0]
    if not len(steps):
        return 0.0
    even = steps.max() <= 10 * steps.min()  # then so are all to the median
    usual = steps if even else steps[steps <= 10 * np.median(steps)]
    return (len(t) - 1) / len(steps) / float(usual.mean())


def remarks(arrays: _Arrays, rate: float) -> list[str]:
    """Return notes on missing values and on times: `arrays` as the first four of `Channels`."""
    time_s, soft_s, hard, soft = arrays
    same = int(np.count_nonzero((np.diff(time_s) == 0) & (np.diff(soft_s) == 0)))
    missing = int(np.count_nonzero(~(np.isfinite(hard) & np.isfinite(soft))))
    back = int(np.count_nonzero(time_s[1:] < time_s[:-1]))
    notes = []
    if rate and len(time_s) >= _SHOWN_PACE and not _PACE[0] <= rate <= _PACE[1]:
        notes.append(
            f"{rate:.4g} pairs a second are unusual for a probe: is the unit of the times right (--time-unit)?"
        )
    if missing:
        notes.append(f"{missing} of {len(hard)} rows have no value in a channel: left out")
    if back:
        notes.append(f"time goes back at {back} of {len(hard)} rows: the order of the file is used")
    if same:
        said = f"{same} of {len(hard)} rows have the time of the row before"
        notes.append(f"{said}: repeated, or several that came at once?")
    if len(time_s) and np.isnan(time_s).all():
        notes.append("no column of times found: start_s is unknown; name it with time=COL, or give the rate")
    return notes


def absent(name: str, values: Array) -> tuple[Array, list[str]]:
    """Return the values with nan for codes of "no value", as 0 and -999, equal and far from all other readings; and notes."""
    notes = []
    least, most = np.nanmin(values, initial=np.inf), np.nanmax(values, initial=-np.inf)
    for code in (each for each in _CODES if least <= each <= most):
        same = values == code
        count = int(np.count_nonzero(same))
        others = values[np.isfinite(values) & ~same] if _SAME <= count <= _MOST * len(values) else np.empty(0)
        if len(others) < _FEWEST or np.abs(others - code).min() <= np.ptp(np.quantile(others, [_TAIL, 1 - _TAIL])):
            continue
        span = f"{others.min():.4g} to {others.max():.4g}"
        said = f"{name}: {count} readings are exactly {code:.6g}, far from all other readings ({span})"
        notes.append(f"{said}: taken as no value")
        values = np.where(same, np.nan, values)
    return values, notes


def clipped(name: str, values: Array) -> list[str]:
    """Return a note if many readings have exactly the largest, or the smallest, value."""
    known, notes = np.isfinite(values), []
    finite = values if known.all() else values[known]
    for side, end in (("largest", finite.max()), ("smallest", finite.min())) if len(finite) else ():
        if np.count_nonzero(finite == end) >= _FEWEST:
            counts = np.unique(np.abs(finite - end), return_counts=True)[1]
            if len(counts) >= _FEWEST and counts[0] > _PILE * counts[1:6].max():
                said = f"{name}: {counts[0]} readings have exactly the {side} value, {end:.6g}"
                notes.append(f"{said}: is the channel clipped there?")
    return notes


def frozen(name: str, values: Array, other: Array) -> list[str]:
    """Return a note if a channel has the same reading for long while the other one moves, not at an end of its range."""
    edges = np.r_[-1, np.flatnonzero(values[1:] != values[:-1]), len(values) - 1]  # nan differs from all
    lengths = np.diff(edges)
    at = int(np.argmax(lengths)) if len(values) else 0
    coarse = len(values) - lengths[at] > 2 * (len(lengths) - 1)  # elsewhere, too, most readings equal the one before
    first, end = int(edges[at]) + 1, int(edges[at + 1]) + 1
    known = np.isfinite(other)
    meanwhile = other[first:end][known[first:end]]
    if lengths[at] < _FEWEST or coarse or not len(meanwhile) or values[first] in (np.nanmin(values), np.nanmax(values)):
        return []
    said = f"{name}: rows {first + 1} to {end} of the samples have exactly {values[first]:.6g}, while the other channel changes"
    return [f"{said}: is the channel frozen there?"] if np.ptp(meanwhile) > _MOVED * np.ptp(other[known]) else []
