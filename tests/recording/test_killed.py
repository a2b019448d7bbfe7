"""Processes that are killed while they record: no row that was acknowledged is lost, and the file can be repaired.

PALPATE_MOMENTS says how many random moments are tried; test_life_of_a_recording.py has every other way to end.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from effort import Tally, random_of
from palpate import check, read
from palpate.recording.sidecar import load

MOMENTS = int(os.environ.get("PALPATE_MOMENTS", "4"))
ENDLESS = """
import itertools, sys, time
from palpate import Sample, Stream
from palpate.sources import SampleSource

class Endless(SampleSource):
    def describe(self):
        return {"name": "endless"}

    def samples(self):
        for seq in itertools.count():
            yield Sample(seq, seq * 26_000_000, seq * 26_000_000, -1, -1, 1.5, 2.5)
            time.sleep(0.0003)

with Stream(Endless(), record=sys.argv[1]) as stream:
    for _ in stream.batches():
        print(stream.recorder.rows, flush=True)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal on this system")
def test_killed_at_random_moments(tmp_path: Path, tally: Tally) -> None:
    moments = random_of("killed")
    for number in range(MOMENTS):
        path = tmp_path / f"{number}.csv"
        with subprocess.Popen(
            [sys.executable, "-c", ENDLESS, str(path)], stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout
            said = process.stdout.readline()
            time.sleep(moments.uniform(0, 1.5))
            process.send_signal(signal.SIGKILL)
            said += process.stdout.read()
        known = int(said.splitlines()[-1])
        report, document = check(path), load(path) or {}
        rows = report.survey.rows
        tally.fault("killed (SIGKILL)", known, known - rows)
        assert rows >= max(known, document.get("checkpoint", {}).get("rows", 0))
        assert (report.clean, report.running, report.survey.gaps) == (False, False, 0)
        assert report.faults[0].startswith("no end in the sidecar")
        assert len(read(path).hard) == rows
        repaired = check(path, repair=True)
        assert (repaired.faults, repaired.survey.rows, repaired.repaired) == ((), rows, True)
