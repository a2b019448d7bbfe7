"""Excel workbooks: of openpyxl, and by hand."""

import datetime
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.tables.formats import read_table
from workbooks import STYLES, by_hand, row, words, workbook

HEADER = ["time (s)", "hard (pF)", "soft (pF)"]
ROWS = [[i / 40, 6.0 + i / 8, 4.0 + i / 4] for i in range(20)]  # openpyxl writes 16 digits of 17


def made(folder: Path, rows: list[list[Any]], **sheets: list[list[Any]]) -> Path:
    """Write a workbook with the sheet Run and these sheets."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, content in {"Run": rows, **sheets}.items():
        sheet = book.create_sheet(name)
        for each in content:
            sheet.append(each)
    path = folder / "book.xlsx"
    book.save(path)
    return path


def test_two_channels_and_their_times(tmp_path: Path) -> None:
    recording = palpate.read(made(tmp_path, [HEADER, *ROWS]))
    assert [recording.t_hard_s.tolist(), recording.hard.tolist(), recording.soft.tolist()] == [
        list(column) for column in zip(*ROWS, strict=True)
    ]
    assert recording.understood == ("time = time, s; hard = hard, pF; soft = soft, pF; 40 pairs a second; 20 rows")
    assert recording.notes == ()


@given(st.floats(allow_nan=False, allow_infinity=False, width=64).filter(lambda value: abs(value) < 1e30))
@examples(50)
def test_every_bit_of_a_number_is_kept(tmp_path_factory: pytest.TempPathFactory, value: float) -> None:
    rows = "".join(row(n, repr(value), str(n)) for n in range(1, 4))
    table = read_table(by_hand(tmp_path_factory.getbasetemp(), workbook(rows)))
    assert np.asarray(table.columns[0].cells).tolist() == [value] * 3


def test_empty_rows_and_columns_keep_their_places(tmp_path: Path) -> None:
    rows: list[list[Any]] = [
        [],
        [None, "Logger 7"],
        [],
        [None, None, *HEADER],
        *([None, None, *cells] for cells in ROWS),
    ]
    path = made(tmp_path, rows)
    table = read_table(path)
    assert (table.lines[0], table.column("hard (pF)") + 1) == (5, 4)
    assert palpate.read(path, columns={"hard": 4, "soft": 5, "time": 3}).hard.tolist() == [cells[1] for cells in ROWS]


def test_merged_header_cells_belong_to_the_columns_below(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    for each in [
        ["time", "hard", None, "soft", None],
        ["s", "pF", "T", "pF", "T"],
        *([t, h, 20, s, 21] for t, h, s in ROWS),
    ]:
        sheet.append(each)
    sheet.merge_cells("B1:C1")
    sheet.merge_cells("D1:E1")
    path = tmp_path / "merged.xlsx"
    book.save(path)
    recording = palpate.read(path, columns={"hard": "hard pF", "soft": "soft pF", "time": "time s"})
    assert recording.soft.tolist() == [cells[2] for cells in ROWS]


def test_dates_keep_microseconds(tmp_path: Path) -> None:
    begin = datetime.datetime(2026, 11, 21, 12)
    stamps = [begin + datetime.timedelta(microseconds=26_042 * i) for i in range(20)]
    path = made(
        tmp_path, [["time", "hard (pF)", "soft (pF)"], *([t, h, s] for t, (_, h, s) in zip(stamps, ROWS, strict=True))]
    )
    cells = read_table(path).columns[0].cells
    assert cells[0] == "2026-11-21 12:00:00.000000"
    seconds = palpate.read(path).t_hard_s
    assert np.allclose(seconds - seconds[0], 0.026042 * np.arange(20), rtol=0, atol=2e-6)


@pytest.mark.parametrize(
    ("style", "value", "properties", "text"),
    [
        (1, "46347.500000300926", "", "2026-11-21 12:00:00.026000"),
        (1, "44885.5", '<workbookPr date1904="1"/>', "2026-11-21 12:00:00.000000"),
        (1, "59", "", "1900-02-28 00:00:00.000000"),
        (1, "61", "", "1900-03-01 00:00:00.000000"),
        (2, "1.0625000003", "", "25:30:00.000026"),
        (3, "6.125", "", None),
        (4, "0.061", "", "6.1%"),
    ],
)
def test_what_a_number_format_shows(tmp_path: Path, style: int, value: str, properties: str, text: str | None) -> None:
    rows = "".join(f'<row r="{n}"><c r="A{n}" s="{style}"><v>{value}</v></c><c r="B{n}"><v>{n}</v></c><c r="C{n}"><v>{n}</v></c></row>' for n in range(1, 5))  # fmt: skip
    table = read_table(by_hand(tmp_path, workbook(rows, {"styles.xml": STYLES}, properties)))
    assert table.columns[0].cells[0] == (float(value) if text is None else text)


def test_cells_that_are_no_numbers(tmp_path: Path) -> None:
    errors = '<c r="B3" t="e"><v>#N/A</v></c><c r="C3"><v>4</v></c>'
    rows = words(1, "time (s)", "hard (pF)", "soft (pF)") + row(2, "0", "6", "4")
    rows += (
        f'<row r="3"><c r="A3"><v>0.026</v></c>{errors}</row>' + row(4, "0.052", "6", "4") + row(5, "0.078", "6", "4")
    )
    recording = palpate.read(by_hand(tmp_path, workbook(rows)))
    assert np.isnan(recording.hard).tolist() == [False, True, False, False]
    assert any("1 of 4 rows have no value" in note for note in recording.notes)
    wrong = rows.replace('t="e"', 't="str"').replace("#N/A", "6.1x3")
    with pytest.raises(RecordingError, match=r"line 3: '6.1x3' in column 2"):
        palpate.read(by_hand(tmp_path, workbook(wrong)))


def test_shared_strings_without_signs_for_the_pronunciation(tmp_path: Path) -> None:
    strings = (
        "<sst><si><t>hard</t><rPh sb='0' eb='1'><t>x</t></rPh></si><si><r><t>so</t></r><r><t>ft </t></r></si></sst>"
    )
    rows = '<row><c t="s"><v>0</v></c><c t="s"><v>1</v></c></row>' + "<row><c><v>6</v></c><c><v>4</v></c></row>" * 3
    table = read_table(by_hand(tmp_path, workbook(rows, {"sharedStrings.xml": strings})))
    assert (table.names(0), table.names(1), list(table.lines)) == (("hard",), ("soft",), [2, 3, 4])


def test_a_formula_that_was_never_calculated_is_named(tmp_path: Path) -> None:
    formulas = [[t, h, f"=B{n}*2"] for n, (t, h, _) in enumerate(ROWS, 2)]
    with pytest.raises(RecordingError, match=r"line 2: '=B2\*2 \(never calculated\)' in column 3"):
        palpate.read(made(tmp_path, [HEADER, *formulas]))
    calculated = (
        row(1, "0", "6", "4")
        + '<row r="2"><c r="A2"><v>1</v></c><c r="B2"><f>A1+6</f><v>6</v></c><c r="C2"><v>4</v></c></row>'
    )
    table = read_table(by_hand(tmp_path, workbook(calculated + row(3, "2", "6", "4"))))
    assert np.asarray(table.columns[1].cells).tolist() == [6, 6, 6]


def test_the_sheet_with_the_channels_is_found(tmp_path: Path) -> None:
    path = made(
        tmp_path,
        [HEADER, *ROWS],
        Info=[["made by", "me"]],
        Moduli=[["nr", "MPa"], [1, 1.0], [2, 2.0], [3, 3.0]],
    )
    recording = palpate.read(path)
    assert len(recording.hard) == 20
    assert any("sheet 'Run' is used" in note for note in recording.notes)


def test_several_sheets_that_fit_are_an_error_that_names_them(tmp_path: Path) -> None:
    path = made(tmp_path, [HEADER, *ROWS], Second=[HEADER, *([t, h + 1, s] for t, h, s in ROWS)])
    with pytest.raises(ValueError, match=r"part: .* 2 of 2 sheets .* \(--part\): Run, Second"):
        palpate.read(path)
    assert palpate.read(path, part="Second").hard[0] == ROWS[0][1] + 1


def test_a_workbook_without_numbers(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no row of numbers"):
        palpate.read(made(tmp_path, [["nothing", "here"]]))


def test_the_name_does_not_matter_but_is_told(tmp_path: Path) -> None:
    path = made(tmp_path, [HEADER, *ROWS]).rename(tmp_path / "book.csv")
    assert palpate.read(path).notes == ("the name says text, but it is an Excel workbook: read as that",)


def test_dates_that_are_text_keep_all_digits(tmp_path: Path) -> None:
    rows = "".join(
        f'<row r="{n}"><c t="d"><v>2026-11-21T12:00:00.0{n}9042</v></c><c><v>{n}</v></c><c><v>{n}</v></c></row>'
        for n in range(1, 5)
    )
    cells = read_table(by_hand(tmp_path, workbook(rows))).columns[0].cells
    assert list(cells) == [f"2026-11-21T12:00:00.0{n}9042" for n in range(1, 5)]


def test_warnings_of_openpyxl_are_not_shown_and_the_filters_stay(tmp_path: Path) -> None:
    filters = list(warnings.filters)
    extension = '<extLst><ext uri="{CCE6A557-97BC-4b89-ADB6-D9C93CAAB3DF}"/></extLst>'
    rows = "".join(row(n, str(n), "6", "4") for n in range(1, 5)) + extension
    assert len(read_table(by_hand(tmp_path, workbook(rows, {"styles.xml": STYLES})))) == 4
    assert warnings.filters == filters


def test_without_openpyxl_the_message_has_the_command(tmp_path: Path) -> None:
    path = made(tmp_path, [HEADER, *ROWS])
    code = (
        "import sys, palpate; sys.modules['openpyxl'] = None\n"
        f"try: palpate.read({str(path)!r})\nexcept palpate.MissingExtra as error: print(error)"
    )
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert "pip install 'palpate[tables]'" in said
    code = "import sys; sys.modules['openpyxl'] = None; from palpate.cli import main; main()"
    assert subprocess.run([sys.executable, "-c", code, "check", str(path)], check=False).returncode == 6
