"""The table of formats: a file is known by its first bytes."""

import gzip
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import palpate
import pytest
from palpate import RecordingError
from palpate.tables.formats import FORMATS, Format, format_of
from palpate.tables.packed import GZIP

BEGINS = [(each, begin) for each in FORMATS for begin in each.begins]


@pytest.mark.parametrize(("known", "begin"), BEGINS, ids=[repr(begin) for _, begin in BEGINS])
def test_each_format_is_read_or_named_with_what_to_do(tmp_path: Path, known: Format, begin: bytes) -> None:
    assert format_of(begin + b"more") is known
    path = tmp_path / "any.csv"
    data = begin + bytes(range(1, 200))
    path.write_bytes(gzip.compress(data) if begin == GZIP else data)
    with pytest.raises(RecordingError) as caught:
        palpate.read(path)
    if known.advice:
        assert caught.value.reason == f"is {known.name}, which palpate cannot read: {known.advice}"
    else:
        module, _, name = known.reader.partition(":")
        assert callable(getattr(import_module(module), name))


def test_a_name_that_says_another_format_is_told(tmp_path: Path) -> None:
    path = tmp_path / "run.xlsx"
    path.write_text("time (s),hard (pF),soft (pF)\n" + "".join(f"{n / 40},6,4\n" for n in range(9)))
    assert "the name says an Excel workbook, but it is text: read as that" in palpate.read(path).notes
    assert palpate.read(path.rename(tmp_path / "run.log")).notes == ()


def test_nothing_optional_is_imported_for_text() -> None:
    code = (
        "import sys, palpate; palpate.read('tests/data/four-specimens.csv');"
        "wrong = {'pyxdf', 'openpyxl', 'pyarrow', 'zipfile', 'pandas'} & set(sys.modules); assert not wrong, wrong"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
