"""A simulated board as a source: a scenario as its input, read by the real driver."""

import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from threading import Event
from typing import Any, NamedTuple

from palpate.ad7746.bus import RealClock, VirtualClock
from palpate.ad7746.evalkit.usb_bus import EvalKit
from palpate.ad7746.simulator.chip import WIRINGS
from palpate.ad7746.simulator.evalboard import BUS_KHZ, Fault, FaultKind
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.clocks import Pause
from palpate.elasticity import SORBOTHANE_MPA
from palpate.files import Json
from palpate.messages import quoted, unlike
from palpate.samples import Sample
from palpate.simulation.board_input import board_scenarios, limit_ns, simulated_input
from palpate.simulation.hand import SESSIONS, Hand
from palpate.simulation.press import Press
from palpate.simulation.probe import Scenario, TrueCapacitance
from palpate.simulation.scenarios import PROBE
from palpate.simulation.signals import random_of
from palpate.source_events import SourceEvent
from palpate.sources.board import BoardSource, ConverterOptions
from palpate.sources.options import choice, number, option, whole_number, yes_no
from palpate.sources.simulated_hand import SimulatedHand, Truth

DEFAULT = "four-specimens"
_LONGEST_S = 1e8  # of a fault of the computer: three years
_BEHIND_S = 0.1  # a paced simulation makes up for this at most
_ASKED_BEFORE_S = 0.1  # a hand asks what is next at this time before it touches it
_RESTS_S = 1.5  # after its last touch a hand waits for what is wanted: the baseline takes a second
_NAMES = {PROBE.ratio(modulus): name for name, modulus in SORBOTHANE_MPA.items()}
_FAULT = re.compile(r"(?P<kind>[^:@]+)(?::(?P<amount>[^@]+))?@(?P<time>.+)")


class TimeFaultKind(StrEnum):
    """What happens to the computer, and to its clocks; the amount is in seconds."""

    SLEEP = "sleep"
    STOP = "stop"  # of the program
    CLOCK_SET = "clock set"


@dataclass
class TimeFault:
    """A simulated fault of the computer: its kind and amount, s."""

    kind: TimeFaultKind
    amount: float


class TimeFaults:
    """The faults of the computer so far, as its clocks would show them.

    Attributes
    ----------
    paused_s : float
        How long the computer has slept or stood still.
    """

    def __init__(self) -> None:
        self.paused_s = 0.0
        self._pause = Pause()  # since the sample before

    def begin(self, fault: TimeFault) -> None:
        """Let the computer have a fault."""
        pause = self._pause
        match fault.kind:
            case TimeFaultKind.SLEEP:
                self._pause = pause._replace(slept_s=pause.slept_s + fault.amount)
                self.paused_s += fault.amount
            case TimeFaultKind.STOP:
                self._pause = pause._replace(stood_s=pause.stood_s + fault.amount)
                self.paused_s += fault.amount
            case TimeFaultKind.CLOCK_SET:
                self._pause = pause._replace(set_s=pause.set_s + fault.amount)

    def passed(self) -> Pause:
        """Return what happened since the last call."""
        pause = self._pause
        self._pause = Pause()
        return pause


class Incident(NamedTuple):
    """A fault of the board or of the computer, and its time, s after the start."""

    time_s: float
    fault: Fault | TimeFault


def parse_faults(name: str, value: Any) -> tuple[Incident, ...]:
    """Parse faults, KIND[:AMOUNT]@SECONDS, separated by commas; a dash is a blank of a kind."""
    kinds: dict[str, FaultKind | TimeFaultKind] = {}
    for kind in (*FaultKind, *TimeFaultKind):
        kinds[_simplified(kind)] = kind
    incidents = []
    for text in _simplified(str(value)).split(","):
        match = _FAULT.fullmatch(text)
        if not match or match["kind"] not in kinds:
            allowed = f"KIND[:AMOUNT]@SECONDS, KIND one of {', '.join(kinds)}"
            raise ValueError(f"{name}: got {quoted(text)}, allowed: {allowed}")
        fault = _fault(name, kinds[match["kind"]], match["amount"] or "1")
        incidents.append(Incident(number(0)(f"{name}'s time", match["time"]), fault))
    return tuple(sorted(incidents, key=lambda incident: incident.time_s))


