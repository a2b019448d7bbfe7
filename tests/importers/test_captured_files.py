"""Captured lines and tables of programs: right, or asked about with advice that works when it is followed."""

from pathlib import Path

import numpy as np
import pytest
from captured_files import FILES, REFUSED, Captured  # tests/tools
from foreign_files import RATE, RATIOS  # tests/tools
from palpate import read, touches
from palpate.errors import RecordingError


@pytest.mark.parametrize("captured", FILES.values(), ids=FILES)
def test_a_file_is_read_right_or_its_error_leads_there(tmp_path: Path, captured: Captured) -> None:
    path = tmp_path / captured.name
    path.write_bytes(captured.data)
    if captured.asked:
        with pytest.raises((RecordingError, ValueError)) as caught:
            read(path)
        assert captured.asked in str(caught.value)
    found = read(path, **captured.options)
    assert [touch.ratio for touch in touches(found)] == pytest.approx(RATIOS, rel=5e-3)
    assert captured.note in "\n".join(found.notes)
    steps = np.diff(found.t_hard_s)
    assert abs(float(steps.mean()) * RATE - 1) < 5e-2, found.understood


@pytest.mark.parametrize("name", REFUSED)
def test_other_files_are_named(tmp_path: Path, name: str) -> None:
    data, reason = REFUSED[name]
    path = tmp_path / "other.csv"
    path.write_bytes(data)
    with pytest.raises((RecordingError, ValueError)) as caught:
        read(path)
    assert reason in str(caught.value)
