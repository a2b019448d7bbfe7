"""Captured lines and tables of programs: right, or asked about with advice that works when it is followed."""

from pathlib import Path
from random import Random

import numpy as np
import pytest
from captured_files import FILES, REFUSED, Captured, random_capture  # tests/tools
from effort import draws
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


def test_a_capture_of_any_program_is_never_wrong(tmp_path: Path) -> None:
    count, right = draws(150, 2000, at_least=40), 0
    for seed in range(count):
        path = tmp_path / "capture.log"
        path.write_bytes(random_capture(Random(seed)))
        try:
            found = read(path)
        except (RecordingError, ValueError):
            continue
        told = (seed, found.understood, found.notes)
        assert [touch.ratio for touch in touches(found)] == pytest.approx(RATIOS, rel=1e-2), told
        steps = np.diff(found.t_hard_s)
        is_timed = "rate unknown" not in found.understood
        assert not is_timed or abs(float(steps.mean()) * RATE - 1) < 5e-2, told
        right += 1
    assert right > count / 5
