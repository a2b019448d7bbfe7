"""Rows of a table that are no samples: comments, summaries, and column names that are repeated."""

import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TypeVar

from palpate.errors import RecordingError, listed, quoted
from palpate.tables.cell.kinds import TEXT, kind

Row = tuple[int, list[str]]
"""The number of a line, from 1, and its cells."""

Missing = TypeVar("Missing", str, None)

_STATISTICS = """
    average avg mean median min minimum max maximum sum total count n std stdev stddev sd sem var variance sigma cv rms
    rsd range mittel mittelwert durchschnitt summe anzahl standardabweichung varianz moyenne somme nombre media promedio
    suma totale
"""
STATISTICS = frozenset(_STATISTICS.split())
"""First words (lower case) of the rows of a summary."""

_ENDS = frozenset(["end", "ende", "fin", "eof", "summary", "statistics", "statistik"])
_COMMENTS = ("#", ";", "%", "//", "!")
_COMMENT_SIGNS = frozenset("#;%/!")
_WORD = re.compile(r"[^\W\d_]++")
_FEW = 10  # rows of a summary, at most, that only their place shows

COMMENT, SUMMARY, NAMES = "comment", "summary", "names"
_SAID = {
    COMMENT: ("is a comment", "are comments"),
    SUMMARY: ("is no sample", "are no samples"),
    NAMES: ("repeats the column names", "repeat the column names"),
}


def is_comment(cells: Sequence[str]) -> bool:
    """Return whether a line begins with a sign of a comment."""
    return cells[0][:1] in _COMMENT_SIGNS and cells[0].startswith(_COMMENTS) and kind(cells[0]) == TEXT


def uncommented(cells: Sequence[str], width: int) -> list[str]:
    """Return the cells of a comment without its sign, as many as columns if that is possible."""
    bare = [cells[0].lstrip("#;%/!").strip(), *cells[1:]]
    return bare[1:] if len(bare) == width + 1 and not bare[0] else bare


def by_column(rows: list[list[str]], missing: Missing) -> Iterator[list[str | Missing]]:
    """Yield the cells of each column; some are missing where a row is too short."""
    widths = set(map(len, rows))
    for column in range(max(widths, default=0)):
        if column < min(widths):
            yield [row[column] for row in rows]
        else:
            yield [row[column] if column < len(row) else missing for row in rows]


def trimmed(cells: Sequence[str]) -> list[str]:
    """Return cells without blank ones at the end."""
    width = len(cells)
    while width and not cells[width - 1]:
        width -= 1
    return list(cells[:width])


