"""Makes a table of rows of text: finds the header, the samples, and what is neither."""

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import accumulate, islice
from pathlib import Path

from palpate.errors import RecordingError, quoted
from palpate.tables.cell.cell_units import column_of, joined_units
from palpate.tables.cell.kinds import NUMBER, TEXT, fits, has_value, kind, signature
from palpate.tables.table import Table
from palpate.tables.text.header_rate import header_rate
from palpate.tables.text.left_out import LeftOut, Row, by_column, is_comment, is_ending, trimmed, uncommented
from palpate.tables.units import bare

Rows = list[Row]

MOST_HEADER_ROWS = 1000
TORN = "the last row is incomplete (no line end): left out"
_SURE = 3  # rows of numbers, with no text in between, are the first rows
_SAMPLE = 100  # rows used to find which columns have numbers


def table_of(
    path: Path,
    rows: Rows,
    *,
    torn: int | None = None,
    split_name: Callable[[int, int], list[str] | None] = lambda line, width: None,
) -> Table:
    """Return the table that rows of text are.

    Parameters
    ----------
    path : pathlib.Path
        For messages.
    rows : list of (int, list of str)
        The number of each row, from 1, and its cells without blanks around them. Blank rows are left out.
    torn : int, optional
        Number of the last row, if it has no line end.
    split_name : callable, optional
        Called with the number of a header row and the number of columns: its cells if it has another delimiter.

    Raises
    ------
    RecordingError
        No row of numbers, too many rows above it, a row that is too short or too long, or other column names.

    Examples
    --------
    >>> rows = [(1, ["time", "C1"]), (2, ["0.1", "6.1"]), (3, ["0.2", "6.2"]), (4, ["Mean", "6.15"])]
    >>> table = table_of(Path("a.csv"), rows)
    >>> len(table), table.notes
    (2, ["line 4 is no sample ('Mean'): left out"])
    """
    filled = [row for row in rows if any(row[1])]
    plain = [row for row in filled if not is_comment(row[1])]
    pattern = _pattern([cells for _, cells in plain])
    first = _first(plain, pattern)
    if first is None:
        raise RecordingError(path, *_why_no_data(filled))
    start = filled.index(plain[first])
    header = _with_commented(plain[:first], filled[:start], len(plain[first][1]))
    _check_last(path, header, pattern)
    left = LeftOut(path, [cells for _, cells in header], pattern)
    body = left.comments(filled[start:])
    body = left.summaries(body)
    if not body:
        raise RecordingError(path, "not a recording: all rows of numbers are those of a summary", plain[first][0])
    is_torn = len(body) > 1 and body[-1][0] == torn
    body = body[:-1] if is_torn else body
    width = _width(path, body, pattern, header)
    notes = [*_header_notes(header, filled[:start], pattern), *left.notes(), *([TORN] if is_torn else [])]
    split = [split_name(line, width) or cells if len(cells) != width else cells for line, cells in header]
    columns = joined_units([*islice(by_column([cells for _, cells in body], None), width)], pattern)
    names = _names([cells for cells in split if not fits(cells, pattern)], width)
    return Table(
        path,
        [column_of(*column, notes) for column in zip(names, columns, strict=True)],
        [line for line, _ in body],
        split,
        notes,
        _header_fits(split, width, body[0][1]),
        header_rate(cells for _, cells in filled[:start]),
    )


