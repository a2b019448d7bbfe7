"""What a table means: which columns are the two channels, their units and times; what must be asked or refused."""

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, need
from palpate.importers.table import Array, Asked, Column, Table, ask
from palpate.importers.table_checks import (
    absent,
    clipped,
    frozen,
    lost,
    pace,
    rate_of,
    remarks,
    typical_step,
)
from palpate.importers.units import (
    NONE,
    NUMBER,
    PAIRS,
    PICOFARADS,
    SECONDS,
    SOFT_TIMES,
    SUMMARY,
    TIMES,
    kind,
    time_unit_in,
)
from palpate.messages import listed, quoted

_SURE = {"pF": (0.05, 100.0), "F": (0.05e-12, 100e-12)}  # sizes of gauges, which have some pF
_FAR = 100.0  # the two gauges of a probe differ by less
_OTHER = "two signals of another kind: their unit, as --unit counts"
_SOME = 10_000  # readings that show the size of all
_CHANNEL = re.compile("(?:c|cin|cap|capacitance|ch)[0-9]")
GUESSED = (
    9.9,
    499.0,
)  # pairs a second, of a unit that nobody named; hundredths of a second look like 500
POSSIBLE = (0.2, 20_000.0)
_TICKS = ("s", "ms", "us", "ns")
_LATEST_S = 2**63 / 1e9
_EPOCH = (946_684_800.0, 3_155_760_000.0)  # s since 1970: 2000 to 2070
_JITTER_S = 1.0  # host stamps go back by less than this
_LITTLE_BACK = (
    0.2  # of the way forward: a part of a time, as milliseconds, goes back as far as forward
)
_FEWEST = 8  # rows of which anything can be said
_LEAST = 1e-30  # of any unit; smaller steps are none
_CLOCK = r"\d{1,4}:[0-5]?\d:[0-5]?\d(?:\.\d+)?"
_MINUTES = r"[0-5]?\d:[0-5]?\d\.\d+"
_ZONE = r"(?:Z|[+-]\d\d:?\d\d)$"


_Arrays = tuple[Array, Array, Array, Array]


class Channels(NamedTuple):
    """Two channels of a table: `arrays` as the first four of `palpate.Recording`; `said` is how it was understood."""

    arrays: _Arrays
    said: str
    notes: tuple[str, ...]
    zero_utc_ns: int | None
    unused: list[str]


class Side(NamedTuple):
    """One channel: its column of values, and the columns that may be its times."""

    value: Column
    times: list[Column]


class Times(NamedTuple):
    """Times of the rows, s, and how they were understood; dates count from `zero_ns`, ns since 1970 (None: no dates)."""

    seconds: Array
    said: str
    zero_ns: int | None = None
    is_utc: bool = False


def channels(table: Table, asked: Asked, soft_table: Table | None = None) -> Channels:
    """Return the two channels of a table, or of two; ValueError: the meaning is open, with what settles it."""
    sides = _sides(table, asked, soft_table)
    hard, soft = sides
    for side in sides:
        _require_samples(side.value.table, asked)
    found = [
        absent(name, side.value.numbers())
        for name, side in zip(("hard", "soft"), sides, strict=True)
    ]
    units, told = _units([hard.value, soft.value], [values for values, _ in found], asked)
    scales = [PICOFARADS.get(unit, 1.0) for unit in units]
    values = [
        each if scale == 1 else each * scale for (each, _), scale in zip(found, scales, strict=True)
    ]
    stamps, joined = _both_times(hard, soft, asked), list[str]()
    arrays = (stamps[0].seconds, stamps[1].seconds, values[0], values[1])
    if soft_table:
        arrays, joined = _by_time(stamps, arrays)
    clocks = " and ".join(dict.fromkeys(each.said for each in stamps if each.said))
    said = [f"time = {clocks}"] if clocks else []
    said += [f"hard = {hard.value.label}, {units[0]}", f"soft = {soft.value.label}, {units[1]}"]
    rate = rate_of(arrays[0])
    said += [pace(rate), f"{len(arrays[0])} rows"]
    notes = [
        *remarks(*arrays, rate),
        *([] if soft_table else lost(arrays[0])),
        *found[0][1],
        *found[1][1],
        *joined,
        *told,
        *table.notes,
    ]
    notes += soft_table.notes if soft_table else []
    notes += (
        ["the times of the file are not used: a rate was given"]
        if asked.rate and hard.times
        else []
    )
    notes += [*clipped("hard", arrays[2]), *clipped("soft", arrays[3])]
    notes += [*frozen("hard", arrays[2], arrays[3]), *frozen("soft", arrays[3], arrays[2])]
    used = [hard.value, soft.value, *hard.times, *soft.times]
    unused = [] if soft_table else [each.name for each in table.columns if each not in used]
    zero_utc_ns = stamps[0].zero_ns if stamps[0].is_utc else None
    return Channels(arrays, "; ".join(said), tuple(dict.fromkeys(notes)), zero_utc_ns, unused)


