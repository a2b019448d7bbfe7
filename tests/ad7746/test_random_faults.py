"""Random faults at the driver: never a wrong value or time, a number unaccounted for, or no end."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from effort import NIGHTLY
from hypothesis import given, settings
from hypothesis import strategies as st
from kit_bench import Bench
from kit_world import World, check_stamps
from palpate.ad7746.evalkit.board import ERROR_COUNT, I2C, PORTS
from palpate.ad7746.twin.kit import FAULTS, Fault
from palpate.errors import SourceError
from tally import Tally

PAIRS = 6
LIMIT_S = 60.0

# What a number from 0 to 1 means for a kind of fault; 1 to 3 times otherwise.
_AMOUNTS: dict[str, Callable[[float], float]] = {
    "late": lambda share: 0.4 * share,
    "short": lambda share: round(14 * share),
    "unplug": lambda share: share,
    "overload": lambda share: 9.0 if share > 0.5 else -9.0,
    "not acknowledged in mid-write": lambda share: round(6 * share),
}
_FAULT = st.tuples(
    st.sampled_from(FAULTS),
    st.floats(0.0, 1.0),
    st.integers(0, 30),
    st.sampled_from([None, None, I2C, ERROR_COUNT, PORTS]),
    st.integers(1, 4),
)


def _fault(kind: str, share: float, skip: int, request: int | None, times: int) -> Fault:
    amount = _AMOUNTS[kind](share) if kind in _AMOUNTS else 1 + round(2 * share)
    return Fault(kind, amount, skip, request, times)


_WORLD = st.builds(
    World,
    bus_kHz=st.floats(60.0, 400.0),
    pace=st.floats(0.95, 1.05),
    stalls=st.sampled_from([0.0, 0.01, 0.05]),
    capf=st.integers(0, 7),
)


@settings(max_examples=10_000 if NIGHTLY else 300)
@given(drawn=st.lists(_FAULT, max_size=4), world=_WORLD, seed=st.integers(0, 2**16))
def test_any_faults(
    drawn: list[tuple[str, float, int, int | None, int]], world: World, seed: int, tally: Tally
) -> None:
    tally.count("kit faults")
    with world.bench(seed) as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        bench.kit.faults.extend(_fault(*each) for each in drawn)
        ended = False
        try:
            bench.read(driver, PAIRS)
        except SourceError:
            ended = True
            tally.count("kit faults that ended in an error")
        assert bench.carrier.clock.now_ns() < LIMIT_S * 1e9
        if bench.samples:
            bench.check_samples(driver, failed=ended)
        tally.note("error of a kit stamp under faults and stalls, ms", check_stamps(bench, start_ns))


def test_the_check_would_find_a_wrong_value(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the comparison of registers another input's value gets through."""
    from palpate.ad7746 import converter

    def blind(*_: Any) -> None:
        return None

    monkeypatch.setattr(converter, "_same", blind)
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 1)
        bench.fail("other input")
        bench.read(driver, 1)
        assert not math.isnan(bench.samples[-1].hard)
        with pytest.raises(AssertionError):
            bench.check_samples(driver)
