"""Every delimiter with every decimal mark; separators of thousands are asked about, or refused."""

from pathlib import Path

import pytest
from palpate.errors import RecordingError
from palpate.importers.delimited_text import text_table
from palpate.importers.table import Option, OptionError, ReadOptions, Table

DELIMITERS = [",", ";", "\t", "|", " ", "   "]
NOT_COMMAS = DELIMITERS[1:]
NAMES = ["time", "hard", "soft"]
ROWS = [[n / 40, 6.1234 + n % 3, -4.5 - n % 2 / 8192] for n in range(60)]
COMMENT = "# pump on\n"
"""With it the rows are read line by line, else by pandas."""


def text_of(delimiter: str, mark: str, rows: list[list[float]] = ROWS, *, comment: str = "") -> str:
    """Write a table; the comment is in its middle."""
    lines = [delimiter.join(map(repr, row)).replace(".", mark) + "\n" for row in rows]
    lines.insert(len(lines) // 2, comment)
    return delimiter.join(NAMES) + "\n" + "".join(lines)


def read(text: str, decimal: str | None = None) -> Table:
    return text_table(Path("table.csv"), text.encode(), ReadOptions(decimal=decimal))


def values(table: Table) -> list[list[float]]:
    columns = [table.column(name).numbers().tolist() for name in NAMES]
    return [list(row) for row in zip(*columns, strict=True)]


@pytest.mark.parametrize("comment", ["", COMMENT], ids=["uniform", "line by line"])
@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("delimiter", DELIMITERS)
def test_each_delimiter_is_found_beside_each_decimal_mark(
    delimiter: str, mark: str, comment: str
) -> None:
    text = text_of(delimiter, mark, comment=comment)
    if delimiter == mark:
        with pytest.raises(RecordingError, match="cells below 3 names: commas separate the cells"):
            read(text)
        return
    table = read(text)
    assert table.decimal_mark == mark
    assert values(table) == ROWS


@pytest.mark.parametrize("comment", ["", COMMENT], ids=["uniform", "line by line"])
@pytest.mark.parametrize("delimiter", NOT_COMMAS)
def test_the_option_of_the_decimal_mark_is_used_and_the_other_mark_refused(
    delimiter: str, comment: str
) -> None:
    for mark, decimal, other in ((",", "comma", "point"), (".", "point", "comma")):
        text = text_of(delimiter, mark, comment=comment)
        assert values(read(text, decimal)) == ROWS
        with pytest.raises(RecordingError, match=f"neither a number with a decimal {other}"):
            values(read(text, other))


@pytest.mark.parametrize("delimiter", NOT_COMMAS)
def test_commas_that_may_separate_thousands_are_asked_about(delimiter: str) -> None:
    rows = [[n, (6.123, 8.375)[n % 2], 4.125] for n in range(60)]
    text = text_of(delimiter, ",", rows)
    with pytest.raises(OptionError, match="a decimal comma or a thousands separator") as caught:
        read(text)
    assert caught.value.option is Option.DECIMAL
    assert values(read(text, "comma")) == rows


@pytest.mark.parametrize("delimiter", NOT_COMMAS)
@pytest.mark.parametrize("cell", ["1,234.5", "1.234,5", "1,234,567", "1.234.567", "1'234.5"])
@pytest.mark.parametrize("count", [1, 60], ids=["one cell", "all cells"])
def test_separators_of_thousands_are_never_numbers(delimiter: str, cell: str, count: int) -> None:
    mark = "," if cell.endswith(",5") else "."
    lines = text_of(delimiter, mark).splitlines()
    for number in range(61 - count, 61):
        time, _, soft = lines[number].split(delimiter)
        lines[number] = delimiter.join([time, cell, soft])
    text = "\n".join(lines) + "\n"
    for decimal in (None, "point", "comma"):
        with pytest.raises((RecordingError, OptionError)):
            values(read(text, decimal))


@pytest.mark.parametrize("delimiter", NOT_COMMAS)
def test_blanks_that_separate_thousands_are_refused(delimiter: str) -> None:
    text = text_of(delimiter, ",").replace("6,1234", "1 006,1234")
    with pytest.raises((RecordingError, OptionError)):
        values(read(text))


@pytest.mark.parametrize("quoted", ["1,234.5", "1,234"])
def test_thousands_in_quotes_between_commas_are_no_numbers(quoted: str) -> None:
    rows = "".join(f'{n},"{quoted}",4.125\n' for n in range(60))
    with pytest.raises((RecordingError, OptionError)):
        values(read(f"time,hard,soft\n{rows}"))


@pytest.mark.parametrize("comment", ["", COMMENT], ids=["uniform", "line by line"])
@pytest.mark.parametrize("mark", [".", ","])
def test_columns_may_be_aligned_by_blanks(mark: str, comment: str) -> None:
    lines = text_of("\t", mark, comment=comment).splitlines()
    aligned = ["".join(f"{cell:>20}" for cell in line.split("\t")) + "\n" for line in lines]
    table = read("".join(aligned))
    assert (len(table.columns), values(table)) == (3, ROWS)
