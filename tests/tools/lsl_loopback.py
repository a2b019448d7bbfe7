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

_PALPATE = [sys.executable, "-m", "palpate"]
_LIMIT_S = 120.0


class Result(NamedTuple):
    """What came of what was sent between the first and the last pair received.

    Attributes
    ----------
    sent, lost, repeated, changed : int
        Pairs: recorded by the sender; not in the recording of the receiver; there twice; with another value.
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
    repeated: int
    changed: int
    error_s: NDArray[np.float64]
    skew_s: NDArray[np.float64]
    touches: int

    def __str__(self) -> str:
        """Return a line for the summary."""
        error_us = np.abs(self.error_s) * 1e6
        return (
            f"{self.sent} pairs: {self.lost} lost, {self.repeated} repeated, {self.changed} changed; "
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
    source = f"sim:{scenario}?speed=1&seed=1&idle={max(seconds - 15, 0):g}"
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
    """Compare the recording of the sender with that of the receiver."""
    ours, theirs = _rows(received), _rows(sent)
    first = np.flatnonzero(_same(theirs, ours[0]))
    last = np.flatnonzero(_same(theirs, ours[-1]))
    assert (len(first), len(last)) == (1, 1), "the readings of a noisy channel are not repeated"
    theirs = theirs[first[0] : last[0] + 1]
    known = {row["pair"].tobytes(): i for i, row in enumerate(theirs)}
    places = [known.get(row["pair"].tobytes(), -1) for row in ours]
    found = [place for place in places if place >= 0]
    mine, other = ours[[place >= 0 for place in places]], theirs[found]
    offset_ns = _zero_ns(received) - _zero_ns(sent) + round(ahead_s * 1e9)
    return Result(
        len(theirs),
        len(theirs) - len(set(found)),
        len(found) - len(set(found)),
        places.count(-1),
        (mine["hard_ns"] - other["hard_ns"] + offset_ns) / 1e9,
        (mine["soft_ns"] - mine["hard_ns"] - other["soft_ns"] + other["hard_ns"]) / 1e9,
        len(_touches(mine)) if _touches(mine) == _touches(other) else -1,
    )


_ROW = np.dtype([("hard_ns", "i8"), ("soft_ns", "i8"), ("pair", [("hard", "f8"), ("soft", "f8")])])


def _rows(path: Path) -> NDArray[np.void]:
    blocks = np.concatenate(list(palpate.recorded(path).blocks()))
    rows = np.empty(len(blocks), _ROW)
    rows["hard_ns"], rows["soft_ns"] = blocks["t_hard_ns"], blocks["t_soft_ns"]
    rows["pair"]["hard"], rows["pair"]["soft"] = blocks["hard"], blocks["soft"]
    return rows


def _same(rows: NDArray[np.void], row: np.void) -> NDArray[np.bool_]:
    pairs = np.array([other.tobytes() for other in rows["pair"]])
    return np.asarray(pairs == row["pair"].tobytes())


def _zero_ns(path: Path) -> int:
    clock = json.loads(path.with_suffix(".json").read_text())["clock"]
    return int(clock["zero_monotonic_ns"])


def _touches(rows: NDArray[np.void]) -> list[dict[str, object]]:
    tracker = palpate.Tracker("handheld")
    tracker.process(rows["hard_ns"], rows["soft_ns"], rows["pair"]["hard"].copy(), rows["pair"]["soft"].copy())
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