def _sides(table: Table, asked: Asked, soft: Table | None) -> tuple[Side, Side]:
    """Return the hard and the soft channel; both of one table, or each of its own. ValueError where it is open."""
    wanted = dict(asked.columns or {})
    if soft:
        hard = _alone(table, wanted.get("hard"), wanted.get("time"))
        return hard, _alone(soft, wanted.get("soft"), wanted.get("soft_time", wanted.get("time")))
    both = [table.column(wanted[name]) for name in ("hard", "soft")] if wanted else _guessed(table)
    if both[0] is both[1]:
        raise ask("columns", f"{quoted(wanted['hard'])} for both channels", "two columns")
    stamps = [each for each in _times_of(table, wanted.get("time")) if each not in both]
    own = [table.column(wanted["soft_time"])] if "soft_time" in wanted else table.named(SOFT_TIMES)
    return Side(both[0], stamps), Side(
        both[1], own if stamps and len(own) == 1 and own[0] not in both else stamps
    )


def _alone(table: Table, wanted: str | int | None, time: str | int | None) -> Side:
    """Return the channel of a table that has one: as wanted, in a unit of capacitance, or the only one beside the times."""
    stamps = _times_of(table, time)
    rest = [each for each in table.columns if each not in stamps]
    found = (
        [table.column(wanted)]
        if wanted is not None
        else [each for each in rest if each.in_farads] or rest
    )
    if len(found) != 1:
        raise ask(
            "columns",
            f"{len(found)} columns that can be the channel in {table.path.name}",
            table.describe(),
        )
    return Side(found[0], [each for each in stamps if each is not found[0]])


def _times_of(table: Table, wanted: str | int | None) -> list[Column]:
    """Return the column that is wanted, or those that may be times; a capital T without a unit of time is a temperature."""
    if wanted is not None:
        return [table.column(wanted)]
    named = [each for each in table.named(TIMES) if not each.in_farads]
    named = [each for each in named if each.label != "T" or time_unit_in(each.name)]
    named.sort(
        key=lambda each: each.simple in SECONDS
    )  # last what has a unit as its name: "Min" may be a minimum
    return named or [each for each in table.columns if each.cells.dtype.kind in "mM"]


def _guessed(table: Table) -> list[Column]:
    """Return the columns of the channels by names that leave no doubt."""
    for names in PAIRS:
        both = [each for name in names for each in table.named([name])]
        rest = [each for each in table.columns if each not in both]
        more = any(each.in_farads or _CHANNEL.fullmatch(each.simple) for each in rest)
        if [each.simple for each in both] == [*names] and not more:
            return both
    raise ask(
        "columns",
        "none for a table of another program",
        f"hard and soft, two of {table.describe()}",
    )


