"""Excel workbooks that are damaged, or made to do harm."""

import io
import struct
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path

import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.tables.formats import read_table
from palpate.tables.readers import package
from palpate.tables.readers import workbook as books
from workbooks import STYLES, by_hand, row, words, workbook, zipped


def lying() -> bytes:
    """Return a workbook with a part of 2 MB that says it has 100 bytes."""
    data = bytearray(workbook(" " * 2_000_000))
    true = struct.pack(
        "<I", next(i.file_size for i in zipfile.ZipFile(io.BytesIO(data)).infolist() if "sheet1" in i.filename)
    )
    return bytes(data.replace(true, struct.pack("<I", 100)))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (workbook(" " * 2_000_000), r"got 2,00.* bytes in .* after decompression, allowed: 1,000,000 bytes"),
        (lying(), "damaged, or not complete"),
        (zipped({f"{n}": "" for n in range(10_001)}), "10,001 parts"),
        (workbook(row(1, "1", "2") + '<row r="1048576"><c r="XFD1048576"><v>2</v></c></row>'), "got a value in column 16,384"),
        (workbook('<row r="1048577"/>'), "more than 1,048,576 rows"),
        (workbook('<row><c t="str"><v>' + "1" * 40_000 + "</v></c></row>"), "a text of more than 32,767 characters"),
        (workbook("<row><c><v>" + "1" * 400 + "</v></c></row>"), "int too large to convert to float"),
        (workbook("<a/>" * 11_000), "more than 32,000,000 bytes or 10,000 tags without a row: save the table as CSV"),
        (workbook("<row>" + '<c r="A1"/>' * 11_000 + "</row>"), "10,000 tags without a row"),
        (workbook("<row/>", {"sharedStrings.xml": "<sst>" + "<si/>" * 11_000 + "</sst>"}), "10,000 tags without a row"),
        (workbook("<row/>", {"styles.xml": "<styleSheet>" + "<a/>" * 11_000 + "</styleSheet>"}), "10,000 tags without a row"),
        (workbook("<row>"), "damaged, or not complete"),
        (workbook('<row><c t="s"><v>7</v></c></row>'), "damaged, or not complete"),
        (workbook(row(1, "1", "2"), properties='<!DOCTYPE a [<!ENTITY b "c">]>'), "damaged, or not complete"),
        (zipped({"content.xml": ""}), "an OpenDocument file"),
        (zipped({"xl/workbook.bin": ""}), r"binary workbook \(.xlsb\): save it as .xlsx"),
        (zipped({"a.npy": "", "b.npy": ""}), r"numpy arrays \(.npz\)"),
        (zipped({"run.csv": "1,2"}), "no Excel workbook: unpack it; in it: run.csv"),
        (b"PK\x03\x04" + bytes(100), "damaged, or not complete"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(100), "an old Excel workbook, or one with a password.*: save it as .xlsx"),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else "",
)  # fmt: skip
def test_what_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes, said: str) -> None:
    monkeypatch.setattr(package, "LARGEST", 1_000_000)
    monkeypatch.setattr(package, "MOST_TAGS", 10_000)
    with pytest.raises(RecordingError, match=said):
        palpate.read(by_hand(tmp_path, data))


def test_entities_in_entities_are_refused(tmp_path: Path) -> None:
    levels = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 10))
    sheet = f'<!DOCTYPE w [<!ENTITY e0 "0123456789">{levels}]><w><row><c><v>&e9;</v></c></row></w>'
    data = workbook(row(1, "1", "2"))
    files = {
        name: zipfile.ZipFile(io.BytesIO(data)).read(name).decode()
        for name in zipfile.ZipFile(io.BytesIO(data)).namelist()
    }
    with pytest.raises(RecordingError, match="damaged, or not complete"):
        palpate.read(by_hand(tmp_path, zipped(files | {"xl/worksheets/sheet1.xml": sheet})))


def test_a_long_sheet_is_no_part_with_too_many_tags(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(package, "MOST_TAGS", 5000)
    table = read_table(by_hand(tmp_path, workbook("".join(row(n, str(n), "6", "4") for n in range(1, 1001)))))
    assert len(table) == 1000


def test_a_long_tag_is_read_in_large_pieces() -> None:
    """Expat begins again with a long tag or comment at each piece: a minute for 30 MB in pieces of 16 kB."""
    part = package.Package(Path("a"), workbook(" " * 3_000_000)).open("xl/worksheets/sheet1.xml")
    assert [len(part.read(16_384)) for _ in range(3)] == [16_384, 16_384, 1 << 20]


@pytest.mark.parametrize("row", ['<row><c r="A1"><v>1</v></c><c r="ALL1"><v>2</v></c></row>', "<row/>"])
def test_few_cells_far_apart_and_empty_rows_are_limited(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, row: str
) -> None:
    monkeypatch.setattr(books, "MOST_CELLS", 50_000)
    monkeypatch.setattr(books, "MOST_ROWS", 1000)
    with pytest.raises(RecordingError, match="more than 1,000 rows or 50,000 cells in a sheet"):
        palpate.read(by_hand(tmp_path, workbook(row * 1100)))


@examples(100)
@given(st.data())
def test_any_bytes_are_a_recording_or_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    rows = words(1, "time (s)", "hard", "soft") + "".join(row(n, str(n), "6", "4.5") for n in range(2, 9))
    whole = workbook(rows, {"styles.xml": STYLES}, method=zipfile.ZIP_STORED)
    changed = bytearray(whole[: data.draw(st.sampled_from([len(whole), data.draw(st.integers(4, len(whole)))]))])
    for _ in range(data.draw(st.integers(0, 3))):
        changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(st.integers(0, 255))
    path = by_hand(tmp_path_factory.getbasetemp(), _with_checksums(bytes(changed)))
    with suppress(RecordingError, ValueError):
        palpate.read(path)


def _with_checksums(data: bytes) -> bytes:
    """Return a zip file with the right CRCs, so that damage arrives in the XML."""
    try:
        parts = zipfile.ZipFile(io.BytesIO(data)).infolist()
    except (zipfile.BadZipFile, ValueError, struct.error, NotImplementedError, UnicodeDecodeError, OSError):
        return data
    for part in parts:
        begin = part.header_offset + 30 + len(part.filename)
        data = data.replace(
            struct.pack("<I", part.CRC), struct.pack("<I", zlib.crc32(data[begin : begin + part.file_size]))
        )
    return data
