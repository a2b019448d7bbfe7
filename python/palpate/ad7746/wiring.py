"""The sensor at each input, and mistakes of the wiring in words: which pin to look at, what to do.

Swapped inputs are not among them: both are connected. Only a press shows them (`palpate.flags`).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from palpate.ad7746 import registers
from palpate.ad7746.configuration import HARD, NAMES, SOFT, Channel, Configuration
from palpate.ad7746.converter import Converter
from palpate.samples import Status

# An input with less than this has no sensor. Open inputs of a real board should have some fF [?].
EMPTY_PF = 0.05
MOST_PF = 17.0  # Range that every chip has; most have more.
# Range of a typical chip: its CAPDAC, and the range of the converter.
LARGEST_PF = registers.DAC_STEPS * registers.DAC_STEP_PF + registers.FULL_SCALE_PF
# CAPDAC steps that are tried: two neighbours see a common value on every chip, whose steps are 0.13
# to 0.2 pF.
_STEPS = (0, 37, 74, 111, registers.DAC_STEPS)


class InputCapacitance(NamedTuple):
    """Capacitance of one input with one excitation pin, pF: inf, out of range; nan, not known."""

    pF: float
    shorted: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is no sensor."""
        return abs(self.pF) < EMPTY_PF

    @property
    def is_sensor(self) -> bool:
        """Whether there is a sensor, within the range."""
        return EMPTY_PF <= abs(self.pF) < math.inf

    def __str__(self) -> str:
        """Return the capacitance with its known digits."""
        if self.shorted:
            return "a short (EXCERR)"
        if math.isinf(self.pF):
            return f"more than {MOST_PF:g} pF"
        if abs(self.pF) >= registers.FULL_SCALE_PF:  # known to 20 %
            return f"about {self.pF:.1f} pF"
        return f"{self.pF:.3f} pF"


# (pin 1 or 2, excitation, differential) -> capacitance of CIN+, or of CIN+ minus CIN-.
MeasurePin = Callable[[int, str, bool], InputCapacitance]
# (input "1+" to "2-", excitation) -> its capacitance, as
# `palpate.ad7746.driver.Ad7746.measure_input`.
MeasureInput = Callable[[str, str], InputCapacitance]


def measure_input(measure_pin: MeasurePin, name: str, excitation: str) -> InputCapacitance:
    """Return the capacitance of an input, "1+" to "2-", with an excitation pin."""
    pin = int(name[0])
    plus = measure_pin(pin, excitation, False)
    if name[1] == "+" or plus.shorted:
        return plus
    difference = measure_pin(pin, excitation, True)
    return InputCapacitance(plus.pF - difference.pF, difference.shorted)


def measure_pin(
    converter: Converter, pin: int, excitation: str, differential: bool
) -> InputCapacitance:
    """Measure CIN+, or CIN+ minus CIN-, with an excitation pin, whatever the range in use."""
    own = converter.configuration
    sign = 1
    try:
        for steps in _STEPS:
            channel = Channel(capdac=sign * steps, excitation=excitation)
            converter.configuration = replace(
                own, capf=0, hard_input=pin, differential=differential, hard=channel
            )
            reading = converter.patiently(HARD)
            if reading.status & Status.EXCITATION:
                return InputCapacitance(math.nan, shorted=True)
            if not reading.status:
                capdac_pF = sign * steps * registers.DAC_STEP_PF
                return InputCapacitance(reading.capacitance + capdac_pF)
            sign = 1 if reading.capacitance > 0 else -1
    finally:
        converter.configuration = own
    return InputCapacitance(sign * math.inf)


_SOCKETS = {"1+": " (socket P4)", "1-": " (socket P3)", "A": " (socket P1)", "B": " (socket P2)"}
_DEMO = "the board's own length sensor, connected until R1 and R2 are removed"
_DEMO_PF = (0.9, 1.9)  # 1.4 pF by the schematic
_CONNECT = "remove them, and connect the bump to CIN2+ and EXCB"


class Mistake(NamedTuple):
    """One mistake."""

    found: str
    remedy: str
    fatal: bool = True

    def __str__(self) -> str:
        """Return both as one sentence."""
        return f"{self.found}: {self.remedy}"


