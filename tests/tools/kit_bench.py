"""A simulated board with the driver, on a carrier that connects them, and a simulated chip on an I2C bus, for tests.

PALPATE_CARRIER names the carrier: "process" (a pyusb backend, virtual time, the default), or "usbfs" (the real libusb under
umockdev's preload library).
"""

import errno
import math
import os
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from palpate.ad7746 import registers
from palpate.ad7746.bus import Clock, VirtualClock
from palpate.ad7746.configuration import Channel, Configuration
from palpate.ad7746.driver import LIMIT_NS, Ad7746
from palpate.ad7746.evalkit.usb_bus import EvalKit
from palpate.ad7746.simulator.chip import SimulatedChip
from palpate.ad7746.simulator.evalboard import BUS_KHZ, Fault, FaultKind, SimulatedBoard
from palpate.ad7746.simulator.usb_backend import Port, SimulatedUsb
from palpate.samples import Sample, Status
from palpate.source_events import Gap, SourceEvent

SLOPE_PF_PER_S = 0.02
IDLE_PF = (6.92, 4.69)
# about the result of `auto_capdac`
CENTRED = Configuration(hard=Channel(capdac=41), soft=Channel(capdac=27))


def pins(pin: int, begin_s: float, end_s: float) -> float:
    """Two ramps with very different values, which start again every minute."""
    return IDLE_PF[pin - 1] + SLOPE_PF_PER_S * (((begin_s + end_s) / 2) % 60.0)


@cache
def _usbfs() -> Any:
    from usbfs import UsbfsCarrier

    return UsbfsCarrier()


class ProcessCarrier:
    """Carrier without libusb, with a virtual clock."""

    real = False

    def __init__(self) -> None:
        self.clock: Clock = VirtualClock()
        self._backend = SimulatedUsb(self.clock)
        self._ports: dict[SimulatedBoard, Port] = {}

    def plug(self, kit: SimulatedBoard, number: int = 1) -> None:
        """Plug a board into a port."""
        self._ports[kit] = self._backend.plug(kit, number)

    def unplug(self, kit: SimulatedBoard) -> None:
        self._backend.unplug(self._ports[kit])

    def backend(self) -> SimulatedUsb:
        """Return a pyusb backend that finds the boards that are plugged in now."""
        return self._backend

    @contextmanager
    def denied(self, kit: SimulatedBoard) -> Iterator[None]:
        """Return a context without permission to open a board."""
        self._ports[kit].allowed = False
        yield
        self._ports[kit].allowed = True

    def close(self) -> None:
        assert self._backend.opened == 0, "a handle was not closed"