class LeftOut:
    """Finds the rows that are no samples below the first one, and says which they are.

    Parameters
    ----------
    path : pathlib.Path
    header : list of list of str
        The rows above the first sample, as in the file.
    pattern : sequence of bool
        The columns that have numbers or times.
    """

    def __init__(self, path: Path, header: list[list[str]], pattern: Sequence[bool]) -> None:
        self._path = path
        self._pattern = pattern
        self._first = pattern.index(True)
        self._header = [trimmed(row) for row in header]
        self._names = {cell.casefold() for row in header for cell in row if kind(cell) == TEXT}
        self._found: list[tuple[int, str, str]] = []

    def comments(self, rows: list[Row]) -> list[Row]:
        """Return rows without comments."""
        found = [row for row in rows if is_comment(row[1])]
        for line, cells in found:
            bare = uncommented(cells, len(self._pattern))
            self._found.append((line, NAMES if self._is_header(line, bare) else COMMENT, cells[0]))
        return [row for row in rows if not is_comment(row[1])] if found else rows

    def summaries(self, rows: list[Row]) -> list[Row]:
        """Return rows without summaries and repeated column names.

        Raises
        ------
        RecordingError
            Other column names than above the first sample.
        """
        left: set[int] = set()
        end = len(rows)
        for index in sorted(self._odd(rows), reverse=True):
            line, cells = rows[index]
            verdict = self._verdict(line, cells, at_end=index == end - 1)
            if verdict:
                left.add(index)
                end = index if index == end - 1 else end
                self._found.append((line, verdict, next(filter(None, cells))))
        return [row for index, row in enumerate(rows) if index not in left] if left else rows

    def _odd(self, rows: list[Row]) -> set[int]:
        """Return the indices of the rows that may be no samples."""
        found: set[int] = set()
        for column, cells in enumerate(by_column([cells for _, cells in rows], "")):
            if self._is_value(column):
                found.update(row for row, cell in enumerate(cells) if not cell[:1].isdecimal() and _is_label(cell))
            else:
                found.update(self._labelled(column, cells))
            if column == self._first:
                blank = [row for row, cell in enumerate(cells) if not cell]
                found.update(blank if len(blank) <= _FEW else [])
        return found

    def _labelled(self, column: int, cells: Sequence[str]) -> list[int]:
        """Return the rows with the name of a statistic in a column of labels, or in one that is blank elsewhere."""
        words = {cell for cell in set(cells) if cell and _WORD.match(cell) and _word(cell) in STATISTICS}
        rows = [row for row, cell in enumerate(cells) if cell in words] if words else []
        of_labels = column < self._first or len(words | {""} | set(cells)) == len(words) + 1
        return rows if of_labels and len(rows) <= min(_FEW, len(cells) - 1) else []

    def _verdict(self, line: int, cells: list[str], *, at_end: bool) -> str:
        """Return what a row is; "" for a sample, or if it is not sure."""
        if self._is_header(line, cells):
            return NAMES
        filled = [column for column, cell in enumerate(cells) if cell]
        label = cells[filled[0]]
        if not _is_label(label):
            in_front = filled[0] > self._first
            at_back = len(filled) > 1 and _word(cells[filled[-1]]) in STATISTICS and not self._is_value(filled[-1])
            return SUMMARY if (in_front and at_end) or at_back else ""
        if _word(label) in STATISTICS | _ENDS:
            return SUMMARY
        of_column = self._is_value(filled[0])
        alone = len(filled) == 1 and sum(self._pattern) > 1 and filled[0] <= self._first
        ending = at_end and len(label) > 1 and of_column and not any(c.isdecimal() for c in label)
        return SUMMARY if alone or ending or (at_end and not of_column and filled[0] < self._first) else ""

    def _is_value(self, column: int) -> bool:
        return column < len(self._pattern) and self._pattern[column]

    def _is_header(self, line: int, cells: Sequence[str]) -> bool:
        """Return whether a row repeats one above the first sample."""
        cells = trimmed(cells)
        if cells in self._header:
            return True
        names = {cell.casefold() for cell in cells if kind(cell) == TEXT}
        if len(cells) >= len(self._pattern) and 1 < len(names) == len(cells) and names & self._names:
            raise RecordingError(self._path, f"other column names than above: {quoted(', '.join(cells))}", line)
        return False

    def notes(self) -> Iterator[str]:
        """Yield a sentence on the rows of each kind."""
        for verdict, said in _SAID.items():
            found = sorted((line, cell) for line, of, cell in self._found if of == verdict)
            if found:
                several = len(found) > 1
                yield (
                    f"{'lines' if several else 'line'} {_ranges([line for line, _ in found])} {said[several]} "
                    f"({quoted(found[0][1])}{', ...' if several else ''}): left out"
                )


def _is_label(cell: str) -> bool:
    """Return whether a cell is text, and not a number with a fault."""
    return bool(cell) and not cell.lstrip("+-.,")[:1].isdigit() and kind(cell) == TEXT


def is_ending(cells: Sequence[str]) -> bool:
    """Return whether a row begins with the name of a statistic, or says that a table ends."""
    return _word(next(filter(None, cells), "")) in STATISTICS | _ENDS


def _word(cell: str) -> str:
    """Return the first word of a cell."""
    match = _WORD.match(cell)
    return match[0].casefold() if match else ""


def _ranges(lines: list[int]) -> str:
    """Return numbers of lines as a sentence names them.

    Examples
    --------
    >>> _ranges([4, 691, 692, 693])
    '4, 691 to 693'
    """
    runs = [[line for _, line in run] for _, run in groupby(enumerate(lines), lambda pair: pair[1] - pair[0])]
    return listed([f"{run[0]} to {run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs], 5)
