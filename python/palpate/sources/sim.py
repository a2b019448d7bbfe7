"""A simulated board as a source: a scenario as its input, read by the real driver."""

import re
import time
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from palpate.ad7746.bus import Clock, RealClock, VirtualClock
from palpate.ad7746.evalkit.usb_bus import EvalKit
from palpate.ad7746.simulator.chip import WIRINGS
from palpate.ad7746.simulator.evalboard import BUS_KHZ, Fault, FaultKind, SimulatedBoard
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.elasticity import SORBOTHANE_MPA
from palpate.messages import quoted, unlike
from palpate.samples import Sample
from palpate.simulation.board_input import board_scenarios, limit_ns, simulated_board
from palpate.simulation.scenarios import PROBE
from palpate.source_events import SourceEvent
from palpate.sources.board import CONVERTER, BoardSource
from palpate.sources.options import Check, checked, choice, number, yes_no

DEFAULT = "four-specimens"
_BEHIND_S = 0.1  # a paced simulation makes up for this at most
_NAMES = {PROBE.ratio(modulus): name for name, modulus in SORBOTHANE_MPA.items()}
_SPEEDS = "as fast as possible", "real time, on a virtual clock"
_FAULT = re.compile(r"(?P<kind>[^:@]+)(?::(?P<amount>[^@]+))?@(?P<time>.+)")


class Incident(NamedTuple):
    """A fault and its time, s after the start."""

    time_s: float
    fault: Fault


class Truth(NamedTuple):
    """A simulated press on an object with one ratio: its begin, s, the ratio, the name of the object or ""."""

    start_s: float
    ratio: float
    name: str


class SimSource(BoardSource):
    """The pairs of a simulated scenario, until its end; `paced`: in real time on a virtual clock, which no computer disturbs."""

    def __init__(self, name: str, options: Mapping[str, Any]) -> None:
        scenario = board_scenarios()[name]
        speed = options.get("speed")
        seed = options.get("seed", 0)
        wiring = options.get("wiring", "guide")
        self.live: bool = speed is not None
        self.real_time: bool = speed == 1
        self.clock: Clock = RealClock(speed) if speed else VirtualClock()
        self._paced: bool = options.get("paced", False)
        idle_s = options.get("idle", 0.0)
        self.truths: list[Truth] = [
            Truth(idle_s + press.start_s, press.ratios[0][1], _NAMES.get(press.ratios[0][1], ""))
            for press in scenario.presses
            if len({ratio for _, ratio in press.ratios}) == 1
        ]
        bus_kHz = options.get("bus_kHz", BUS_KHZ)
        self.kit: SimulatedBoard = simulated_board(
            scenario, self.clock, seed, WIRINGS[wiring], bus_kHz=bus_kHz, idle_s=idle_s
        )
        self._incidents = sorted(options.get("fault", []), key=lambda incident: incident.time_s)
        self._begun_ns = self.clock.now_ns()
        self._end_ns = self._begun_ns + round((idle_s + scenario.duration_s) * 1e9)
        self._simulated = {"scenario": name, "seed": seed, "speed": speed or _SPEEDS[self._paced]}
        self._simulated |= {"wiring": wiring, **({"idle_s": idle_s} if idle_s else {})}
        backend = SimulatedUsb(self.clock)
        backend.plug(self.kit)
        given = {"capf": scenario.converter.capf, "limit_ns": limit_ns(speed), **options}
        super().__init__(EvalKit(backend=backend, clock=self.clock), given, self.clock)

    def _pairs(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs until the scenario ends; after each pair inject the faults that are due."""
        begun_s = time.monotonic()
        for item in super()._pairs():
            yield item
            if not isinstance(item, Sample):
                continue
            now = self.clock.now_ns()
            if self._paced:
                wait_s = begun_s + (now - self._begun_ns) / 1e9 - time.monotonic()
                begun_s += max(-wait_s - _BEHIND_S, 0)
                time.sleep(max(wait_s, 0))
            while self._incidents and now - self._begun_ns >= self._incidents[0].time_s * 1e9:
                self.kit.faults.append(self._incidents.pop(0).fault)
            if now >= self._end_ns:
                return

    def describe(self) -> dict[str, Any]:
        """Return the description of the driver, with the settings of the simulation."""
        return {**super().describe(), "simulated": self._simulated}


def faults(name: str, value: Any) -> list[Incident]:
    """Parse faults, KIND[:AMOUNT]@SECONDS, separated by commas; a blank in a kind may be a dash."""
    kinds = {_plain(kind): kind for kind in FaultKind}
    found = list[Incident]()
    for text in _plain(str(value)).split(","):
        match = _FAULT.fullmatch(text)
        if not match or match["kind"] not in kinds:
            allowed = f"KIND[:AMOUNT]@SECONDS, KIND one of {', '.join(kinds)}"
            raise ValueError(f"{name}: got {quoted(text)}, allowed: {allowed}")
        try:
            amount = float(match["amount"] or 1.0)
        except ValueError:
            raise ValueError(
                f"{name}: got amount {quoted(match['amount'])}, allowed: a number, or inf"
            ) from None
        time_s = number(0)(f"{name}'s time", match["time"])
        found.append(Incident(time_s, Fault(kinds[match["kind"]], amount)))
    return found


def _plain(kind: str) -> str:
    return kind.lower().replace("#", "").replace(" ", "-")


_SIMULATED: dict[str, Check] = {
    "seed": number(0, 2**63, whole=True),
    "speed": number(0, 1000, above=True),
    "bus_kHz": number(10, 400),
    "fault": faults,
    "wiring": choice(*WIRINGS),
    "idle": number(0, 86400),
    "paced": yes_no,
}


def open_sim(address: str, options: Mapping[str, Any]) -> SimSource:
    """Return the source of `sim:SCENARIO`."""
    given = checked("sim", options, {**CONVERTER, **_SIMULATED})
    name = address or DEFAULT
    if name not in board_scenarios():
        raise ValueError(f"sim: {unlike(name, list(board_scenarios()), 'scenario')}")
    return SimSource(name, given)
