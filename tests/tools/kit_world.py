"""A world that the driver does not assume: the clocks of bus and chip, and a computer that stalls."""

from dataclasses import dataclass, replace
from random import Random
from typing import Any

from kit_bench import CENTRED, Bench
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import BUS_KHZ
from palpate.ad7746.twin.usb import TwinBackend
from palpate.samples import Sample, Status
from usb_carriers import ProcessCarrier

LONGEST_S = 0.1
LIMIT_MS = 2.0


@dataclass(frozen=True)
class World:
    """Everything that the data sheet or the operating system leaves open.

    Attributes
    ----------
    bus_kHz : float
        I2C clock.
    pace : float
        Time of a conversion, relative to the data sheet's.
    stalls : float
        Share of the driver's transfers and waits that are stopped, for up to `LONGEST_S`, before or after.
    capf : int
        Speed that the driver chooses.
    """

    bus_kHz: float = BUS_KHZ
    pace: float = 1.0
    stalls: float = 0.0
    capf: int = 0

    def bench(self, seed: int = 0) -> Bench:
        """Return a bench in this world."""
        bench = Bench(seed=seed, carrier=StalledCarrier(self.stalls, seed), bus_kHz=self.bus_kHz)
        bench.configuration = replace(CENTRED, capf=self.capf)
        bench.kit.chip.pace = self.pace
        return bench


class StalledClock(VirtualClock):
    """A clock whose waits may be stopped."""

    def __init__(self, share: float, seed: int) -> None:
        super().__init__()
        self._share, self._random = share, Random(seed)

    def sleep(self, seconds: float) -> None:
        """Wait for this time, or longer."""
        self.advance(seconds)
        self.may_stop(self._share)

    def advance(self, seconds: float) -> None:
        """Let time pass, as on a computer that does not stall."""
        super().sleep(seconds)

    def may_stop(self, share: float) -> None:
        """Stop here, with this probability."""
        if self._random.random() < share:
            self.advance(self._random.uniform(0.0, LONGEST_S))


class _Steady:
    """The board's own view of the clock: nothing stops it."""

    def __init__(self, clock: StalledClock) -> None:
        self.now_ns, self.sleep = clock.now_ns, clock.advance


class StalledBackend(TwinBackend):
    """USB of a computer that stalls: the board goes on by itself."""

    def __init__(self, clock: StalledClock, share: float) -> None:
        super().__init__(_Steady(clock))
        self._stalled, self._share = clock, share

    def ctrl_transfer(self, *request: Any) -> int:
        """Do one control transfer; stopped before it is begun, or after its end."""
        self._stalled.may_stop(self._share / 2)
        try:
            return super().ctrl_transfer(*request)
        finally:
            self._stalled.may_stop(self._share / 2)


class StalledCarrier(ProcessCarrier):
    """Carrier of a computer that stalls, with a virtual clock."""

    def __init__(self, share: float, seed: int) -> None:
        super().__init__()
        self.clock = StalledClock(share, seed)
        self._backend = StalledBackend(self.clock, share)


def stamp_errors_ms(bench: Bench, sample: Sample, start_ns: int) -> tuple[float, float]:
    """Return the errors of a sample's two times, ms; its codes must be those of two conversions."""
    assert sample.status != Status.LOST
    hard = sample.t_hard_ns + start_ns - middle_of(bench.kit.chip, 1, sample.hard_raw, sample.t_hard_ns + start_ns)
    soft = sample.t_soft_ns + start_ns - middle_of(bench.kit.chip, 2, sample.soft_raw, sample.t_soft_ns + start_ns)
    return hard / 1e6, soft / 1e6


def middle_of(chip: ChipTwin, pin: int, code: int, near_ns: int) -> float:
    """Return the time of the middle of the conversion with this code, ns: the nearest one; it must exist."""
    found = [(c.begin + c.end) / 2 for c in chip.conversions if (c.pin, c.code) == (pin, code) and not c.lost]
    return min(found, key=lambda middle: abs(middle - near_ns))


def check_stamps(bench: Bench, start_ns: int, *, alike_ms: float = LIMIT_MS) -> float:
    """Check that no time is off by more than the limit or by more than it says; return the largest error, ms.

    `alike_ms`: allowed for an error that both times have.
    """
    worst = 0.0
    for sample in bench.samples:
        if sample.status == Status.LOST:
            continue
        hard, soft = stamp_errors_ms(bench, sample, start_ns)
        assert max(abs(hard), abs(soft)) <= alike_ms, sample
        assert abs(soft - hard) <= sample.t_uncertainty_us / 1000 <= LIMIT_MS, sample
        worst = max(worst, abs(hard), abs(soft))
    return worst
