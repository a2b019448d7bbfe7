"""What a source gives that it should not, and with which a stream goes on, is told."""

import re
from typing import Any

import numpy as np
import pytest
from hostile import good
from palpate import ProtocolError, Status, Stream
from palpate.samples import block_of, samples_of
from palpate.sources.base import Gap
from recording_bench import Blocks, Scripted

UNPROMISED: dict[str, tuple[dict[str, Any], str]] = {
    "nan without a status": ({"hard": float("nan"), "hard_raw": -1}, "hard: got nan pF with status 0 at sample 5"),
    "inf without a status": ({"soft": float("-inf"), "soft_raw": -1}, "soft: got -inf pF with status 0 at sample 5"),
    "hard time goes back": ({"t_hard_ns": -(10**9)}, "t_hard_ns: goes back by .* s at sample 5"),
    "soft time goes back": ({"t_soft_ns": -(10**9)}, "t_soft_ns: goes back by .* s at sample 5"),
}


@pytest.mark.parametrize("name", UNPROMISED)
@pytest.mark.parametrize("cut", [1, 5, 6, 9])
def test_what_no_source_should_give_is_told_once(name: str, cut: int) -> None:
    wrong, told = UNPROMISED[name]
    samples = good(10)
    samples[5] = samples[5]._replace(**wrong)
    samples[7] = samples[7]._replace(**wrong)
    for source in (Blocks([block_of(samples[:cut]), block_of(samples[cut:])]), Scripted(samples)):
        messages: list[str] = []
        with Stream(source, notify=messages.append) as stream:
            assert len(list(stream)) == 10
        assert len(messages) == 1
        assert re.search(told, messages[0])


def test_a_lost_sample_and_equal_times_are_as_promised() -> None:
    samples = [each._replace(t_hard_ns=0, t_soft_ns=0) for each in good(6)]
    samples[3] = samples[3]._replace(hard=float("nan"), hard_raw=-1, status=Status.LOST)
    messages: list[str] = []
    with Stream(Scripted(samples), notify=messages.append) as stream:
        list(stream)
    assert (messages, stream.counters.refused) == ([], 1)


def test_an_error_of_notify_leaves_no_sample_out_of_the_tracker() -> None:
    block = block_of(good(300))

    def tell(_: str) -> None:
        raise KeyError("display")

    with Stream(Blocks([block], gaps=[Gap(100, "moved")]), notify=tell) as stream:
        with pytest.raises(KeyError, match="display"):
            list(stream.batches())
        assert stream.counters.delivered == 300
        assert stream._feeding.last == samples_of(block[-1:])[0]
        list(stream.batches())
    with Stream(Blocks([block], gaps=[Gap(100, "moved")])) as other:
        list(other.batches())
    later = [np.array([10**12]), np.array([10**12]), np.array([2.0]), np.array([1.0])]
    assert stream.tracker.process(*later).tobytes() == other.tracker.process(*later).tobytes()


def test_a_masked_array_is_refused() -> None:
    """Its mask would be lost."""
    block = np.ma.array(block_of(good(3)))
    with Stream(Blocks([block])) as stream, pytest.raises(ProtocolError, match=r"read_block.*MaskedArray"):
        list(stream)