def _place(name: str, kit: bool) -> str:
    """Return a pin, "1+" to "2-", "A" or "B", with its socket on the kit."""
    pin = f"EXC{name}" if name in "AB" else f"CIN{name}"
    if kit:
        pin += _SOCKETS.get(name, "")
    return pin


class _Bump:
    """One bump: its inputs, its own excitation, and what CIN+ measures with each excitation."""

    def __init__(
        self, number: int, measure: MeasureInput, configuration: Configuration, *, kit: bool
    ) -> None:
        pin = configuration.input(number)
        self.name = f"{NAMES[number]} bump"
        self.plus = f"{pin}+"
        self.minus = f"{pin}-"
        self.place = f"{self.name}: {_place(self.plus, kit)}"
        self.exchange = f"exchange its wires at CIN{self.plus} and CIN{self.minus}"
        self.own = configuration.channel(number).excitation
        self.driven = " and ".join(f"EXC{name}" for name in self.own)
        self.on = {name: measure(self.plus, name) for name in "AB"}
        self.levels = " and ".join(f"{level} on EXC{name}" for name, level in self.on.items())
        self.answers = any(self.on[name].is_sensor for name in self.own)
        self.at_demo = kit and pin == 2
        self.is_demo = self.at_demo and _DEMO_PF[0] < self.on["A"].pF < _DEMO_PF[1]
        self.no_socket = "; the board has no socket for CIN2+ (P6)" if self.at_demo else ""

    @property
    def best_excitation(self) -> str:
        """The own excitation, if the bump answers to it; else the other one; empty: to none."""
        answering = [name for name in "AB" if self.on[name].is_sensor]
        if self.is_demo:
            answering.remove("A")
        if set(answering) & set(self.own):
            return self.own
        return answering[0] if answering else ""


