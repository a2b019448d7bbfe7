"""A measurement that one process sends over Lab Streaming Layer, and another one receives; both record it.

The sender may run in a time namespace of Linux: its clock is then so many seconds ahead, as that of another machine, and
the difference is known exactly. Run as a program: `python tests/tools/lsl_loopback.py SECONDS [AHEAD_S]`.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple
from uuid import uuid4

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.samples import Block, feed

_PALPATE = [sys.executable, "-m", "palpate"]
_LIMIT_S = 120.0
_ALIKE = 10


class Result(NamedTuple):
    """What came of what was sent between the first and the last pair received.

    Attributes
    ----------
    sent, lost, extra, changed : int
        Pairs: recorded by the sender; not in the recording of the receiver; only there; with other values or status.
    error_s : numpy.ndarray
        Time of each pair at the receiver minus that at the sender, on one clock, s.
    skew_s : numpy.ndarray
        The same of the time from the hard to the soft channel.
    touches : int
        Touches of the receiver's recording; -1: those of the sender's, of the same pairs, are not the same ones, bit for
        bit but for the time of their begin.
    """

    sent: int
    lost: int
    extra: int
    changed: int
    error_s: NDArray[np.float64]
    skew_s: NDArray[np.float64]
    touches: int

    def __str__(self) -> str:
        """Return a line for the summary."""
        error_us = np.abs(self.error_s) * 1e6
        return (
            f"{self.sent} pairs: {self.lost} lost, {self.extra} extra, {self.changed} changed; "
            f"offset error median {np.median(error_us):.3f} us, largest {error_us.max():.3f} us"
        )


def ahead(seconds: float) -> list[str]:
    """Return what begins a command whose monotonic clock is so far ahead; empty for 0."""
    return ["unshare", "--time", "--monotonic", str(round(seconds)), "--fork"] if seconds else []


def can_be_ahead() -> bool:
    """Return whether this process may make a time namespace."""
    try:
        return subprocess.run([*ahead(1), "true"], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def loopback(folder: Path, seconds: float, ahead_s: float = 0.0, scenario: str = "four-specimens") -> Result:
    """Send for at least this time, receive for this time, and compare."""
    name = f"palpate-loopback-{uuid4().hex[:12]}"
    sent, received = folder / "sent.csv", folder / "received.csv"
    source = f"sim:{scenario}?speed=1&seed=1&idle={max(seconds - 15, 4):g}"
    sender = [*ahead(ahead_s), *_PALPATE, "record", source, "-o", str(sent), "--lsl", name]
    with subprocess.Popen(sender, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                          start_new_session=True) as sending:  # fmt: skip
        try:
            receiver = ["record", f"lsl:{name}?wait=60&replug=0", "-o", str(received), "--seconds", str(seconds)]
            done = subprocess.run([*_PALPATE, *receiver], capture_output=True, text=True, check=False,
                                  timeout=seconds + _LIMIT_S)  # fmt: skip
            assert done.returncode == 0, done.stderr
        finally:
            os.killpg(sending.pid, signal.SIGTERM)  # unshare passes no signal on
            _, said = sending.communicate(timeout=_LIMIT_S)
    assert sent.exists(), said
    return compared(sent, received, ahead_s)


def compared(sent: Path, received: Path, ahead_s: float = 0.0) -> Result:
    """Compare the recording of the sender with that of the receiver, which began later: its numbers begin at 0 again."""
    theirs, ours = (np.concatenate(list(palpate.recorded(path).blocks())) for path in (sent, received))
    ours["seq"] += _begin(theirs, ours)
    within = theirs[(theirs["seq"] >= ours["seq"][0]) & (theirs["seq"] <= ours["seq"][-1])]
    both, at_ours, at_theirs = np.intersect1d(ours["seq"], within["seq"], return_indices=True)
    mine, other = ours[at_ours], within[at_theirs]
    offset_ns = _zero_ns(received) - _zero_ns(sent) + round(ahead_s * 1e9)
    skews_ns = [block["t_soft_ns"] - block["t_hard_ns"] for block in (mine, other)]
    touches = _touches(mine)
    return Result(
        len(within),
        len(within) - len(both),
        len(ours) - len(both),
        sum(a.tobytes() != b.tobytes() for a, b in zip(_values(mine), _values(other), strict=True)),
        (mine["t_hard_ns"] - other["t_hard_ns"] + offset_ns) / 1e9,
        (skews_ns[0] - skews_ns[1]) / 1e9,
        len(touches) if touches == _touches(other) else -1,
    )


def _begin(theirs: Block, ours: Block) -> int:
    """Return the number, at the sender, of the first pair received: that with the same readings in the pairs after it."""
    wanted = _values(ours[:_ALIKE]).tobytes()
    found = [i for i in range(len(theirs)) if _values(theirs[i : i + _ALIKE]).tobytes() == wanted]
    assert len(found) == 1, "readings with noise, so many in a row, are not repeated"
    return int(theirs["seq"][found[0]])


def _values(block: Block) -> NDArray[np.float64]:
    return np.column_stack([block["hard"], block["soft"], block["status"].astype(float)])


def _zero_ns(path: Path) -> int:
    clock = json.loads(path.with_suffix(".json").read_text())["clock"]
    return int(clock["zero_monotonic_ns"])


def _touches(rows: Block) -> list[dict[str, object]]:
    tracker = palpate.Tracker("handheld")
    feed(tracker, rows)
    tracker.finish()
    return [{key: value for key, value in touch.as_dict().items() if key != "start_s"} for touch in tracker.touches]


def main(seconds: float, ahead_s: float = 0.0) -> None:
    """Print the result of one run."""
    with tempfile.TemporaryDirectory() as folder:
        result = loopback(Path(folder), seconds, ahead_s)
    sys.stdout.write(f"{result}; touches: {result.touches}\n")


if __name__ == "__main__":
    os.environ.setdefault("LSLAPICFG", os.devnull)
    main(*map(float, sys.argv[1:]))
