"""Dates as texts in an order of day and month that has to be found, and clocks of 12 hours."""

import re
from collections.abc import Iterable
from datetime import date
from functools import partial
from typing import NamedTuple

_NUMERIC = re.compile(r"(\d{1,4})([-/.])(\d{1,2})\2(\d{1,4})(?:[T ,]+(.*))?")
_TWELVE_HOURS = re.compile(r"(\d{1,2})(:.*?) ?([AaPp])[Mm]")
_FOUR_COLONS = re.compile(r"(\d{1,2}:\d\d:\d\d):(\d{1,6})")
_Parts = tuple[int, int, int]


class OrderedTimes(NamedTuple):
    """Texts with dates as 2026-03-05, or only with times of day, and a note; "" without one."""

    texts: list[str]
    note: str = ""


def ordered(texts: Iterable[str]) -> OrderedTimes | None:
    """Return texts with dates and times of day in the order of ISO 8601.

    Parameters
    ----------
    texts : iterable of str

    Returns
    -------
    OrderedTimes or None
        None: a text is no date, or day and month may be either, and the dates differ. If all have
        the same date, and it is ambiguous, only the times of day.

    Examples
    --------
    >>> ordered(["3/25/2026 2:22:10.370 PM"]).texts
    ['2026-03-25 14:22:10.370']
    >>> ordered(["3/5/2026 14:22:10"])
    OrderedTimes(texts=['14:22:10'], note='3/5/2026 is a day of March or of May: only the time of day is used')
    """
    dates = []
    clocks = []
    for match in map(_NUMERIC.fullmatch, texts):
        if match is None:
            return None
        first, sign, second, third, clock = match.groups()
        dates.append((int(first), int(second), int(third)))
        clocks.append(with_24_hours(clock or ""))
        if len(first) > 2:
            sign = "-"
    different = sorted(set(dates))
    order = _order(different, sign)
    if order is None and len(different) == 1 and all(clocks):
        first_number, second_number, _ = different[0]
        if max(first_number, second_number) <= len(_MONTHS):
            written = sign.join(map(str, different[0]))
            months = f"{_MONTHS[first_number - 1]} or of {_MONTHS[second_number - 1]}"
            note = f"{written} is a day of {months}: only the time of day is used"
            return OrderedTimes(clocks, note)
    if order is None:
        return None
    days = {each: _day(each, order) for each in different}
    result = []
    for each, clock in zip(dates, clocks, strict=True):
        day = days[each]
        if day is None:
            return None
        result.append(f"{day.isoformat()} {clock}".strip())
    return OrderedTimes(result)


def with_24_hours(clock: str) -> str:
    """Return a time of day with AM or PM as one of 24 hours, and 1:2:3:400 as 1:2:3.400."""
    clock = _FOUR_COLONS.sub(r"\1.\2", clock.strip())
    match = _TWELVE_HOURS.fullmatch(clock)
    if match is None:
        return clock
    hour = int(match[1]) % 12
    if match[3] in "pP":
        hour += 12
    return f"{hour:02}{match[2]}"


_MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September",
    "October", "November", "December",
)  # fmt: skip
_ORDERS = {"ymd": (0, 1, 2), "dmy": (2, 1, 0), "mdy": (2, 0, 1)}


def _order(dates: list[_Parts], sign: str) -> str | None:
    """Return the order of the numbers of dates; None if it is ambiguous."""
    if all(first > 31 for first, _, _ in dates):
        return "ymd"
    if sign == ".":
        return "dmy"
    possible = []
    for order in ("dmy", "mdy"):
        if all(_day(each, order) is not None for each in dates):
            possible.append(order)
    if len(possible) == 2 and len(dates) == 2:  # over midnight
        possible = list(filter(partial(_is_next_day, dates), possible))
    if len(possible) == 1:
        return possible[0]
    return None


def _is_next_day(dates: list[_Parts], order: str) -> bool:
    one = _day(dates[0], order)
    other = _day(dates[1], order)
    return one is not None and other is not None and abs((other - one).days) == 1


def _day(numbers: _Parts, order: str) -> date | None:
    """Return a date from its numbers in an order; None if there is no such date."""
    of_year, of_month, of_day = _ORDERS[order]
    year = numbers[of_year]
    if year < 100:
        year += 2000
    try:
        return date(year, numbers[of_month], numbers[of_day])
    except ValueError:
        return None
