"""A simulated board in real time, sent by one process and received by another one: times, values, loss."""

import faulthandler
import sys
from pathlib import Path

import numpy as np
import pytest
from effort import NIGHTLY
from lsl_loopback import Result, can_be_ahead, loopback
from tally import Tally

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="ends its processes with signals")

SECONDS = 600 if NIGHTLY else 8
AHEAD_S = 1000.0
_NS = 1e-9


def nothing_is_lost(result: Result) -> None:
    assert result.sent > 20
    assert (result.lost, result.extra, result.changed) == (0, 0, 0)
    assert np.abs(result.skew_s).max() <= _NS


@pytest.fixture(autouse=True)
def patience() -> None:
    """Ten minutes are longer than faulthandler_timeout."""
    faulthandler.cancel_dump_traceback_later()


def test_on_one_machine(tmp_path: Path, tally: Tally) -> None:
    """The clocks are the same one: times arrive as they are, to the ns, and so the touches have the same bits."""
    result = loopback(tmp_path, SECONDS)
    tally.say(f"LSL loopback, one machine, {SECONDS} s: {result}")
    nothing_is_lost(result)
    assert np.abs(result.error_s).max() <= _NS
    assert result.touches >= 0  # the same ones; how many depends on when the receiver began


def test_with_the_clock_of_another_machine(tmp_path: Path, tally: Tally) -> None:
    """The sender's clock is 1000 s ahead: LSL's correction brings its stamps back."""
    if not can_be_ahead():
        pytest.skip("needs a time namespace: Linux, with root rights")
    result = loopback(tmp_path, SECONDS, AHEAD_S)
    tally.say(f"LSL loopback, a clock {AHEAD_S:g} s ahead, {SECONDS} s: {result}")
    nothing_is_lost(result)
    # LSL says below 1 ms. Half the round trip of its packets is the bound; a machine that is busy delays those.
    assert np.median(np.abs(result.error_s)) < 1e-3
    assert np.abs(result.error_s).max() < 20e-3
