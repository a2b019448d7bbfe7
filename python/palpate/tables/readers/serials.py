"""Dates and times of spreadsheets: serial days, and the number formats that say what they are."""

import math
import re
from datetime import datetime, timedelta

NUMBER, DATE, CLOCK, PERCENT = "", "date", "clock", "percent"
"""What a number format shows: a number, a date, a time of day or a duration, a share."""

_DATES = frozenset({*range(14, 18), 22, *range(27, 32), 36, *range(50, 59)})
_CLOCKS = frozenset({*range(18, 22), *range(32, 36), *range(45, 48)})
_SHARES = frozenset({9, 10})
_LONGEST = 255  # characters of a format: Excel has no longer ones
_NOT_SHOWN = re.compile(r'"[^"]*"|\\.|[_*].|\[(?!(?:h+|m+|s+)\])[^\]]*\]')
_YEAR_2000 = 36526  # serial days
_BASE, _EARLY_BASE = datetime(1899, 12, 30), datetime(1899, 12, 31)  # Excel has a 29 February 1900, day 60
_BETWEEN_SYSTEMS = 1462  # days from 1900 to 1904


def kind_of(number: int, code: str | None) -> str:
    """Return what a number format shows.

    Parameters
    ----------
    number : int
        Its number; below 164 those of ECMA-376 Part 1, 18.8.30.
    code : str or None
        Its code, if the file has one of its own.

    Examples
    --------
    >>> kind_of(22, None), kind_of(164, 'h:mm:ss.000'), kind_of(165, '0.000 "days"'), kind_of(0, None)
    ('date', 'clock', '', '')
    """
    if code is None:
        return DATE if number in _DATES else CLOCK if number in _CLOCKS else PERCENT if number in _SHARES else NUMBER
    shown = _NOT_SHOWN.sub("", code[:_LONGEST].lower()).replace("general", "")
    if {"y", "d"} & set(shown):
        return DATE
    if {"h", "s"} & set(shown):
        return CLOCK
    return DATE if "m" in shown else PERCENT if "%" in shown else NUMBER


def text_of(number: str, kind: str, from_1904: bool = False) -> str:
    """Return a number as its format shows it, with all its digits: dates and times to 1 us.

    Examples
    --------
    >>> text_of("46347.500000300926", "date"), text_of("1.5", "clock"), text_of("0.061", "percent")
    ('2026-11-21 12:00:00.026000', '36:00:00.000000', '6.1%')
    """
    days = float(number) if kind else math.nan
    if kind == PERCENT:
        return f"{100 * float(number):.12g}%"
    if kind == CLOCK and 0 <= days < _YEAR_2000:
        return _clock(round(days * 86_400_000_000))
    if kind and 0 <= days < 1e7:
        days += _BETWEEN_SYSTEMS if from_1904 else 0
        return _date(days)
    return number


def _clock(microseconds: int) -> str:
    seconds, fraction = divmod(microseconds, 1_000_000)
    return f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}.{fraction:06}"


def _date(days: float) -> str:
    whole = math.floor(days)
    part = timedelta(microseconds=round((days - whole) * 86_400_000_000))
    try:
        return ((_BASE if whole >= 60 else _EARLY_BASE) + timedelta(days=whole) + part).isoformat(" ", "microseconds")
    except OverflowError:
        return repr(days)
