"""Temperature and supply of the chip beside the samples: in the recording, without a late pair."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate.recording.sidecar import load
from palpate.sources.claims import Conditions, conditions_of


def recorded(path: Path, source: str) -> tuple[list[dict[str, float]], palpate.Stream, float]:
    with palpate.Stream(source, record=path) as stream:
        for estimate in stream:
            last = estimate
    return (load(path) or {})["conditions"], stream, last.sample.t_soft_ns / 1e9


@pytest.mark.parametrize(("capf", "steps"), [(0, 0), (4, 3)])
def test_they_are_in_the_recording_and_make_no_pair_late(tmp_path: Path, capf: int, steps: int) -> None:
    """At the begin and the end; every 10 s where the period leaves time for it."""
    found, stream, end_s = recorded(tmp_path / "run.csv", f"sim:four-specimens?seed=1&capf={capf}")
    times = [each["t_s"] for each in found]
    assert len(times) == 2 + steps
    assert times[0] < 3.0
    assert 0 <= times[-1] - end_s < 0.2
    assert all(9.9 < b - a < 10.5 for a, b in pairwise(times[:-1]))
    assert {each["temperature_C"] for each in found} == {25.0}
    assert [each["supply_V"] for each in found] == pytest.approx([3.3] * len(found), abs=0.001)
    assert (stream.counters.late, stream.counters.lost) == (0, 0)


def test_a_chip_that_cannot_be_read_has_none(tmp_path: Path) -> None:
    """The board is unplugged before the end: the error of the source counts, not that of the temperature."""
    with pytest.raises(palpate.DeviceNotFound):
        recorded(tmp_path / "run.csv", "sim:four-specimens?seed=1&replug=1&fault=unplug:inf@5")
    assert [each["temperature_C"] for each in (load(tmp_path / "run.csv") or {})["conditions"]] == [25.0]


class Measured:
    def __init__(self, given: Any) -> None:
        self.conditions = given


def test_those_of_other_sources_are_checked_and_thinned_out() -> None:
    given = [{"t_s": float(i), "humidity": 40.0} for i in range(5000)]
    found = conditions_of(Measured(given), Conditions([], 0))  # type: ignore[arg-type]
    assert found.given == 5000
    assert len(found.kept) <= 2000
    assert (found.kept[0], found.kept[-1]) == (given[0], given[-1])
    assert conditions_of(Measured(given), found) is found  # type: ignore[arg-type]
    for wrong in (7, [7], [{"t_s": "soon"}], [{"t_s": float("nan")}]):
        with pytest.raises(palpate.ProtocolError, match="conditions cannot be read"):
            conditions_of(Measured(wrong), Conditions([], 0))  # type: ignore[arg-type]
