"""Required results, one module for each theme.

A theme has `rows(seeds)`, which yields its rows; it simulates what it needs. `python -m bench.accuracy.error_vs_time`
prints all of them, `python -m bench.accuracy.must_hold [THEME ...]` some.
"""

from collections.abc import Iterable

from bench.accuracy.must_hold import alarms, earlier, idle, intervals, offline, physics, readings, running
from bench.accuracy.must_hold.row import HEADER, Row, covered, line

THEMES = {
    "running": running.rows,
    "physics": physics.rows,
    "readings": readings.rows,
    "intervals": intervals.rows,
    "idle": idle.rows,
    "alarms": alarms.rows,
    "offline": offline.rows,
    "earlier": earlier.rows,
}
"""Name -> rows(seeds) of each theme."""
COVERED = ("running", "physics", "readings")
"""Themes in which the intervals of every row have to hold the truth."""


def rows_of(theme: str, seeds: int) -> list[Row]:
    """Return the rows of one theme, with its lowest coverage; arguments are plain, for a process of its own."""
    rows = list(THEMES[theme](seeds))
    return [*rows, covered(theme, rows)] if theme in COVERED else rows


def text(rows: Iterable[Row]) -> str:
    """Return rows as a table."""
    return "\n".join([HEADER, *map(line, rows)])