def _fault(name: str, kind: FaultKind | TimeFaultKind, amount: str) -> Fault | TimeFault:
    """Return a fault with its amount checked."""
    if isinstance(kind, TimeFaultKind):
        least_s = -_LONGEST_S if kind == TimeFaultKind.CLOCK_SET else 0.0
        return TimeFault(kind, number(least_s, _LONGEST_S)(f"{name}'s amount of {kind}, s", amount))
    try:
        return Fault(kind, float(amount))
    except ValueError:
        raise ValueError(
            f"{name}: got amount {quoted(amount)}, allowed: a number, or inf"
        ) from None


def _simplified(kind: str) -> str:
    return kind.lower().replace("#", "").replace(" ", "-")


@dataclass(frozen=True)
class SimOptions(ConverterOptions):
    """Options of `sim:`."""

    seed: int = option(whole_number(0, 2**63), 0)
    """The same seed gives the same readings."""
    speed: float | None = option(number(0, 1000, above=True), None)
    """Speed relative to real time: 1 is real time. Default: as fast as possible."""
    bus_kHz: float = option(number(10, 400), BUS_KHZ)
    """Clock of the I2C bus, kHz."""
    fault: tuple[Incident, ...] = option(parse_faults, ())
    """Faults of the board or of the computer, separated by commas: the kind, its amount (default 1)
    and its time, s after the start."""
    wiring: str = option(choice(*WIRINGS), "guide")
    """The wiring: that of the guide, or a mistake."""
    idle: float = option(number(0, 86400), 0.0)
    """Time at rest before the scenario begins, s."""
    paced: bool = option(yes_no, False)
    """Real time on a virtual clock, which no load of the computer disturbs."""


class Pacing:
    """Lets the time of a virtual clock pass in real time; a computer that was late catches up."""

    def __init__(self) -> None:
        self._begun_s = time.monotonic()

    def wait_until(self, elapsed_s: float) -> None:
        """Wait until this time since the begin, s, has passed."""
        wait_s = self._begun_s + elapsed_s - time.monotonic()
        self._begun_s += max(-wait_s - _BEHIND_S, 0)
        time.sleep(max(wait_s, 0))