class Wiring:
    """The wiring, from the capacitances of the inputs."""

    def __init__(self, measure: MeasureInput, configuration: Configuration, *, kit: bool) -> None:
        self._measure = cache(measure)
        self._differential = configuration.differential
        self._kit = kit
        self._bumps = [
            _Bump(number, self._measure, configuration, kit=kit) for number in (HARD, SOFT)
        ]

    def mistakes(self) -> list[Mistake]:
        """Return all mistakes, those that prevent a measurement first."""
        levels = [level for bump in self._bumps for level in bump.on.values()]
        if any(math.isnan(level.pF) and not level.shorted for level in levels):
            return []  # the driver was interrupted
        shorts = list(self._shorts())
        if shorts:
            return shorts
        if not self._any_sensor():
            return [self._no_probe()]
        mistakes = [mistake for bump in self._bumps for mistake in self._mistakes_of(bump)]
        return sorted(mistakes, key=lambda mistake: not mistake.fatal)

    def _any_sensor(self) -> bool:
        for bump in self._bumps:
            for level in bump.on.values():
                if not level.is_empty or self._is_at_minus(bump):
                    return True
        return False

    def _shorts(self) -> Iterator[Mistake]:
        used = "AB"
        if all(bump.answers for bump in self._bumps):
            used = "".join(bump.own for bump in self._bumps)
        for name in sorted(set(used)):
            if any(bump.on[name].shorted for bump in self._bumps):
                pin = _place(name, self._kit)
                wire = f"EXC{name} to ground or to a shield, in the cable, the plug and the probe"
                yield Mistake(
                    f"{pin} is shorted or overloaded (the chip reports EXCERR)",
                    f"look for a short from {wire}",
                )

    def _mistakes_of(self, bump: _Bump) -> Iterator[Mistake]:
        for name in bump.own if bump.answers else "AB":
            if math.isinf(bump.on[name].pF):
                wires = f"CIN{bump.plus} and EXC{name}"
                causes = f"a short between {wires}, or a cable that is long or has no shield"
                large = f"a sensor above the range, some {LARGEST_PF:.0f} pF, needs a capacitor in series"
                yield Mistake(
                    f"{bump.place} has {bump.on[name]} on EXC{name}",
                    f"look for {causes}; {large}",
                )
                return
        if not bump.answers:
            yield self._no_answer(bump)
            return
        if all(level.is_sensor for level in bump.on.values()):
            yield self._both_excitations(bump)
        elif bump.at_demo and bump.on["A"].is_sensor:
            yield self._demo(bump)
        if self._differential:
            yield from self._exchanged(bump)

    def _exchanged(self, bump: _Bump) -> Iterator[Mistake]:
        """Yield a negative CIN+ minus CIN-: exchanged wires, or a large reference."""
        plus_pF = sum(self._measure(bump.plus, name).pF for name in bump.own)
        minus_pF = sum(self._measure(bump.minus, name).pF for name in bump.own)
        difference_pF = plus_pF - minus_pF
        if difference_pF < -EMPTY_PF:
            unless = f"unless the reference at CIN{bump.minus} is the larger one"
            yield Mistake(
                f"{bump.name}: CIN{bump.plus} minus CIN{bump.minus} is {difference_pF:.2f} pF",
                f"{bump.exchange}, {unless}",
                fatal=False,
            )

    def _both_excitations(self, bump: _Bump) -> Mistake:
        """Return the mistake of a bump that answers to both excitation pins."""
        found = f"{bump.place} has {bump.levels}"
        if not bump.at_demo:
            remedy = f"pull off what is not the bump; measured is {bump.driven}"
            return Mistake(found, remedy, fatal=False)
        found += f", {_DEMO}"
        if bump.own == "B":
            remedy = "remove them; the measurement on EXCB goes on"
            return Mistake(found, remedy, fatal=False)
        only_demo = bump.own == "A" and bump.is_demo
        option = self._option("B", bump)
        remedy = "remove them"
        if option:
            remedy += f", and use {option}" if only_demo else f", or use {option}"
        return Mistake(found, remedy, fatal=only_demo)

    def _demo(self, bump: _Bump) -> Mistake:
        """Return the doubt about a bump on EXCA, which also drives the board's own sensor."""
        remedy = "remove them; the readings cannot show whether they are there"
        if bump.is_demo:  # a small bump may be as large: it is measured
            level = bump.on["A"]
            remedy += f". {level} is as much as they alone give: the bump may not be connected"
        return Mistake(f"{bump.name}: EXCA also drives {_DEMO}", remedy, fatal=False)

    def _no_answer(self, bump: _Bump) -> Mistake:
        """Return why a bump does not answer to its excitation."""
        found = f"{bump.place} has {bump.on[bump.own[0]]} on {bump.driven}"
        for name in "AB".replace(bump.own, ""):
            if bump.on[name].is_sensor:
                remedy = self._use_other(name, bump)
                return Mistake(f"{found}, {bump.on[name]} on EXC{name}", remedy)
        if self._is_at_minus(bump):
            remedy = bump.exchange if self._differential else f"move it to CIN{bump.plus}"
            return Mistake(f"{found}, its wire is at {_place(bump.minus, self._kit)}", remedy)
        wires = f"one to CIN{bump.plus}, the other to EXC{bump.own[0]}{bump.no_socket}"
        return Mistake(
            f"{bump.place} has {bump.levels}, nothing is connected", f"look at its wires, {wires}"
        )

    def _use_other(self, name: str, bump: _Bump) -> str:
        """Return what to do about a bump that answers to another excitation pin."""
        if bump.is_demo and name == "A":
            return f"it is as large as {_DEMO}: {_CONNECT}"
        remedy = f"move its wire from EXC{name} to {bump.driven}"
        option = self._option(name, bump)
        if option:
            remedy = f"use {option}, or {remedy}"
        if bump.at_demo and name == "A":
            remedy += f". It may be {_DEMO}: then {_CONNECT}"
        return remedy

    def _no_probe(self) -> Mistake:
        by_input = sorted(self._bumps, key=lambda bump: bump.plus)
        levels = [f"{_place(bump.plus, self._kit)} has {bump.levels}" for bump in by_input]
        wires = [f"the {bump.name} to CIN{bump.plus} and EXC{bump.own[0]}" for bump in self._bumps]
        return Mistake(
            f"no probe is connected: {', '.join(levels)}",
            f"wire {', '.join(wires)}{by_input[1].no_socket}",
        )

    def _is_at_minus(self, bump: _Bump) -> bool:
        return any(self._measure(bump.minus, name).is_sensor for name in "AB")

    def _option(self, name: str, bump: _Bump) -> str:
        """Return the option that puts this bump on another pin; empty: the other has no pin."""
        pins = [name if each is bump else each.best_excitation for each in self._bumps]
        if not all(pins):
            return ""
        value = pins[0] if pins[0] == pins[1] else ",".join(pins)
        return f"excitation={value} (as in usb:?excitation={value})"