def _pattern(rows: Sequence[list[str]]) -> tuple[bool, ...]:
    """Return which columns have numbers or times, from the rows below the middle."""
    sample = rows if len(rows) <= _SAMPLE else rows[len(rows) // 2 :][:_SAMPLE]
    found = Counter(map(signature, sample))
    return max(found, key=lambda pattern: found[pattern] * sum(pattern), default=())


def _first(rows: Rows, pattern: tuple[bool, ...]) -> int | None:
    """Return the index of the first sample: the first row of numbers that no text follows, if there is one."""
    head = [cells for _, cells in rows[: MOST_HEADER_ROWS + _SURE]]
    data = [bool(pattern) and fits(cells, pattern) for cells in head]
    text = [not has_value(cells) and not is_ending(cells) and cells not in head[:i] for i, cells in enumerate(head)]
    found = [i for i in range(len(head[: MOST_HEADER_ROWS + 1])) if data[i]]
    return next((i for i in found if not any(text[i + 1 : i + _SURE])), found[0] if found else None)


def _why_no_data(rows: Rows) -> tuple[str, int]:
    """Return a reason and a line: those of the row with the most numbers."""
    if not rows:
        return "not a recording: nothing but blank lines", 1
    line, cells = max(rows[: MOST_HEADER_ROWS + 1], key=lambda row: sum(kind(cell) == NUMBER for cell in row[1]))
    wrong = next((cell for cell in cells if cell and kind(cell) != NUMBER), cells[0])
    return f"not a recording: no row of numbers; {quoted(wrong)} is not a number", line


def _with_commented(header: Rows, above: Rows, width: int) -> Rows:
    """Return the header; if no row has the names, those that are comments just above the first sample."""
    if any(len(trimmed(cells)) == width for _, cells in header):
        return header
    found: Rows = []
    for line, cells in reversed(above):
        bare = uncommented(cells, width)
        if not is_comment(cells) or len(bare) != width:
            break
        found.insert(0, (line, bare))
    return [*header, *found]


def _check_last(path: Path, header: Rows, pattern: Sequence[bool]) -> None:
    """Refuse a last row of the header that is a sample with a wrong cell: below the names, and its first value is one."""
    if len(header) < 2 or len(header[-1][1]) < len(pattern) or has_value(header[-2][1]):
        return
    line, cells = header[-1]
    values = [column for column, value in enumerate(pattern) if value]
    wrong = [column for column in values if kind(cells[column]) == TEXT]
    if wrong and wrong[0] != values[0] and len(trimmed(header[-2][1])) >= len(pattern):
        place = f"column {wrong[0] + 1} ({header[-2][1][wrong[0]]})"
        raise RecordingError(
            path, f"{quoted(cells[wrong[0]])} in {place} is neither a number nor an overload mark", line
        )


def _header_notes(header: Rows, above: Rows, pattern: tuple[bool, ...]) -> list[str]:
    """Return notes on rows above the first sample that may be samples."""
    numeric = sum(fits(cells, pattern) for _, cells in header)
    notes = [f"{numeric} rows of numbers are above the column names: treated as part of the header"] if numeric else []
    full = [line for line, cells in header if not has_value(cells) and len(trimmed(cells)) >= len(pattern)]
    for line, cells in above if full else []:
        bare = uncommented(cells, len(pattern)) if is_comment(cells) else cells
        if line > full[-1] and any(map(str.isdecimal, "".join(bare))) and (bare == cells or fits(bare, pattern)):
            kind_of_row = "part of the header" if bare == cells else "a comment"
            notes.append(f"line {line} has numbers ({quoted(', '.join(cells))}): treated as {kind_of_row}")
    return notes


def _width(path: Path, rows: Rows, pattern: Sequence[bool], header: Rows) -> int:
    """Return the number of columns."""
    lengths = Counter(len(cells) for _, cells in rows)
    if len(lengths) > 1:
        lengths = Counter(len(trimmed(cells)) for _, cells in rows)
    named = max((len(trimmed(cells)) for _, cells in header), default=0)
    usual = max(len(pattern), lengths.most_common(1)[0][0])
    if len(lengths) > 1:
        _check_lengths(path, rows, len(pattern), max(usual, named))
    width = max(lengths)
    while width > max(named, len(pattern)) and not any(cells[width - 1] for _, cells in rows if len(cells) >= width):
        width -= 1
    return width


def _check_lengths(path: Path, rows: Rows, least: int, most: int) -> None:
    for line, cells in rows:
        length = len(cells)
        if length < least or any(cell and kind(cell) != TEXT for cell in cells[most:]):
            allowed = f"{least}" if least == most else f"{least} to {most}"
            raise RecordingError(path, f"got {length} cells, allowed: {allowed}, as in the other rows", line)


def _header_fits(header: list[list[str]], width: int, first: list[str]) -> bool:
    """Return whether the lowest row of names has as many cells as the rows, but for blank ones."""
    lowest = next((trimmed(row) for row in reversed(header) if sum(map(bool, row)) > 1), header[-1] if header else [])
    return not header or len(lowest) == width or not any(lowest[width:] + first[len(lowest) :])


def _names(header: list[list[str]], width: int) -> list[tuple[str, ...]]:
    """Return all names of each column; a blank cell of an upper header row belongs to the name on its left.

    The last one is that of the lowest row, if this row names all columns; else all of them joined.
    Upper rows with fewer cells are no part of the name of a column that is joined of several rows; one with one cell is
    a title, and names no column.
    """
    header = [row for row in header[:-1] if sum(map(bool, row)) > 1] + header[-1:]
    filled = [[*row, *[""] * (width - len(row))] for row in header]
    spanning = [list(accumulate(row, _filled)) for row in header[:-1] if len(row) >= width]
    lowest = bool(filled) and _names_all(filled[-1])
    found = []
    for column in range(width):
        cells = [row[column] for row in filled]
        joined = " ".join(part for part in [*(row[column] for row in spanning), *cells[-1:]] if part)
        order = [joined, *cells] if lowest else [*cells, joined]
        found.append(tuple(reversed([name for name in dict.fromkeys(reversed(order)) if name])))
    return found


def _names_all(cells: list[str]) -> bool:
    """Return whether the cells of a header row are different names, not units."""
    return len({*cells}) == len(cells) and all(cells) and sum(not bare(cell) for cell in cells) < 2


def _filled(left: str, cell: str) -> str:
    return cell or left
