"""A simulated board in real time, sent by one process and received by another one; both record it: times, values, loss.

The sender may run in a time namespace of Linux: its clock is then so many seconds ahead, as the clock of another machine,
and the difference is known exactly.
"""

import faulthandler
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import palpate
import pytest
from effort import NIGHTLY, Tally
from numpy.typing import NDArray
from palpate.samples import Block, feed
from project import need

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="ends its processes with signals")

SECONDS = 600 if NIGHTLY else 3
LIMIT_S = 120.0
PALPATE = [sys.executable, "-m", "palpate", "record"]


def record(folder: Path, name: str, ahead_s: float) -> None:
    """Send for at least this time, receive for this time."""
    faulthandler.cancel_dump_traceback_later()  # ten minutes are longer than its time-out
    source = f"sim:four-specimens?speed=1&seed=1&idle={max(SECONDS - 15, 4):g}"
    ahead = ["unshare", "--time", "--monotonic", f"{ahead_s:.0f}", "--fork"] if ahead_s else []
    sender = [*ahead, *PALPATE, source, "-o", str(folder / "sent.csv"), "--lsl", name]
    with subprocess.Popen(
        sender, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    ) as sending:
        try:
            receiver = [
                f"lsl:{name}?wait=60&replug=0",
                "-o",
                str(folder / "received.csv"),
                "--seconds",
                str(SECONDS),
            ]
            done = subprocess.run(
                [*PALPATE, *receiver],
                capture_output=True,
                text=True,
                check=False,
                timeout=SECONDS + LIMIT_S,
            )
            assert done.returncode == 0, done.stderr
        finally:
            os.killpg(sending.pid, signal.SIGTERM)  # unshare passes no signal on
            sending.wait(LIMIT_S)


def values(block: Block) -> NDArray[np.float64]:
    return np.column_stack([block["hard"], block["soft"], block["status"].astype(float)])


def touches(rows: Block) -> list[dict[str, object]]:
    tracker = palpate.Tracker("handheld")
    feed(tracker, rows)
    tracker.finish()
    return [{**touch.as_dict(), "start_s": 0} for touch in tracker.touches]


@pytest.mark.parametrize("ahead_s", [0.0, 1000.0])
def test_what_is_sent_is_received(ahead_s: float, name: str, tmp_path: Path, tally: Tally) -> None:
    """On one machine the clocks are the same one: the times arrive to the ns, the touches have the same bits.

    With another clock LSL says below 1 ms: half the round trip of its packets is the bound, which a busy machine delays.
    """
    if ahead_s:
        need("unshare")
        if subprocess.run(
            ["unshare", "--time", "true"], capture_output=True, check=False
        ).returncode:
            pytest.skip("needs a time namespace: Linux, with root rights")
    record(tmp_path, name, ahead_s)
    recordings = [palpate.recorded(tmp_path / f"{each}.csv") for each in ("sent", "received")]
    sent, received = (np.concatenate(list(each.blocks())) for each in recordings)
    zeros = [each.sidecar.entries["clock"]["zero_monotonic_ns"] for each in recordings]
    count = len(received)
    [begin] = [
        i
        for i in range(len(sent))
        if values(sent[i : i + 10]).tobytes() == values(received[:10]).tobytes()
    ]
    same = sent[begin : begin + count]
    assert count > 20
    assert values(same).tobytes() == values(received).tobytes()  # none lost, none twice
    assert np.diff(received["seq"]).tolist() == np.diff(same["seq"]).tolist()
    error_s = (
        received["t_hard_ns"] - same["t_hard_ns"] + (zeros[1] - zeros[0] + round(ahead_s * 1e9))
    ) / 1e9
    skew_ns = (received["t_soft_ns"] - received["t_hard_ns"]) - (
        same["t_soft_ns"] - same["t_hard_ns"]
    )
    tally.say(
        f"LSL, a clock {ahead_s:g} s ahead: {count} pairs, largest error {np.abs(error_s).max() * 1e6:.3f} us"
    )
    assert np.abs(skew_ns).max() <= 1
    assert np.median(np.abs(error_s)) <= (1e-3 if ahead_s else 1e-9)
    assert np.abs(error_s).max() <= (20e-3 if ahead_s else 1e-9)
    assert ahead_s or touches(received) == touches(same)
