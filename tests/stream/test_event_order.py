"""Listeners get samples and events in the order of the source; a gap without a sample on either side means nothing."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from palpate.samples import samples_of
from palpate.source_events import Conditions, Gap, GapCause, TroubleBegan, TroubleEnded, TroubleKind
from palpate.stream import Stream
from palpate.stream.batches import Batch
from palpate.stream.listeners import Listener
from recording_bench import Scripted, sample

EVENTS = [
    Gap(GapCause.RANGE, "moved"),
    Gap(GapCause.WIRING, "off"),
    TroubleBegan(TroubleKind.WIRING, "a wire is off"),
    TroubleEnded(TroubleKind.WIRING),
    Conditions(0.5, {"temperature_C": 25.0}),
]


class Log(Listener):
    """Keeps the number of each sample, and each event, in order."""

    def __init__(self) -> None:
        self.items: list[Any] = []

    def batch(self, batch: Batch) -> None:
        self.items += [each.seq for each in samples_of(batch.samples)]

    def gap(self, gap: Gap) -> None:
        self.items.append(gap)

    def trouble_began(self, trouble: TroubleBegan) -> None:
        self.items.append(trouble)

    def trouble_ended(self, trouble: TroubleEnded) -> None:
        self.items.append(trouble)

    def conditions(self, conditions: Conditions) -> None:
        self.items.append(conditions)


def expected_of(script: list[Any]) -> list[Any]:
    """Return the script without gaps before the first and after the last sample, a sample as its number."""
    places = [i for i, item in enumerate(script) if not isinstance(item, tuple(map(type, EVENTS)))]
    expected: list[Any] = []
    for i, item in enumerate(script):
        if i in places:
            expected.append(item.seq)
        elif not isinstance(item, Gap) or (places and places[0] < i < places[-1]):
            expected.append(item)
    return expected


@given(st.lists(st.one_of(st.just("sample"), st.sampled_from(EVENTS)), max_size=12))
def test_listeners_get_samples_and_events_in_the_order_of_the_source(items: list[Any]) -> None:
    script: list[Any] = []
    seq = 0
    for item in items:
        if item == "sample":
            script.append(sample(seq))
            seq += 1
        else:
            script.append(item)
    log = Log()
    stream = Stream(Scripted(script))
    stream.listen(log)
    with stream:
        for _ in stream.batches():
            pass
    assert log.items == expected_of(script)


def test_a_trouble_after_a_gap_waits_with_it_for_the_next_sample() -> None:
    trouble = TroubleEnded(TroubleKind.UNPLUGGED)
    gap = Gap(GapCause.DISCONNECTED, "unplugged")
    log = Log()
    stream = Stream(Scripted([sample(0), gap, trouble, sample(1)]))
    stream.listen(log)
    with stream:
        list(stream.batches())
    assert log.items == [0, gap, trouble, 1]


def test_a_trouble_after_the_last_gap_is_passed_on_at_the_end() -> None:
    trouble = TroubleBegan(TroubleKind.UNPLUGGED, "plug the board in")
    log = Log()
    stream = Stream(Scripted([sample(0), Gap(GapCause.DISCONNECTED, "unplugged"), trouble]))
    stream.listen(log)
    with stream:
        list(stream.batches())
    assert log.items == [0, trouble]
