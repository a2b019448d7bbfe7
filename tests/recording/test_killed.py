"""Ended while it records: no row that was acknowledged is lost, and the file says what happened.

PALPATE_MOMENTS says how many random moments are tried of each kind; `python tests/tools/fault_table.py` tries 200.
"""

import os
import re
import signal
import zlib
from collections.abc import Callable
from pathlib import Path

import palpate
import pytest
from palpate import check, read
from palpate.recording.foreign import recorded
from palpate.recording.own_file import Recorded
from palpate.recording.sidecar import load
from recording_child import rows_before_shutdown
from recording_children import AT_ONCE, acknowledged, let_record
from tally import Tally

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no signals and forks on this system")
MOMENTS = int(os.environ.get("PALPATE_MOMENTS", "50"))


def end_at_random(way: str, number: int | None, folder: Path, seed: int, begins: Callable[[Path], object]) -> list[int]:
    """Send each child a signal, with an odd seed after the recordings have begun; return the exit codes."""
    if number is None:
        return let_record(way, folder, seed)
    return let_record(
        way, folder, seed, lambda _, child: os.kill(child, number), begins if seed % 2 else lambda _: True
    )


@pytest.mark.parametrize(("way", "number", "code"), [("endless", signal.SIGKILL, -9), ("shutdown", None, 0)])
def test_ended_at_random_moments_while_recording(
    way: str, number: int | None, code: int, tmp_path: Path, tally: Tally
) -> None:
    rows, begun = 0, 0
    for seed in range(MOMENTS // AT_ONCE if number else 2):
        assert end_at_random(way, number, tmp_path / str(seed), seed, acknowledged) == [code] * AT_ONCE
        for child in range(AT_ONCE):
            path = tmp_path / str(seed) / f"{child}.csv"
            known = acknowledged(path)
            if not path.exists():
                assert known == 0
                continue
            found = look_at(path, known)
            tally.fault("killed (SIGKILL)" if number else "interpreter shut down in mid-stream", known, known - found)
            rows, begun = rows + found, begun + 1
    assert begun > AT_ONCE
    assert rows >= (MOMENTS // 2 // AT_ONCE * AT_ONCE if number else 2 * sum(map(rows_before_shutdown, range(AT_ONCE))))


def look_at(path: Path, known: int) -> int:
    """Check a recording without an end, repair it, check it again; return its rows."""
    report = check(path)
    rows = report.survey.rows
    assert rows >= known
    assert not report.running
    assert report.survey.gaps == report.survey.disordered == report.survey.miscoded == 0
    assert not report.clean
    if document := load(path):
        checkpoint = document.get("checkpoint", {"rows": 0, "bytes": 0, "crc32": 0})
        assert checkpoint["rows"] <= rows
        assert zlib.crc32(path.read_bytes()[: checkpoint["bytes"]]) == checkpoint["crc32"]
        assert report.faults[0].startswith("no end in the sidecar")
        assert len(read(path).hard) == rows
        assert isinstance(recorded(path), Recorded)
        palpate.touches(recorded(path))
        repaired = check(path, repair=True)
        assert repaired.faults == ()
        assert (repaired.survey.rows, repaired.repaired) == (rows, True)
    return rows


def test_ctrl_c_at_random_moments_of_the_command(tmp_path: Path, tally: Tally) -> None:
    """Exit code 130; and what is there by then, if anything, is a whole recording with a clean end."""
    complete = 0
    for seed in range(MOMENTS // 2 // AT_ONCE):
        folder = tmp_path / str(seed)
        codes = end_at_random("command", signal.SIGINT, folder, seed, Path.exists)
        told = [(folder / f"{child}.acknowledged").read_text() for child in range(AT_ONCE)]
        assert codes == [130] * AT_ONCE, "\n".join(told)
        for child in range(AT_ONCE):
            path = folder / f"{child}.csv"
            if not path.exists():
                assert told[child] == "interrupted\n"
                assert not path.with_suffix(".json").exists()
                tally.fault("Ctrl-C before the recording began", 0, 0)
                continue
            report = check(path)
            assert report.clean, report
            closed = re.escape(f"{path}: {report.survey.rows} rows") + r"[^;]*; file closed\n"
            assert re.search(f"({closed}|^interrupted\n)$", told[child])
            tally.fault("Ctrl-C while `palpate record` runs", report.survey.rows, 0)
            complete += 1
    assert complete >= MOMENTS // 2 // AT_ONCE // 2 * AT_ONCE
