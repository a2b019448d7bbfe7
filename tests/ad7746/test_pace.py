"""When a conversion was: bounds that always hold, and that nothing narrower would."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.ad7746.pace import Pace, Seen
from palpate.errors import ProtocolError

LENGTH_NS = 11_000_000
_DELAY = st.integers(0, 3_000_000) | st.integers(0, 100_000_000)


def seen(begin: int, length: int, delays: tuple[int, int, int, int]) -> Seen:
    """Return what a computer sees with these delays before and after the begin, and before and after the end."""
    end = begin + length
    return Seen(begin - delays[0], begin + delays[1], max(end - delays[2], begin - delays[0]), end + delays[3])


@given(
    length=st.integers(round(0.95 * LENGTH_NS), round(1.05 * LENGTH_NS)),
    all_delays=st.lists(st.tuples(_DELAY, _DELAY, _DELAY, _DELAY), min_size=1, max_size=5),
)
def test_the_middle_is_within_its_bounds(length: int, all_delays: list[tuple[int, int, int, int]]) -> None:
    pace = Pace(LENGTH_NS / 1e9)
    for number, delays in enumerate(all_delays):
        begin = number * 10**9
        each = seen(begin, length, delays)
        pace.learn(each)
        assert pace.shortest_ns <= length <= pace.longest_ns
        middle = pace.middle(each)
        assert min(middle.early_ns, middle.late_ns) >= 0
        assert -middle.early_ns <= begin + length // 2 - middle.t_ns <= middle.late_ns


@given(st.tuples(_DELAY, _DELAY, _DELAY, _DELAY))
def test_no_narrower_bounds_hold(delays: tuple[int, int, int, int]) -> None:
    """At each bound there is a begin and a duration that the computer would see in the same way."""
    pace = Pace(LENGTH_NS / 1e9)
    each = seen(0, LENGTH_NS, delays)
    pace.learn(each)
    middle = pace.middle(each)
    for bound in (middle.t_ns - middle.early_ns, middle.t_ns + middle.late_ns):
        # Begin B and duration D with B + D/2 = bound: D is in an interval, which is not empty.
        low = max(pace.shortest_ns, 2 * (bound - each.begun), 2 * (each.busy - bound))
        high = min(pace.longest_ns, 2 * (bound - each.asked), 2 * (each.ended - bound))
        assert low <= high + 4  # half a nanosecond in each of them


def test_another_duration_is_refused_and_forgotten() -> None:
    pace = Pace(0.011)
    clean = seen(0, LENGTH_NS, (100_000, 100_000, 100_000, 100_000))
    pace.learn(clean)
    with pytest.raises(ProtocolError, match=r"a conversion took 13\.80 to 14\.20 ms, those before it"):
        pace.learn(clean._replace(busy=clean.busy + 3_000_000, ended=clean.ended + 3_000_000))
    pace.learn(clean._replace(busy=clean.busy + 3_000_000, ended=clean.ended + 3_000_000))
    assert pace.shortest_ns == 13_800_000


def test_a_duration_that_is_too_long_is_corrected() -> None:
    """Polls that begin after the end never find a conversion running: the next ones begin earlier."""
    pace = Pace(0.011)
    pace.learn(Seen(0, 100_000, 13_000_000, 13_100_000))  # a pin that was stuck high, then low
    for _ in range(5):
        began = pace.shortest_ns
        pace.learn(Seen(0, 100_000, 0, began + 3_000_000))
        assert pace.shortest_ns == began - 500_000