class SimSource(BoardSource):
    """The pairs of a simulated scenario, until its end."""

    def __init__(self, name: str, options: SimOptions) -> None:
        scenario = board_scenarios()[name]
        if options.capf is None:
            options = replace(options, capf=scenario.converter.capf)
        speed = options.speed
        self.live = speed is not None
        self.real_time = speed == 1
        self.clock: RealClock | VirtualClock = RealClock(speed) if speed else VirtualClock()
        self._time_faults = TimeFaults()
        if any(isinstance(incident.fault, TimeFault) for incident in options.fault):
            self.clocks = self._time_faults
        simulated = simulated_input(
            scenario,
            self.clock,
            options.seed,
            WIRINGS[options.wiring],
            bus_kHz=options.bus_kHz,
            idle_s=options.idle,
            paused_s=lambda: self._time_faults.paused_s,
        )
        self.kit = simulated.board
        self.hand: ScenarioHand = ScenarioHand(
            scenario, options.idle, simulated.truth, seed=options.seed, can_follow=name in SESSIONS
        )
        self._name = name
        self._options = options
        self._incidents = list(options.fault)
        self._begun_ns = self.clock.now_ns()
        self._stopped = Event()
        self._waited_ns = 0
        backend = SimulatedUsb(self.clock)
        backend.plug(self.kit)
        super().__init__(
            EvalKit(backend=backend, clock=self.clock),
            options,
            self.clock,
            limit_ns=limit_ns(speed),
        )

    def _pairs(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs until the scenario ends; after each pair inject the faults that are due."""
        self._wait()
        if self._stopped.is_set():
            return
        pacing = Pacing()
        for item in super()._pairs():
            yield item
            if not isinstance(item, Sample):
                continue
            now = self.clock.now_ns()
            elapsed_s = (now - self._begun_ns) / 1e9 - self._time_faults.paused_s
            if self._options.paced:
                pacing.wait_until(elapsed_s)
            while self._incidents and elapsed_s >= self._incidents[0].time_s:
                self._begin_fault(self._incidents.pop(0).fault)
            if self.hand.is_over(elapsed_s):
                return

    def _wait(self) -> None:
        """Wait for the begin, if the hand waits; the clock of the simulation stands still."""
        if self.hand.is_waiting:
            waited_s = self.hand.wait(self._stopped)
            self._waited_ns = round(waited_s * 1e9)
            self.clock.skip(-waited_s * (self._options.speed or 1))

    @property
    def zero_ns(self) -> int | None:
        """Begin of the measurement on the clock of the computer."""
        zero_ns = super().zero_ns
        return None if zero_ns is None else zero_ns + self._waited_ns

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped.set()
        super().interrupt()

    def _begin_fault(self, fault: Fault | TimeFault) -> None:
        """Let the board fail at its next request, or the computer now."""
        if isinstance(fault, Fault):
            self.kit.faults.append(fault)
            return
        paused_before_s = self._time_faults.paused_s
        self._time_faults.begin(fault)
        self.clock.skip(self._time_faults.paused_s - paused_before_s)

    def describe(self) -> Json:
        """Return the description of the driver, with the settings of the simulation."""
        speed: float | str = "as fast as possible"
        if self._options.speed:
            speed = self._options.speed
        elif self._options.paced:
            speed = "real time, on a virtual clock"
        simulated: Json = {
            "scenario": self._name,
            "seed": self._options.seed,
            "speed": speed,
            "wiring": self._options.wiring,
        }
        if self._options.idle:
            simulated["idle_s"] = self._options.idle
        return {**super().describe(), "simulated": simulated}


class ScenarioHand(SimulatedHand):
    """The hand of a scenario: it presses at its times.

    If something says what to touch next, it does that: each press is on the wanted object, and
    after the last one it goes on as long as something is wanted.
    """

    def __init__(
        self,
        scenario: Scenario,
        idle_s: float,
        truth: TrueCapacitance,
        *,
        seed: int,
        can_follow: bool,
    ) -> None:
        super().__init__(_truths(scenario, idle_s))
        self._capacitance = truth
        self._idle_s = idle_s
        self._can_follow = can_follow
        self._random = random_of(seed, "wanted touches")
        self._next = 0  # number of the press that begins next
        self._end_s = idle_s + scenario.duration_s

    def is_over(self, elapsed_s: float) -> bool:
        """Return whether the scenario has ended at this time, s; before a press ask what is next."""
        end_s = self._end_s
        if self._can_follow and self._wanted is not None:
            self._ask(elapsed_s - self._idle_s)
            last = self._capacitance.presses[-1]
            end_s = max(end_s, self._idle_s + last.stop_s + _RESTS_S)
        return elapsed_s > end_s

    def _ask(self, time_s: float) -> None:
        """Ask what to touch next if a press begins, or if the last one has ended."""
        presses = self._capacitance.presses
        if self._next < len(presses):
            start_s = presses[self._next].start_s
            if time_s >= start_s - _ASKED_BEFORE_S:
                self._take(start_s)
        elif time_s >= presses[-1].stop_s + _RESTS_S:
            self._take(time_s + _ASKED_BEFORE_S)

    def _take(self, start_s: float) -> None:
        """Let the press that begins at this time be on the wanted object, if there is one."""
        wanted = self._wanted() if self._wanted is not None else None
        modulus = None
        if wanted is not None:
            modulus = SORBOTHANE_MPA.get(wanted.name, wanted.modulus_MPa)
        number = self._next
        presses = self._capacitance.presses
        if wanted is None or modulus is None:
            self._next += number < len(presses)
            return
        if number < len(presses) and presses[number].name == wanted.name:
            self._next += 1
            return
        [press] = Hand().touches(PROBE.ratio(modulus), 1, self._random).presses
        press = replace(press, start_s=start_s, name=wanted.name)
        self._capacitance.presses = [*presses[:number], press, *presses[number + 1 :]]
        [truth] = _truths_of([press], self._idle_s)
        self.truths[:] = [*self.truths[:number], truth, *self.truths[number + 1 :]]
        self._next += 1


def _truths(scenario: Scenario, idle_s: float) -> list[Truth]:
    """Return the presses of a scenario on objects with one ratio."""
    return _truths_of(scenario.presses, idle_s)


def _truths_of(presses: Sequence[Press], idle_s: float) -> list[Truth]:
    """Return the presses on objects with one ratio."""
    truths = []
    for press in presses:
        _, ratio = press.ratios[0]
        if all(other == ratio for _, other in press.ratios):
            name = press.name or _NAMES.get(ratio, "")
            truths.append(Truth(idle_s + press.start_s, ratio, name))
    return truths


def open_sim(address: str, values: Mapping[str, object]) -> SimSource:
    """Return the source of `sim:SCENARIO`."""
    options = SimOptions.parse("sim", values)
    name = address or DEFAULT
    if name not in board_scenarios():
        raise ValueError(f"sim: {unlike(name, list(board_scenarios()), 'scenario')}")
    return SimSource(name, options)
