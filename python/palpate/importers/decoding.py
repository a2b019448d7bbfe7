"""Decode the text of a file: its encoding, signs of other alphabets, blocks of zero bytes."""

import re
from pathlib import Path
from typing import NamedTuple

from palpate.errors import RecordingError

_TABLE_FORMATS = "text, .xlsx, .parquet, .arrow, .feather, .xdf"
# First bytes of files that people take for a table, what they are, and what to do.
_OTHER_FILES = (
    (b"\xd0\xcf\x11\xe0", "an old workbook of Excel (.xls)", "save it as .xlsx or .csv"),
    (b"\x89HDF\r\n", "an HDF5 file (.h5, or .mat of MATLAB 7.3)", "export its table as .csv"),
    (b"MATLAB 5.0", "a file of MATLAB (.mat)", "write it with writetable, as .csv"),
    (b"\x93NUMPY", "an array of numpy (.npy)", "load it, and give the arrays to palpate.touches"),
    (b"TDSm", "a file of LabVIEW (.tdms)", "export it as text (.lvm or .csv)"),
    (b"%PDF", "a PDF document", "export the table as .csv"),
    (b"SQLite format 3", "a database of SQLite", "export the table as .csv"),
    (b"7z\xbc\xaf", "an archive (.7z)", "unpack it"),
    (b"Rar!", "an archive (.rar)", "unpack it"),
    (b"BZh", "a file packed with bzip2", "unpack it, or pack it as .gz"),
    (b"\xfd7zXZ", "a file packed with xz", "unpack it, or pack it as .gz"),
    (b"(\xb5/\xfd", "a file packed with zstd", "unpack it, or pack it as .gz"),
    (b"<!DOCTYPE", "a page of HTML", "open it in a spreadsheet, and save it as .xlsx or .csv"),
    (b"<html", "a page of HTML", "open it in a spreadsheet, and save it as .xlsx or .csv"),
    (b"<?xml", "an XML document", "open it in a spreadsheet, and save it as .xlsx or .csv"),
)
_SIGNS = {"\u2212": "-", "\u2013": "-", "\u00a0": " ", "\u202f": " "}
_SIGN_NAMES = {"\u2212": "the minus sign U+2212", "\u2013": "the dash U+2013"}
_MINUS = re.compile("[\u2212\u2013](?=[0-9.,])")
_MOST_CONTROLS = 0.001  # of the characters of a text
_CONTROLS = re.compile("[\x01-\x08\x0e-\x1f\x7f\ufffd]")


class DecodedText(NamedTuple):
    """The text of a file with Unix line ends, and notes on what was replaced or left out."""

    text: str
    notes: list[str]


def decoded(path: Path, data: bytes) -> DecodedText:
    """Return the text of a file.

    Raises
    ------
    RecordingError
        It is no text.
    """
    _refuse_other_files(path, data)
    encoding = "utf-8-sig"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif _is_utf16(data):
        encoding = "utf-16-le"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    notes: list[str] = []
    text = text.rstrip("\x1a")
    if "\0" in text:
        text, note = _without_zero_bytes(path, text)
        notes.append(note)
    return DecodedText(_with_plain_signs(text, notes), notes)


def _refuse_other_files(path: Path, data: bytes) -> None:
    begin = data[:64].lstrip()
    for signature, kind, advice in _OTHER_FILES:
        if begin.startswith(signature):
            raise RecordingError(path, f"not a table that palpate reads, but {kind}: {advice}")


def _is_utf16(data: bytes) -> bool:
    """Return whether each second byte of the beginning is zero, as in UTF-16 without a mark."""
    begin = data[:64]
    return len(begin) >= 8 and not any(begin[1::2]) and all(begin[::2])


def _without_zero_bytes(path: Path, text: str) -> tuple[str, str]:
    """Return the text with blank lines in place of those with zero bytes, and a note on them.

    A card that loses its power leaves such a block. The row around it may be cut: it is left out.
    """
    lines = text.split("\n")
    wrong = []
    for number, line in enumerate(lines, 1):
        if "\0" in line:
            wrong.append(number)
    controls = len(_CONTROLS.findall(text))
    if 2 * len(wrong) > len(lines) or controls > _MOST_CONTROLS * len(text):
        allowed = f"allowed: {_TABLE_FORMATS}; save a .xls, .mat, .h5 or .npy as one of them"
        raise RecordingError(path, f"not a table that palpate reads, {allowed}")
    count = text.count("\0")
    for number in wrong:
        lines[number - 1] = ""  # blank lines are no rows, and the others keep their numbers
    places = f"line {wrong[0]}"
    if len(wrong) > 1:
        places = f"{len(wrong)} lines, the first is line {wrong[0]},"
    note = f"{places} with {count} zero bytes, as of a card that lost its power: left out"
    return "\n".join(lines), note


def _with_plain_signs(text: str, notes: list[str]) -> str:
    """Return the text with the minus and the blank of ASCII; add a note on a minus."""
    for sign, plain in _SIGNS.items():
        if sign not in text:
            continue
        if sign in _SIGN_NAMES and _MINUS.search(text):
            notes.append(f"{_SIGN_NAMES[sign]} is read as a minus")
        text = text.replace(sign, plain)
    return text
