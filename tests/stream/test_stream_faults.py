"""Random faults at the twin, seen through the whole way: source, stream, recording and replay."""

import math
from contextlib import suppress

from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import SourceError, Status, Stream
from palpate.ad7746 import datasheet
from palpate.ad7746.twin.kit import FAULTS
from palpate.sources.sim import SimSource, faults
from tally import Tally

PAIRS = 12
LIMIT_S = 120.0

_AMOUNTS = {
    "late": st.floats(0.0, 0.4),
    "short": st.integers(0, 14),
    "unplug": st.floats(0.0, 1.0),
    "overload": st.sampled_from([-9.0, 9.0]),
    "not acknowledged in mid-write": st.integers(0, 6),
}


def _incidents() -> st.SearchStrategy[str]:
    def of(kind: str) -> st.SearchStrategy[str]:
        amounts, times = _AMOUNTS.get(kind, st.integers(1, 3)), st.floats(0.0, 0.6)
        return st.tuples(amounts, times).map(lambda both: f"{kind.replace(' ', '-')}:{both[0]}@{both[1]:.3f}")

    return st.sampled_from(FAULTS).flatmap(of)


@examples(300, 10_000)
@given(incidents=st.lists(_incidents(), min_size=1, max_size=4), seed=st.integers(0, 2**16))
def test_any_schedule(incidents: list[str], seed: int, tally: Tally) -> None:
    """No hang, no crash, no value that was not converted from that input then, and every number accounted for."""
    tally.count("fault schedules through a stream")
    source = SimSource("soft-steady", {"seed": seed, "replug": 2.0, "fault": faults("fault", ",".join(incidents))})
    seen = []
    with Stream(source) as stream, suppress(SourceError):
        for estimate in stream:
            seen.append(estimate.sample)
            if len(seen) >= PAIRS:
                break
    assert source.clock.now_ns() < LIMIT_S * 1e9
    counters = stream.counters
    assert counters.read == counters.delivered
    assert counters.dropped == counters.waiting == 0
    last = stream._started().last
    assert counters.read + counters.lost == (last.seq + 1 if last else 0)
    assert source.driver.counters.pairs + source.driver.counters.lost >= counters.read + counters.lost
    numbers = [sample.seq for sample in seen]
    assert numbers == sorted(set(numbers))
    codes = {(c.pin, c.code) for c in source.kit.chip.conversions if not c.lost}
    for sample in seen:
        if sample.status == Status.LOST:
            assert math.isnan(sample.hard)
            assert math.isnan(sample.soft)
            continue
        assert (1, sample.hard_raw) in codes
        assert (2, sample.soft_raw) in codes
        assert sample.hard == datasheet.capacitance_pF(sample.hard_raw)
        assert sample.soft == datasheet.capacitance_pF(sample.soft_raw)