def _require_samples(table: Table, asked: Asked) -> None:
    """Refuse rows of a summary: with its name in any column; where a rate is given, without the time of the other rows."""
    why = "looks like a row of sums, not of samples: take such rows out"
    texts = [each for each in table.columns if each.cells.dtype.kind == "O"]
    for each in texts:
        words = [
            word
            for word in {cell for cell in each.cells if isinstance(cell, str)}
            if SUMMARY.match(word)
        ]
        found = np.isin(each.cells, words)
        each.refuse(found & (2 * found.sum() < len(table)), why)
    for each in (each for each in _times_of(table, None) if asked.rate and each in texts):
        empty = np.array([kind(str(cell).strip()) == NONE for cell in each.cells])
        each.refuse(empty & ~empty.all(), why)


def _units(both: list[Column], values: list[Array], asked: Asked) -> tuple[list[str], list[str]]:
    """Return the units of the channels, and notes: as asked, by the header, or by the size of the values."""
    stated = [each.stated_unit for each in both]
    if wanted := asked.unit:
        scales = [
            PICOFARADS.get(unit, unit) for unit in (*(each or wanted for each in stated), wanted)
        ]
        odd = [each for each, scale in zip(both, scales, strict=False) if scale != scales[-1]]
        told = [
            f"the header of {each.label} says {each.stated_unit}: {wanted} is used, as asked"
            for each in odd
        ]
        return [wanted] * 2, told
    allowed = ", ".join(PICOFARADS)
    for column in both:
        if column.stated_unit and not column.in_farads:
            got = f"{quoted(column.name)}, in {column.stated_unit}"
            raise ask(
                "column", got, f"a capacitance in one of {allowed}, without a scale; {_OTHER}"
            )
    some = [
        np.abs(each[:: max(1, len(each) // _SOME)]) for each in values
    ]  # not the largest: it may be a wrong one
    finite = [each[np.isfinite(each)] for each in some]
    sizes = [float(np.quantile(each, 0.99)) if len(each) else 0.0 for each in finite]
    fitting = [
        unit for unit, (low, high) in _SURE.items() if low <= max(sizes) <= high or max(sizes) == 0
    ]
    named = stated[0] or stated[1]
    known = named or next(iter(fitting), "")
    if not known:
        got = f"none in the header, and values of about {max(sizes):.3g} in {both[0].label}"
        raise ask("unit", got, f"one of {allowed} (--unit); {_OTHER}")
    why = (
        f"{known}, as the other channel" if named else f"{known} assumed, by the size of the values"
    )
    units = [unit or known for unit in stated]
    sizes = [size * PICOFARADS[unit] for size, unit in zip(sizes, units, strict=True)]
    if min(sizes) > 0 and max(sizes) / min(sizes) > _FAR:
        got = " and ".join(
            f"{size:.3g} pF in {each.label}" for size, each in zip(sizes, both, strict=True)
        )
        alike = "channels of similar size: write the unit into each head, as C2 (pF); if it is one of both, give it (--unit)"
        raise ask("unit", f"about {got}", alike)
    return units, [
        f"no unit in the header of {each.label}: {why}" for each in both if not each.stated_unit
    ]


def _both_times(hard: Side, soft: Side, asked: Asked) -> tuple[Times, Times]:
    """Return the times of both channels, with one second 0; ValueError if only one has dates, or a zone."""
    first = second = _stamps(hard, asked)
    if soft.times != hard.times or soft.value.table is not hard.value.table:
        second = _stamps(soft, asked)
    if (first.zero_ns is None, first.is_utc) != (second.zero_ns is None, second.is_utc):
        raise ask(
            "time", f"{first.said} for hard and {second.said} for soft", "the same kind for both"
        )
    if later_ns := (second.zero_ns or 0) - (first.zero_ns or 0):
        second = second._replace(seconds=second.seconds + later_ns / 1e9)
    return first, second


def _stamps(side: Side, asked: Asked) -> Times:
    """Return the times of a channel: by the rate, or the first column of times that can be read."""
    rows = len(side.value.table)
    if asked.rate is not None:
        return Times(np.arange(rows) / asked.rate, "as the rate says")
    for column in side.times:
        try:
            found = times(column, asked.time_unit)
            return found._replace(said=f"{column.label}, {found.said}")
        except (ValueError, RecordingError):
            if column is side.times[-1]:
                raise
    return Times(np.full(rows, np.nan), "")


def _by_time(stamps: tuple[Times, Times], arrays: _Arrays) -> tuple[_Arrays, list[str]]:
    """Return times and values of readings of two files that are near each other, in the order of time, and notes."""
    if not (stamps[0].said and stamps[1].said):
        raise ask(
            "time",
            "none for a channel in a file of its own",
            "times in both files, or rate (--rate)",
        )
    t_hard, t_soft, hard, soft = arrays
    first, second = partners(t_hard, t_soft)
    if not len(first):
        raise ask(
            "time", "none of one file near one of the other", "times that overlap, of one clock"
        )
    left = [f"{len(each) - len(first)} of {len(each)}" for each in (hard, soft)]
    said = f"{left[0]} hard and {left[1]} soft readings have no reading of the other channel near in time: left out"
    notes = [said] if max(len(hard), len(soft)) > len(first) else []
    notes += (
        ["the times of both files are taken as those of one clock"]
        if stamps[0].zero_ns is None
        else []
    )
    return (t_hard[first], t_soft[second], hard[first], soft[second]), notes


def partners(hard_s: Array, soft_s: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the positions of pairs in two sequences of times, each reading once, at most a period of the slower one apart."""
    pandas = need("pandas", "tables")
    hard, soft = (
        pandas.DataFrame({"t": t, "at": range(len(t)), "own": t}).sort_values("t")
        for t in (hard_s, soft_s)
    )
    period = max(typical_step(each["t"].to_numpy()) for each in (hard, soft))

    def paired(way: str) -> Any:
        both = pandas.merge_asof(
            hard, soft, on="t", direction=way, tolerance=period, suffixes=("", "_soft")
        ).dropna()
        nearest = (both["own"] - both["own_soft"]).abs().sort_values(kind="stable").index
        return both.loc[nearest].drop_duplicates("at_soft").sort_index()

    # Channels that are read in turn: the partner is always the reading after, or always the one before.
    most = max(map(paired, ("nearest", "forward", "backward")), key=len)
    return most["at"].to_numpy(np.intp), most["at_soft"].to_numpy(np.intp)


def times(column: Column, time_unit: str | None = None) -> Times:
    """Return the times in a column; errors as of `channels`."""
    cells, is_utc, said = column.cells, column.unit == "UTC", "durations"
    if cells.dtype.kind in "biuf" or (
        cells.dtype.kind == "O" and kind(str(cells[0]).strip()) == NUMBER
    ):
        found = _of_numbers(column, time_unit)
    else:
        if cells.dtype.kind == "O":
            cells, is_utc, said = _of_text(column)
        how = "write it as 2026-11-21 12:00:00.5, as 12:00:00.5, or minutes as 12:00.5"
        column.refuse(np.isnat(cells), f"is no time; {how}")
        ns = cells.astype(f"{cells.dtype.kind}8[ns]").astype(np.int64)
        is_date = cells.dtype.kind == "M"
        found = (
            _since(ns, "dates (UTC)" if is_utc else "dates", is_utc=is_utc)
            if is_date
            else Times(ns / 1e9, said)
        )
    _require_forward(column, found.seconds)
    return found


def _since(stamps_ns: NDArray[np.int64], said: str, *, is_utc: bool) -> Times:
    """Return the times of dates, ns since 1970: differences of whole numbers are exact."""
    return Times((stamps_ns - stamps_ns[0]) / 1e9, said, int(stamps_ns[0]), is_utc)


def _of_numbers(column: Column, asked: str | None) -> Times:
    """Return the times of a column of numbers, in a unit as named, by their size since 1970, or by their pace."""
    values = column.numbers()
    column.refuse(
        ~np.isfinite(values), "is no time: a time in each row, or rate, pairs a second (--rate)"
    )
    step, named = typical_step(values), asked or time_unit_in(column.unit or column.name)
    rates = {unit: 1 / (step * factor) if step else np.nan for unit, factor in SECONDS.items()}
    units = [named] if named else _TICKS
    dates = [
        unit
        for unit in units
        if unit in _TICKS and _EPOCH[0] <= values[0] * SECONDS[unit] < _EPOCH[1]
    ]
    dates = [unit for unit in dates if not step or POSSIBLE[0] <= rates[unit] <= POSSIBLE[1]]
    low, high = POSSIBLE if named else GUESSED
    paced = [unit for unit in units if asked or not step or low <= rates[unit] <= high]
    if not dates and not paced:
        paces = listed([f"{unit} ({rates[unit]:,.3g} pairs a second)" for unit in (*_TICKS, "d")])
        raise ask(
            "time_unit", f"a median step of {step:.3g} in {column.place}", f"{paces} (--time-unit)"
        )
    unit = (dates or paced)[0]
    factor = SECONDS[unit]
    column.refuse(
        ~(np.abs(values) * factor < _LATEST_S),
        "is no time, or more than 292 years after the first one",
    )
    if dates:
        ns, whole = (
            round(factor * 1e9),
            column.cells if column.cells.dtype.kind in "iu" else np.trunc(values),
        )
        stamps = whole.astype(np.int64) * ns + np.rint((values - whole) * ns).astype(np.int64)
        return _since(stamps, f"{unit} since 1970 (UTC)", is_utc=True)
    seconds = (
        values if factor == 1 else values / round(1 / factor) if factor < 1 else values * factor
    )
    return Times(seconds, unit if named or not step else f"{unit} (by its steps)")


def _of_text(column: Column) -> tuple[NDArray[Any], bool, str]:
    """Return dates or times of day, NaT for what is none; whether they are in UTC; and what they are."""
    pandas = need("pandas", "tables")
    text = pandas.Series(column.cells, dtype=object).astype(str).str.strip().str.replace(",", ".")
    if not re.match(r"\d+[-/.]\d+[-/.]", text.iloc[0]):
        minutes = text.str.fullmatch(_MINUTES).all()
        text = "00:" + text if minutes else text
        spans = pandas.to_timedelta(text.where(text.str.fullmatch(_CLOCK)))
        return spans.to_numpy("m8[ns]"), False, "mm:ss" if minutes else "times of day"
    zoned = text.str.contains(_ZONE).to_numpy()
    column.refuse(
        zoned != zoned[0], f"is another kind of time than {quoted(text.iloc[0])} in the first row"
    )
    written = text.where(text.str.match(r"\d{4}[-/]\d\d[-/]\d\d"), "").str.replace("/", "-")
    stamps = pandas.to_datetime(written, format="ISO8601", errors="coerce", utc=True)
    return stamps.dt.tz_convert(None).to_numpy("M8[ns]"), bool(zoned[0]), ""


def _require_forward(column: Column, seconds: Array) -> None:
    """Allow jitter of host stamps; refuse a restarted logger and a reversed file; ask for the rate if most stamps are equal."""
    steps, rate = np.diff(seconds), "rate, pairs a second (--rate"
    back, far, later = steps < 0, steps <= -_JITTER_S, int(np.count_nonzero(steps > _LEAST))
    if far.any() or -steps[back].sum() > _LITTLE_BACK * steps[~back].sum():
        row = int(np.argmax(far if far.any() else back)) + 1
        said = (
            f"goes back by {-steps[row - 1]:.3g} s, and so in {np.count_nonzero(back)} rows in all"
        )
        allowed = f"allowed: one measurement in a file, the oldest row first, or {rate})"
        reason = f"the time in {column.place} {said}: {allowed}"
        raise RecordingError(column.table.path, reason, column.table.lines[row])
    if len(steps) >= _FEWEST and 2 * later < len(steps):
        count = f" {len(steps) / (seconds[-1] - seconds[0]):.3g} from the count" if later else ""
        raise ask(
            "time",
            f"{later + 1} different stamps in {len(seconds)} rows of {column.place}",
            f"{rate}{count})",
        )
