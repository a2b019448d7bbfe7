"""SECURITY.md has the limits of the code, and the files that it names are there."""

import re
from pathlib import Path

import pytest
import security_limits
from palpate.sources.iio import LARGEST, read_text
from palpate.sources.options import LONGEST, split
from project import ROOT


def test_the_limits_are_those_of_the_code() -> None:
    text = security_limits.PAGE.read_text(encoding="utf-8")
    assert text.count("<!-- python tests/tools/security_limits.py") == len(security_limits.TABLES)
    assert security_limits.made(text) == text, "run python tests/tools/security_limits.py"


def test_the_files_in_the_table_of_inputs_exist() -> None:
    for _, code, *_ in security_limits.inputs()[1:]:
        path = code.strip("`")
        assert (ROOT / "python" / path).exists() or (ROOT / path).exists(), path
    text = security_limits.PAGE.read_text(encoding="utf-8")
    for path in re.findall(r"`(palpate/[\w/]+\.py)`", text):
        assert (ROOT / "python" / path).exists(), path


def test_a_longer_name_of_a_source_is_refused() -> None:
    split("sim:?" + "a" * (LONGEST - 6) + "=")
    with pytest.raises(ValueError, match="source: got 10,001 characters, allowed: 10,000"):
        split("x" * (LONGEST + 1))


def test_a_longer_file_of_the_kernel_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "in_capacitance0_raw"
    path.write_text("7" * LARGEST)
    assert read_text(path) == "7" * LARGEST
    path.write_text("7" * (LARGEST + 1))
    with pytest.raises(OSError, match="larger than 4,096 bytes"):
        read_text(path)
