"""The clock of a stream beside that of this computer; numbers after a reconnection."""

import socket
import time
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pylsl
import pytest
from palpate import ProtocolError
from palpate.sources.lsl.library import ahead_ns, library
from palpate.sources.lsl.numbering import Numbering, Place
from palpate.sources.lsl.times import Times


class Inlet:
    """LSL's estimate of the difference, which changes."""

    def __init__(self, *estimates_s: float) -> None:
        self.estimates_s = list(estimates_s)

    def time_correction(self, timeout: float) -> float:
        assert timeout == 0.0
        if not self.estimates_s:
            raise library().util.TimeoutError
        return self.estimates_s.pop(0)


@pytest.fixture
def times(monkeypatch: pytest.MonkeyPatch) -> Times:
    """Return times that look at the difference at each stamp."""
    monkeypatch.setattr("palpate.sources.lsl.times._REFRESH_S", 0.0)
    return Times(time.monotonic_ns())


def test_the_correction_is_followed(times: Times) -> None:
    now_s = pylsl.local_clock() + 1000.0
    times.begin(-1000.0, "another")
    assert "that of the sender" in times.clock
    inlet = Inlet(-1000.0, -999.5, -999.4)
    found = [times.t_ns(now_s + i, inlet) for i in range(4)]
    assert all(t is not None for t in found)
    steps = [round((b - a) / 1e6) for a, b in pairwise(found) if a is not None and b is not None]
    assert steps == [1500, 1100, 1000]  # ms; without an answer the last one stays


def test_a_small_step_back_of_the_correction_is_no_step_back_of_a_stamp(times: Times) -> None:
    now_s = pylsl.local_clock()
    times.begin(0.01, "another")
    inlet = Inlet(0.01, 0.0095, 0.008)
    first, second, third = (times.t_ns(now_s, inlet) for _ in range(3))
    assert first is not None
    assert second == first
    assert third is None


@pytest.mark.parametrize(
    ("estimate_s", "host", "applied_s"),
    [
        (5e-4, socket.gethostname(), 0.0),
        (2e-3, socket.gethostname(), 2e-3),
        (5e-4, "another", 5e-4),
        (None, "another", 0.0),
    ],
)
def test_which_correction_is_applied(estimate_s: float | None, host: str, applied_s: float) -> None:
    """On one computer the clocks are the same one, and the estimate is noise."""
    zero_ns = time.monotonic_ns()
    times = Times(zero_ns)
    times.begin(estimate_s, host)
    stamp_s = pylsl.local_clock()
    nothing: Any = SimpleNamespace(time_correction=lambda _: applied_s)
    expected = round((stamp_s + applied_s) * 1e9) - ahead_ns(library()) - zero_ns
    assert times.t_ns(stamp_s, nothing) == expected
    assert ("does not answer" in times.remark) == (estimate_s is None)


@pytest.mark.parametrize("stamp_s", [float("nan"), float("inf"), 1e300])
def test_stamps_that_are_none(times: Times, stamp_s: float) -> None:
    times.begin(0.0, "another")
    with pytest.raises(ProtocolError, match="lsl: got the time stamp"):
        times.t_ns(stamp_s, Inlet())


def test_a_clock_that_is_another_one() -> None:
    """As on Windows, where Python before 3.13 counts ticks: the difference is measured; on Linux it is exactly 0."""
    other: Any = SimpleNamespace(local_clock=lambda: time.monotonic() + 5.0)
    assert ahead_ns(other) == pytest.approx(5 * 10**9, abs=10**7)
    same: Any = SimpleNamespace(local_clock=time.monotonic)
    assert ahead_ns(same) == 0


def test_numbers_after_a_reconnection() -> None:
    """Without numbers of the sender, and without a period, nobody knows how many are missing."""
    for period_ns, seq in ((10.0, 6), (float("inf"), 1)):
        numbering = Numbering()
        assert numbering.place(None, None, 100) == Place(0, "")
        numbering.reconnected("away", period_ns)
        assert numbering.place(None, None, 160) == Place(seq, "away")
        assert numbering.place(None, None, 170) == Place(seq + 1, "")
    numbering = Numbering()
    numbering.place(5, 0, 0)
    numbering.reconnected("away", 10.0)
    assert numbering.place(9, 0, 40) == Place(4, "away")
