"""Random faults at the driver: never a wrong value, never a number unaccounted for, never without end."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from kit_bench import IDLE_PF, SLOPE_PF_PER_S, Bench
from palpate.ad7746 import datasheet
from palpate.ad7746.evalkit.board import ERROR_COUNT, I2C, PORTS
from palpate.ad7746.twin.kit import FAULTS, Fault
from palpate.errors import SourceError
from palpate.samples import Status
from tally import Tally

PAIRS = 6
LIMIT_S = 60.0
_DAC_PF = (41 * 0.171, 27 * 0.171)
# A time is that of a conversion's begin to within its length, or it is not handed on. Six sigma of noise, half a code.
_TOLERANCE_PF = SLOPE_PF_PER_S * datasheet.CONVERSION_S[0] + 6 * datasheet.NOISE_PF[0] + 0.5 / datasheet.CODES_PER_PF

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


def _expected(bench: Bench, channel: int, t_ns: int, start_ns: int) -> float:
    seconds = (t_ns + start_ns) / 1e9
    return IDLE_PF[channel] + SLOPE_PF_PER_S * (seconds % 60.0) - _DAC_PF[channel]


@examples(1000)
@given(drawn=st.lists(_FAULT, max_size=4), seed=st.integers(0, 2**16))
def test_any_faults(drawn: list[tuple[str, float, int, int | None, int]], seed: int, tally: Tally) -> None:
    faults = [_fault(*each) for each in drawn]
    tally.count("kit faults")
    overloaded = any(fault.kind in ("overload", "wire off") for fault in faults)
    with Bench(seed=seed) as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        bench.kit.faults.extend(faults)
        ended = False
        try:
            bench.read(driver, PAIRS)
        except SourceError:
            ended = True
            tally.count("kit faults that ended in an error")
        assert bench.carrier.clock.now_ns() < LIMIT_S * 1e9
        if bench.samples:
            bench.check_samples(driver, failed=ended)
        for sample in bench.samples:
            if sample.status == Status.LOST or overloaded:
                continue
            for channel, value, t_ns in ((0, sample.hard, sample.t_hard_ns), (1, sample.soft, sample.t_soft_ns)):
                deviation = abs(value - _expected(bench, channel, t_ns, start_ns))
                tally.note("deviation of a kit sample under faults, pF", deviation)
                assert deviation < _TOLERANCE_PF


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