class Bench(ExitStack):
    """All objects of a test; closes them and checks that nothing is left open."""

    def __init__(
        self,
        *,
        plugged: bool = True,
        loaded: bool = True,
        seed: int = 0,
        carrier: Any = None,
        bus_kHz: float = BUS_KHZ,
    ) -> None:
        super().__init__()
        real = os.environ.get("PALPATE_CARRIER") == "usbfs"
        self.carrier: Any = carrier or (_usbfs() if real else ProcessCarrier())
        self.callback(self.carrier.close)
        self.kit = SimulatedBoard(
            SimulatedChip(pins, seed=seed), self.carrier.clock, loaded=loaded, bus_kHz=bus_kHz
        )
        self.configuration = CENTRED
        self.firmware: Path | None = None
        self.notes: list[str] = []
        self.samples: list[Sample] = []
        self.events: list[SourceEvent] = []  # in `read`
        self.gaps: list[tuple[int, str]] = []  # with the number after the sample before
        self.replug_s = 10.0
        if plugged:
            self.carrier.plug(self.kit)

    def another(self) -> SimulatedBoard:
        """Plug in a second board."""
        kit = SimulatedBoard(SimulatedChip(pins), self.carrier.clock)
        self.carrier.plug(kit, 2)
        return kit

    def open_kit(self, bus: int | None = None, address: int | None = None) -> EvalKit:
        """Open the board, without a driver."""
        where = {"bus": bus, "address": address}
        kit = EvalKit(
            **where,
            firmware=self.firmware,
            backend=self.carrier.backend(),
            clock=self.carrier.clock,
        )
        return self.enter_context(closing(kit))

    def open(self, configuration: Configuration | None = None, **where: int) -> Ad7746:
        """Open and configure the driver."""
        kit = self.open_kit(**where)
        clock = self.carrier.clock
        # the servers of real carriers may be late
        limit_ns = 10**9 if self.carrier.real else LIMIT_NS
        options: dict[str, Any] = {
            "replug_s": self.replug_s,
            "notify": self.notes.append,
            "limit_ns": limit_ns,
        }
        driver = Ad7746(kit, configuration or self.configuration, clock, **options)
        driver.start()
        return self.enter_context(closing(driver))

    def read(self, driver: Ad7746, count: int) -> list[Sample]:
        """Read pairs; their numbers continue."""
        for _ in range(count):
            following = self.samples[-1].seq + 1 if self.samples else 0
            before = len(self.samples)
            for item in driver.read(following):
                if isinstance(item, Sample):
                    self.samples.append(item)
                    continue
                self.events.append(item)
                if isinstance(item, Gap):
                    after = self.samples[-1].seq + 1 if self.samples else 0
                    self.gaps.append((after, item.text))
            assert len(self.samples) == before + 1
        return self.samples

    def fail(self, kind: FaultKind, amount: float = 1.0, **when: Any) -> None:
        """Add a fault."""
        self.kit.faults.append(Fault(kind, amount, **when))

    def check_samples(self, driver: Ad7746, *, failed: bool = False) -> None:
        """Check that each value was a conversion of that input at that time, and that all pairs are counted.

        If reading ended with an error, pairs may have been lost after the last sample.
        """
        ended = {
            (c.pin, c.code): (c.begin + c.end) / 2 for c in self.kit.chip.conversions if not c.lost
        }
        for sample in self.samples:
            if sample.status == Status.LOST:
                assert math.isnan(sample.soft)
                assert sample.soft_raw == -1
                assert (
                    math.isnan(sample.hard)
                    if sample.hard_raw == -1
                    else (1, sample.hard_raw) in ended
                )
                continue
            assert (1, sample.hard_raw) in ended, sample
            assert (2, sample.soft_raw) in ended, sample
            assert sample.hard == registers.capacitance_pF(sample.hard_raw)
        numbers = [sample.seq for sample in self.samples]
        assert numbers == sorted(set(numbers))
        counters = driver.counters
        assert numbers[-1] + 1 <= counters.pairs + counters.lost
        assert failed or numbers[-1] + 1 == counters.pairs + counters.lost
        assert counters.pairs == sum(sample.status != Status.LOST for sample in self.samples)


class Bus:
    """A replacement of smbus2.SMBus for `I2cBus`."""

    def __init__(self, chip: SimulatedChip, clock: VirtualClock) -> None:
        self.chip = chip
        self.clock = clock
        self.opened = 0
        self.failures: list[int] = []
        self.deaf_reset = False  # the chip resets, and does not acknowledge that

    def __call__(self, path: str) -> "Bus":
        assert path == "/dev/i2c-1"
        if self.failures:
            raise OSError(self.failures.pop(0), "failed")
        self.opened += 1
        return self

    def i2c_rdwr(self, *messages: Any) -> None:
        if self.failures:
            raise OSError(self.failures.pop(0), "failed")
        if not self.chip.acknowledges(self.clock.now_ns()):
            raise OSError(errno.EREMOTEIO, "Remote I/O error")
        for message in messages:
            assert message.addr == 0x48
            lasting = (9 * (1 + message.len) + 2) * 2.5e-6  # 400 kHz
            now = self.clock.now_ns()
            if message.flags & 1:
                data = self.chip.read(message.len, now, round(lasting * 1e9))
                for number, byte in enumerate(data):
                    message.buf[number] = bytes([byte])
            else:
                self.chip.write(bytes(message), now + round(lasting * 1e9))
                if self.deaf_reset and bytes(message) == b"\xbf":
                    raise OSError(errno.EREMOTEIO, "Remote I/O error")
            self.clock.sleep(lasting)

    def close(self) -> None:
        self.opened -= 1


def pair_of(driver: Ad7746, seq: int) -> Sample | None:
    """Return the next pair, without the events around it; None after an interruption."""
    samples = [item for item in driver.read(seq) if isinstance(item, Sample)]
    if not samples:
        return None
    return samples[0]
