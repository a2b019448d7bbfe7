"""Find the two channels of a table: which columns they are, their units and their times."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, need
from palpate.importers.channel_units import ChannelUnits, channel_units
from palpate.importers.table import Array, Column, Option, OptionError, ReadOptions, Table
from palpate.importers.table_checks import (
    channel_notes,
    clipped,
    frozen,
    missing_rows,
    rate_of,
    rate_text,
    typical_step,
    without_codes,
)
from palpate.importers.times import Times, read_times
from palpate.importers.units import (
    CHANNEL_NAMES,
    PICOFARADS,
    SECONDS,
    SOFT_TIME_NAMES,
    SUMMARY,
    TIME_NAMES,
    CellKind,
    cell_kind,
    time_unit_in,
)
from palpate.messages import quoted

_NUMBERED_CHANNEL = r"(?:c|cin|cap|capacitance|ch)[0-9]"
_TIME_WORDS = ("t", "time", "timestamp", "xvalue")
_SUMMARY_ROW = "looks like a row of sums, not of samples: take such rows out"


class PairedReadings(NamedTuple):
    """PairedReadings of both channels, paired row by row.

    Attributes
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,)
        Times, s; nan without times.
    hard, soft : numpy.ndarray, shape (n,)
        pF, or signals in another unit; nan without a value.
    """

    t_hard_s: Array
    t_soft_s: Array
    hard: Array
    soft: Array


@dataclass(frozen=True)
class TableChannels:
    """The two channels of a table.

    Attributes
    ----------
    readings : PairedReadings
    understood : str
        One line: which columns and units are used.
    notes : tuple of str
    zero_utc_ns : int or None
        UTC of t = 0, ns since 1970; None if unknown.
    unused : list of str
        Names of the columns that are not used.
    """

    readings: PairedReadings
    understood: str
    notes: tuple[str, ...]
    zero_utc_ns: int | None
    unused: list[str]


@dataclass(frozen=True)
class ChannelColumns:
    """The columns of one channel: its values, and the columns that may be its times."""

    values: Column
    times: list[Column]


def find_channels(
    table: Table, options: ReadOptions, soft_table: Table | None = None
) -> TableChannels:
    """Return the two channels of a table.

    Parameters
    ----------
    table : Table
    options : ReadOptions
    soft_table : Table, optional
        The table of the soft channel, if each channel has its own.

    Raises
    ------
    OptionError
        Something is ambiguous; the error names the option that resolves it.
    RecordingError
        A cell is no number or no time, or a row is of sums.
    """
    hard, soft = _columns_of_channels(table, options, soft_table)
    _require_samples(table, options)
    if soft_table:
        _require_samples(soft_table, options)
    hard_values, hard_notes = without_codes("hard", hard.values.numbers())
    soft_values, soft_notes = without_codes("soft", soft.values.numbers())
    units = channel_units(hard.values, soft.values, hard_values, soft_values, options)
    hard_times, soft_times = _times_of_channels(hard, soft, options)
    readings = PairedReadings(
        hard_times.seconds,
        soft_times.seconds,
        _converted(hard_values, units.hard),
        _converted(soft_values, units.soft),
    )
    pairing_notes: list[str] = []
    if soft_table:
        readings, pairing_notes = _paired_by_time(readings, hard_times, soft_times)
    rate = rate_of(readings.t_hard_s)
    notes = channel_notes(*readings, rate)
    if not soft_table:
        notes += missing_rows(readings.t_hard_s)
    notes += filter(None, [hard_times.note, soft_times.note])
    notes += [*hard_notes, *soft_notes, *pairing_notes, *units.notes, *table.notes]
    if soft_table:
        notes += soft_table.notes
    if options.rate and hard.times:
        notes.append("the times of the file are not used: a rate was given")
    hard_pF = readings.hard
    soft_pF = readings.soft
    notes += clipped("hard", hard_pF) + clipped("soft", soft_pF)
    notes += frozen("hard", hard_pF, soft_pF) + frozen("soft", soft_pF, hard_pF)
    unused: list[str] = []
    if not soft_table:
        used = [hard.values, soft.values, *hard.times, *soft.times]
        unused = [column.name for column in _without(table.columns, used)]
    return TableChannels(
        readings,
        understood=_understood(hard, soft, units, (hard_times, soft_times), rate, len(hard_pF)),
        notes=tuple(dict.fromkeys(notes)),
        zero_utc_ns=hard_times.zero_ns if hard_times.is_utc else None,
        unused=unused,
    )


def _understood(
    hard: ChannelColumns,
    soft: ChannelColumns,
    units: ChannelUnits,
    times: tuple[Times, Times],
    rate: float,
    rows: int,
) -> str:
    """Return one line that says which columns and units are used, and the rate."""
    parts = [
        f"hard = {hard.values.label}, {units.hard}",
        f"soft = {soft.values.label}, {units.soft}",
        rate_text(rate),
        f"{rows} rows",
    ]
    notations = [each.notation for each in times if each.notation]
    if notations:
        parts.insert(0, f"time = {' and '.join(dict.fromkeys(notations))}")
    return "; ".join(parts)


def _converted(values: Array, unit: str) -> Array:
    """Return capacitances in pF, other signals as they are, without a copy where possible."""
    factor = PICOFARADS.get(unit, 1.0)
    if factor == 1:
        return values
    return values * factor


# Which columns the channels and their times are.


def _columns_of_channels(
    table: Table, options: ReadOptions, soft_table: Table | None
) -> tuple[ChannelColumns, ChannelColumns]:
    """Return the columns of both channels, of one table or each of its own."""
    wanted = options.named_columns
    time = wanted.get("time")
    if soft_table:
        hard = _only_channel(table, wanted.get("hard"), time)
        return hard, _only_channel(soft_table, wanted.get("soft"), wanted.get("soft_time", time))
    if wanted:
        hard_values = table.column(wanted["hard"])
        soft_values = table.column(wanted["soft"])
    else:
        hard_values, soft_values = _channels_by_name(table)
    if hard_values is soft_values:
        got = f"{quoted(wanted['hard'])} for both channels"
        raise OptionError(Option.COLUMNS, got, "two columns")
    both = (hard_values, soft_values)
    times = _without(_time_columns(table, time), both)
    soft_times = times
    own_hard_times = _times_named_after(table, hard_values)
    if time is None and own_hard_times:
        times = own_hard_times
    if "soft_time" in wanted:
        own_times = [table.column(wanted["soft_time"])]
    else:
        own_times = table.named(SOFT_TIME_NAMES) or _times_named_after(table, soft_values)
        if time is None and not own_times and _are_same_names(times):
            own_times = times[1:]
            times = times[:1]
            if soft_values.position < hard_values.position:
                own_times, times = times, own_times
    if times and len(own_times) == 1 and own_times[0] not in both:
        soft_times = own_times
    return ChannelColumns(hard_values, times), ChannelColumns(soft_values, soft_times)


def _times_named_after(table: Table, channel: Column) -> list[Column]:
    """Return the column of times with the name of a channel in its own, as Time_C1."""
    names = []
    for word in _TIME_WORDS:
        names += [word + channel.simple, channel.simple + word]
    found = table.named(names)
    if len(found) == 1:
        return found
    return []


def _are_same_names(times: Sequence[Column]) -> bool:
    """Return whether there are two columns of times with one name, for a channel each."""
    return len(times) == 2 and times[0].simple == times[1].simple


def _without(columns: Sequence[Column], excluded: Collection[Column]) -> list[Column]:
    return [column for column in columns if column not in excluded]


def _only_channel(table: Table, wanted: str | int | None, time: str | int | None) -> ChannelColumns:
    """Return the channel of a table that has only one.

    It is the wanted column, the only one in a unit of capacitance, or the only one beside the
    times.
    """
    times = _time_columns(table, time)
    if wanted is not None:
        candidates = [table.column(wanted)]
    else:
        others = _without(table.columns, times)
        candidates = [column for column in others if column.in_farads] or others
    if len(candidates) != 1:
        got = f"{len(candidates)} columns that can be the channel in {table.path.name}"
        raise OptionError(Option.COLUMNS, got, table.describe())
    values = candidates[0]
    return ChannelColumns(values, _without(times, [values]))


def _time_columns(table: Table, wanted: str | int | None) -> list[Column]:
    """Return the wanted column, or those that may be times, the most probable one first."""
    if wanted is not None:
        return [table.column(wanted)]
    named = []
    units = []  # a name that is a unit, as "Min", may also be a minimum
    for column in table.named(TIME_NAMES):
        is_temperature = column.label == "T" and not time_unit_in(column.name)
        if column.in_farads or is_temperature:
            continue
        if column.simple in SECONDS:
            units.append(column)
        else:
            named.append(column)
    return named + units or table.of_kind("mM")


def has_channel_names(table: Table) -> bool:
    """Return whether the names of a table leave no doubt which columns are the channels."""
    return bool(_named_channels(table))


def _named_channels(table: Table) -> list[Column]:
    """Return the columns of hard and soft, if their names leave no doubt; else an empty list."""
    for names in CHANNEL_NAMES:
        hard = table.named([names[0]])
        soft = table.named([names[1]])
        if len(hard) != 1 or len(soft) != 1:
            continue
        both = hard + soft
        others = _without(table.columns, both)
        if not any(map(_may_be_channel, others)):
            return both
    return []


def _channels_by_name(table: Table) -> list[Column]:
    """Return the columns whose names leave no doubt that they are hard and soft."""
    both = _named_channels(table)
    if both:
        return both
    allowed = f"hard and soft, two of {table.describe()}"
    raise OptionError(Option.COLUMNS, "none for a table of another program", allowed)


def _may_be_channel(column: Column) -> bool:
    return column.in_farads or re.fullmatch(_NUMBERED_CHANNEL, column.simple) is not None


def _require_samples(table: Table, options: ReadOptions) -> None:
    """Refuse rows of a summary, which are no samples.

    They have the name of a statistic in any column, or, where a rate is given, no time.
    """
    texts = table.of_kind("O")
    for column in texts:
        found = column.texts_that(SUMMARY.match)
        if 2 * found.sum() < len(table):  # else each row has a name of its own kind
            column.refuse(found, _SUMMARY_ROW)
    if not options.rate:
        return
    for column in _time_columns(table, None):
        if column in texts:
            empty = [cell_kind(str(cell).strip()) is CellKind.NO_VALUE for cell in column.cells]
            if not all(empty):
                column.refuse(np.array(empty), _SUMMARY_ROW)


# Their times.


def _times_of_channels(
    hard: ChannelColumns, soft: ChannelColumns, options: ReadOptions
) -> tuple[Times, Times]:
    """Return the times of both channels, which count from one zero."""
    hard_times = soft_times = _times_of_channel(hard, options)
    if soft.times != hard.times or soft.values.table is not hard.values.table:
        soft_times = _times_of_channel(soft, options)
    one_has_dates = (hard_times.zero_ns is None) != (soft_times.zero_ns is None)
    if one_has_dates or hard_times.is_utc != soft_times.is_utc:
        got = f"{hard_times.notation} for hard and {soft_times.notation} for soft"
        raise OptionError(Option.TIME, got, "the same kind for both")
    later_ns = (soft_times.zero_ns or 0) - (hard_times.zero_ns or 0)
    if later_ns:
        soft_times = replace(soft_times, seconds=soft_times.seconds + later_ns / 1e9)
    return hard_times, soft_times


def _times_of_channel(channel: ChannelColumns, options: ReadOptions) -> Times:
    """Return times by the rate, or from the first column of times that can be read."""
    rows = len(channel.values.table)
    if options.rate is not None:
        return Times(np.arange(rows) / options.rate, "as the rate says")
    for column in channel.times:
        try:
            times = read_times(column, options.time_unit)
            return replace(times, notation=f"{column.label}, {times.notation}")
        except (ValueError, RecordingError):
            if column is channel.times[-1]:
                raise
    return Times(np.full(rows, np.nan), "")


# Pairs of two files.


def _paired_by_time(
    readings: PairedReadings, hard_times: Times, soft_times: Times
) -> tuple[PairedReadings, list[str]]:
    """Return the readings of two files that are near in time, in the order of time, and notes."""
    if not (hard_times.notation and soft_times.notation):
        got = "none for a channel in a file of its own"
        raise OptionError(Option.TIME, got, "times in both files, or rate (--rate)")
    hard_rows, soft_rows = partners(readings.t_hard_s, readings.t_soft_s)
    pairs = len(hard_rows)
    if not pairs:
        got = "none of one file near one of the other"
        raise OptionError(Option.TIME, got, "times that overlap, of one clock")
    notes = []
    hard_count = len(readings.hard)
    soft_count = len(readings.soft)
    if max(hard_count, soft_count) > pairs:
        hard_alone = f"{hard_count - pairs} of {hard_count} hard"
        soft_alone = f"{soft_count - pairs} of {soft_count} soft readings"
        reason = "have no reading of the other channel near in time: left out"
        notes.append(f"{hard_alone} and {soft_alone} {reason}")
    if hard_times.zero_ns is None:
        notes.append("the times of both files are taken as those of one clock")
    t_hard_s, t_soft_s, hard, soft = readings
    paired = (t_hard_s[hard_rows], t_soft_s[soft_rows], hard[hard_rows], soft[soft_rows])
    return PairedReadings(*paired), notes


def partners(t_hard_s: Array, t_soft_s: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the positions of pairs in two sequences of times.

    Each reading is in one pair at most, and the two of a pair are at most a period of the slower
    channel apart. Where channels are read in turn, the partner is always the reading after, or
    always the one before: the direction with the most pairs is used.
    """
    pandas = need("pandas", "tables")
    tables = []
    steps_s = []
    for name, t in (("hard", t_hard_s), ("soft", t_soft_s)):
        table = pandas.DataFrame({"t": t, name: range(len(t)), f"t_{name}": t}).sort_values("t")
        tables.append(table)
        steps_s.append(typical_step(table["t"].to_numpy()))
    period_s = max(steps_s)
    most = pandas.DataFrame({"hard": [], "soft": []})
    for direction in ("nearest", "forward", "backward"):
        pairs = pandas.merge_asof(*tables, on="t", direction=direction, tolerance=period_s)
        pairs = pairs.dropna()
        distance = (pairs["t_hard"] - pairs["t_soft"]).abs()
        nearest_first = distance.sort_values(kind="stable").index
        pairs = pairs.loc[nearest_first].drop_duplicates("soft").sort_index()
        if len(pairs) > len(most):
            most = pairs
    return most["hard"].to_numpy(np.intp), most["soft"].to_numpy(np.intp)
