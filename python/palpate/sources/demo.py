"""A simulated probe that a person presses on the page of `palpate live`: `demo:`."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import exp
from threading import Lock

from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.evalkit.usb_bus import EvalKit
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.elasticity import SORBOTHANE_MPA
from palpate.files import Json
from palpate.messages import quoted, unlike
from palpate.samples import Sample
from palpate.simulation.board_input import simulated_input
from palpate.simulation.held_press import HeldPress
from palpate.simulation.mechanics import Gauge
from palpate.simulation.probe import Scenario, TrueCapacitance
from palpate.simulation.scenarios import PROBE
from palpate.simulation.signals import random_of
from palpate.source_events import SourceEvent
from palpate.sources.board import BoardSource, ConverterOptions
from palpate.sources.options import number, option, whole_number, yes_no
from palpate.sources.sim import Pacing
from palpate.sources.simulated_hand import SimulatedHand, Truth
from palpate.uncertainty import TOUCH_SCATTER

SPECIMENS = {name: SORBOTHANE_MPA[name] for name in ("30 OO", "70 OO", "40 A", "70 A")}
"""The specimens of the demo: name -> true modulus, MPa."""
LONGEST_S = 60.0  # of a press: then the hand is tired
_NOBODY_S = 10.0  # without a page it ends after this time
_PRESS_PF = 0.9  # median of the force in both channels together, as a capacitance
_PRESS_SPREAD = 0.2  # standard deviation of its logarithm
_KEPT = 4  # presses that are still felt, at most


@dataclass(frozen=True)
class DemoOptions(ConverterOptions):
    """Options of `demo:`."""

    seed: int = option(whole_number(0, 2**63), 0)
    """The same seed and the same presses give the same readings."""
    page: bool = option(yes_no, False)
    """Whether a page presses the probe: then the source does not end by itself."""
    tremor: float = option(number(0, 1), 0.02)
    """Tremor of the force, relative."""


class PageHand(SimulatedHand):
    """The hand of somebody at a page: it presses and lifts when the page says so.

    Each press is held a little differently: its ratio scatters as that of a real hand.
    """

    def __init__(self, truth: TrueCapacitance, clock: VirtualClock, seed: int) -> None:
        super().__init__([], SPECIMENS)
        self._capacitance = truth
        self._clock = clock
        self._zero_s = clock.now_ns() / 1e9
        self._random = random_of(seed, "presses of the page")
        self._lock = Lock()  # several pages may press
        self._held: HeldPress | None = None

    @property
    def _now_s(self) -> float:
        return self._clock.now_ns() / 1e9 - self._zero_s

    def press(self, specimen: str) -> None:
        """Press on a specimen until `release`, or until the hand is tired."""
        if specimen not in self.specimens:
            raise ValueError(f"press: {unlike(specimen, list(self.specimens), 'specimen')}")
        with self._lock:
            self._lift()
            start_s = self._now_s
            scatter, firmness = self._random.standard_normal(2)
            ratio = PROBE.ratio(self.specimens[specimen]) * (1 + TOUCH_SCATTER * scatter)
            press = HeldPress(
                start_s,
                [(0.0, ratio)],
                depth_pF=_PRESS_PF * exp(_PRESS_SPREAD * firmness) / (1 + ratio),
                name=specimen,
                released_s=start_s + LONGEST_S,
            )
            self._capacitance.presses = [*self._capacitance.presses[1 - _KEPT :], press]
            self._held = press
            self.truths.append(Truth(start_s, ratio, specimen))

    def release(self) -> None:
        """Lift the probe; nothing happens if it is not pressed."""
        with self._lock:
            self._lift()

    def _lift(self) -> None:
        if self._held is not None and self._held.released_s > self._now_s:
            lifted = replace(self._held, released_s=self._now_s)
            self._capacitance.presses = [*self._capacitance.presses[:-1], lifted]
        self._held = None


class DemoSource(BoardSource):
    """The pairs of a simulated probe that a person presses, in real time.

    Its clock is virtual, so that no busy computer disturbs it.
    """

    live = False
    real_time = False

    def __init__(self, options: DemoOptions) -> None:
        clock = VirtualClock()
        scenario = Scenario(duration_s=0.0, tremor=options.tremor, gauges=(Gauge(), Gauge()))
        simulated = simulated_input(scenario, clock, options.seed)
        self.hand: PageHand = PageHand(simulated.truth, clock, options.seed)
        self._options = options
        self._zero_ns: int | None = None  # known from the first pair on
        backend = SimulatedUsb(clock)
        backend.plug(simulated.board)
        super().__init__(EvalKit(backend=backend, clock=clock), options, clock)

    def _pairs(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs; without a page only some seconds, in which nothing is touched."""
        begun_ns = self.clock.now_ns()
        pacing = Pacing()
        for item in super()._pairs():
            if not isinstance(item, Sample):
                yield item
                continue
            if self._zero_ns is None:
                self._zero_ns = time.monotonic_ns() - item.t_hard_ns
            yield item
            elapsed_s = (self.clock.now_ns() - begun_ns) / 1e9
            if self._options.page:
                pacing.wait_until(elapsed_s)
            elif elapsed_s > _NOBODY_S:
                self.notify("demo: nobody presses it: it is for the page of `palpate live demo:`")
                return

    @property
    def zero_ns(self) -> int | None:
        """Begin of the measurement on the clock of the computer, if a page presses."""
        return self._zero_ns if self._options.page else None

    def describe(self) -> Json:
        """Return the description of the driver, with the settings of the demo."""
        simulated: Json = {
            "scenario": "demo: pressed by hand, on the page",
            "seed": self._options.seed,
            "speed": "real time, on a virtual clock",
            "wiring": "guide",
        }
        return {**super().describe(), "simulated": simulated}


def open_demo(address: str, values: Mapping[str, object]) -> DemoSource:
    """Return the source of `demo:`."""
    options = DemoOptions.parse("demo", values)
    if address:
        raise ValueError(f"demo: got address {quoted(address)}, allowed: none")
    return DemoSource(options)
