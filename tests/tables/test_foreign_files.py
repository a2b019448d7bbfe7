"""Files of other programs are read right, asked about, or refused with the line: never wrong in silence."""

import re
from pathlib import Path

import pytest
from foreign_files import CASES, RATIOS, Case, measurement, run  # tests/tools
from palpate import Recording, touches


def test_the_measurement_has_the_known_ratios() -> None:
    t, hard, soft = measurement()
    found = touches(Recording(t, t, hard, soft))
    assert [touch.ratio for touch in found] == pytest.approx(RATIOS, rel=2e-4)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_file_is_read_right_or_not_at_all(tmp_path: Path, case: Case) -> None:
    found = run(case, tmp_path)
    assert found.ends == case.ends, found
    assert re.search(case.says, found.said), found
