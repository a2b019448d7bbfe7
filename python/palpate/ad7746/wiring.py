"""What is connected to each input, and mistakes of the wiring in words: which pin to look at, what to do.

Swapped inputs are not among them: both are connected. Only a press shows them (`palpate.flags`).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from palpate.ad7746 import registers
from palpate.ad7746.configuration import HARD, NAMES, SATURATION, SOFT, Channel, Configuration
from palpate.ad7746.converter import Converter
from palpate.samples import Sample, Status

# An input with less than this has no sensor. Open inputs of a real board are expected to have some fF [?].
EMPTY_PF = 0.05
MOST_PF = 17.0  # Range that every chip has; most have more.
# CAPDAC steps that are tried: two neighbours see a common value on every chip, whose steps are 0.13 to 0.2 pF.
_STEPS = (0, 37, 74, 111, registers.DAC_STEPS)


class Look(NamedTuple):
    """What one input has on one excitation pin."""

    capacitance: float
    shorted: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is no sensor."""
        return abs(self.capacitance) < EMPTY_PF

    @property
    def is_sensor(self) -> bool:
        """Whether there is one, within the range."""
        return EMPTY_PF <= abs(self.capacitance) < math.inf

    def __str__(self) -> str:
        """Return the capacitance with the digits that are known."""
        if self.shorted:
            return "a short (EXCERR)"
        if math.isinf(self.capacitance):
            return f"more than {MOST_PF:g} pF"
        size = abs(self.capacitance)
        return (
            f"about {self.capacitance:.1f} pF"
            if size >= registers.FULL_SCALE_PF
            else f"{self.capacitance:.3f} pF"
        )


Looking = Callable[
    [str, str], Look
]  # (input, excitation) -> `Look`, as `palpate.ad7746.driver.Ad7746.look`.


def look(measure: Callable[[int, str, bool], Look], name: str, excitation: str) -> Look:
    """Return what an input, "1+" to "2-", has; `measure(pin, excitation, differential)`: CIN+, or CIN+ minus CIN-."""
    plus = measure(int(name[0]), excitation, False)
    if name[1] == "+" or plus.shorted:
        return plus
    both = measure(int(name[0]), excitation, True)
    return Look(plus.capacitance - both.capacitance, both.shorted)


def level_of(converter: Converter, pin: int, excitation: str, differential: bool) -> Look:
    """Measure what CIN+, or CIN+ minus CIN-, has on an excitation pin, whatever the range in use."""
    own = converter.configuration
    sign = 1
    try:
        for steps in _STEPS:
            there = Channel(capdac=sign * steps, excitation=excitation)
            converter.configuration = replace(
                own, capf=0, hard_input=pin, differential=differential, hard=there
            )
            reading = converter.patiently(HARD)
            if reading.status & Status.EXCITATION:
                return Look(math.nan, shorted=True)
            if not reading.status:
                return Look(reading.capacitance + sign * steps * registers.DAC_STEP_PF)
            sign = 1 if reading.capacitance > 0 else -1
    finally:
        converter.configuration = own
    return Look(sign * math.inf)


_SOCKETS = {"1+": " (socket P4)", "1-": " (socket P3)", "A": " (socket P1)", "B": " (socket P2)"}
_DEMO = "the board's own length sensor, connected until R1 and R2 are removed"
_DEMO_PF = (0.9, 1.9)  # 1.4 pF by the schematic


class Mistake(NamedTuple):
    """One mistake."""

    what: str
    remedy: str
    fatal: bool = True

    def __str__(self) -> str:
        """Return both as one sentence."""
        return f"{self.what}: {self.remedy}"


def _at(name: str, kit: bool) -> str:
    """Return a pin, "1+" to "2-", "A" or "B", with its socket on the kit."""
    pin = f"EXC{name}" if name in "AB" else f"CIN{name}"
    return pin + (_SOCKETS.get(name, "") if kit else "")


class _Bump:
    """One bump: its inputs, its own excitation, and what CIN+ has on each excitation."""

    def __init__(
        self, number: int, look: Looking, configuration: Configuration, *, kit: bool
    ) -> None:
        pin = configuration.input(number)
        self.name = f"{NAMES[number]} bump"
        self.plus, self.minus = f"{pin}+", f"{pin}-"
        self.at = f"{self.name}: {_at(self.plus, kit)}"
        self.exchange = f"exchange its wires at CIN{self.plus} and CIN{self.minus}"
        self.own = configuration.channel(number).excitation
        self.driven = " and ".join(f"EXC{name}" for name in self.own)
        self.on = {name: look(self.plus, name) for name in "AB"}
        self.levels = " and ".join(f"{found} on EXC{name}" for name, found in self.on.items())
        self.answers = any(self.on[name].is_sensor for name in self.own)
        self.beside_demo = kit and pin == 2
        self.is_demo = self.beside_demo and _DEMO_PF[0] < self.on["A"].capacitance < _DEMO_PF[1]
        self.no_socket = "; the board has no socket for CIN2+ (P6)" if self.beside_demo else ""

    @property
    def place(self) -> str:
        """The excitation to use: the own one, if the bump answers to it; else the other one; "": it answers to none."""
        found = [
            name for name in "AB" if self.on[name].is_sensor and not (name == "A" and self.is_demo)
        ]
        return self.own if set(found) & set(self.own) else "".join(found[:1])


class Wiring:
    """The wiring that looks at the inputs show."""

    def __init__(self, look: Looking, configuration: Configuration, *, kit: bool) -> None:
        self._look = cache(look)
        self._differential = configuration.differential
        self._kit = kit
        self._bumps = [_Bump(number, self._look, configuration, kit=kit) for number in (HARD, SOFT)]

    def mistakes(self) -> list[Mistake]:
        """Return all mistakes, those that prevent a measurement first."""
        found = [found for bump in self._bumps for found in bump.on.values()]
        if any(
            math.isnan(each.capacitance) and not each.shorted for each in found
        ):  # the driver was interrupted
            return []
        if shorts := list(self._shorts()):
            return shorts
        if not any(
            not each.is_empty or self._at_minus(bump)
            for bump in self._bumps
            for each in bump.on.values()
        ):
            return [self._nothing()]
        mistakes = [mistake for bump in self._bumps for mistake in self._of(bump)]
        return sorted(mistakes, key=lambda mistake: not mistake.fatal)

    def _shorts(self) -> Iterator[Mistake]:
        used = (
            "".join(bump.own for bump in self._bumps)
            if all(bump.answers for bump in self._bumps)
            else "AB"
        )
        for name in sorted(set(used)):
            if any(bump.on[name].shorted for bump in self._bumps):
                what = f"{_at(name, self._kit)} is shorted or overloaded (the chip reports EXCERR)"
                where = f"EXC{name} to ground or to a shield, in the cable, the plug and the probe"
                yield Mistake(what, f"look for a short from {where}")

    def _of(self, bump: _Bump) -> Iterator[Mistake]:
        for name in bump.own if bump.answers else "AB":
            if math.isinf(bump.on[name].capacitance):
                wires = f"CIN{bump.plus} and EXC{name}, or a cable that is long or has no shield"
                yield Mistake(
                    f"{bump.at} has {bump.on[name]} on EXC{name}",
                    f"look for a short between {wires}",
                )
                return
        if not bump.answers:
            yield self._flat(bump)
            return
        yield from self._besides(bump)
        if self._differential:
            yield from self._exchanged(bump)

    def _exchanged(self, bump: _Bump) -> Iterator[Mistake]:
        """Return that CIN+ minus CIN- is negative: of the wires, or of a reference that is larger than the bump."""
        plus, minus = (
            sum(self._look(pin, name).capacitance for name in bump.own)
            for pin in (bump.plus, bump.minus)
        )
        if plus - minus < -EMPTY_PF:
            what = f"{bump.name}: CIN{bump.plus} minus CIN{bump.minus} is {plus - minus:.2f} pF"
            unless = f"unless the reference at CIN{bump.minus} is the larger one"
            yield Mistake(what, f"{bump.exchange}, {unless}", fatal=False)

    def _besides(self, bump: _Bump) -> Iterator[Mistake]:
        """Return what is connected beside the bump: it does not prevent a measurement."""
        if all(found.is_sensor for found in bump.on.values()):
            what, only_demo = f"{bump.at} has {bump.levels}", bump.own == "A" and bump.is_demo
            remedy = "remove them; the measurement on EXCB goes on"
            if not bump.beside_demo:
                yield Mistake(
                    what, f"pull off what is not the bump; measured is {bump.driven}", fatal=False
                )
                return
            if bump.own != "B":
                remedy = f"remove them{self._option('B', bump, ', and use {}' if only_demo else ', or use {}')}"
            yield Mistake(f"{what}, {_DEMO}", remedy, fatal=only_demo)
        elif bump.beside_demo and bump.on["A"].is_sensor:
            remedy = "remove them; the readings cannot show whether they are there"
            if bump.is_demo:  # a small bump may be as large: it is measured
                remedy += (
                    f". {bump.on['A']} is as much as they alone give: the bump may not be connected"
                )
            yield Mistake(f"{bump.name}: EXCA also drives {_DEMO}", remedy, fatal=False)

    def _flat(self, bump: _Bump) -> Mistake:
        """Return why a bump does not answer to its excitation."""
        here = f"{bump.at} has {bump.on[bump.own[0]]} on {bump.driven}"
        for name in "AB".replace(bump.own, ""):
            if bump.on[name].is_sensor:
                return Mistake(f"{here}, {bump.on[name]} on EXC{name}", self._to(name, bump))
        if self._at_minus(bump):
            remedy = bump.exchange if self._differential else f"move it to CIN{bump.plus}"
            return Mistake(f"{here}, its wire is at {_at(bump.minus, self._kit)}", remedy)
        wires = f"one to CIN{bump.plus}, the other to EXC{bump.own[0]}{bump.no_socket}"
        return Mistake(
            f"{bump.at} has {bump.levels}, nothing is connected", f"look at its wires, {wires}"
        )

    def _to(self, name: str, bump: _Bump) -> str:
        """Return what to do about a bump that answers to another pin."""
        if bump.is_demo and name == "A":
            return f"it is as large as {_DEMO}: remove them, and connect the bump to CIN2+ and EXCB"
        remedy = (
            self._option(name, bump, "use {}, or ")
            + f"move its wire from EXC{name} to {bump.driven}"
        )
        if bump.beside_demo and name == "A":
            remedy += (
                f". It may be {_DEMO}: then remove them, and connect the bump to CIN2+ and EXCB"
            )
        return remedy

    def _nothing(self) -> Mistake:
        by_input = sorted(self._bumps, key=lambda bump: bump.plus)
        levels = ", ".join(f"{_at(bump.plus, self._kit)} has {bump.levels}" for bump in by_input)
        wires = ", ".join(
            f"the {bump.name} to CIN{bump.plus} and EXC{bump.own[0]}" for bump in self._bumps
        )
        return Mistake(f"no probe is connected: {levels}", f"wire {wires}{by_input[1].no_socket}")

    def _at_minus(self, bump: _Bump) -> bool:
        return any(self._look(bump.minus, name).is_sensor for name in "AB")

    def _option(self, name: str, bump: _Bump, words: str) -> str:
        """Return, in words, the option that puts this bump on another pin; "": the other bump answers to none."""
        pins = [name if each is bump else each.place for each in self._bumps]
        value = pins[0] if pins[0] == pins[1] else ",".join(pins)
        return (
            words.format(f"excitation={value} (as in usb:?excitation={value})") if all(pins) else ""
        )


CONFIRM_S = 1.0  # Suspicious readings for this long are looked into.
_AGAIN_S = 5.0  # to the next look after one that found nothing
_BACK_S = 0.5
_FALLEN = 0.7  # share of the idle capacitance that is missing; it is known to 20 %
_SAME_CODES = 8  # the noise is above 8 codes rms at every speed: two are rarely the same


class WiringWatch:
    """Follows a channel: its wire comes off, its excitation is shorted, or the converter stops measuring; `text`: what is now."""

    # A reading only raises the suspicion: with a CAPDAC in use, an open input is saturated, or far below its idle value.
    # A look at the input itself decides, so that a deep press or a range that moved is never taken for it.

    def __init__(self, number: int, look: Looking) -> None:
        self.text = ""
        self._number, self._look = number, look
        self._suspicion = self._confirmed = ""
        self._since_ns = 0  # begin of the present suspicion
        self._code, self._same = -1, 0

    def take(self, sample: Sample, configuration: Configuration) -> str:
        """Return what has changed with this sample, which is not lost; empty: nothing."""
        before, self._suspicion = self._suspicion, self._suspect(sample, configuration)
        if self._suspicion != before:
            self._since_ns = sample.t_hard_ns
        lasting_s = (sample.t_hard_ns - self._since_ns) / 1e9
        if self._suspicion == self._confirmed or lasting_s < (
            CONFIRM_S if self._suspicion else _BACK_S
        ):
            return ""
        if not self._suspicion:
            self._confirmed = self.text = ""
            return f"{NAMES[self._number]} bump: it is measured again"
        self._since_ns = sample.t_hard_ns + round((_AGAIN_S - CONFIRM_S) * 1e9)
        if text := self._confirm(configuration):
            self._confirmed, self.text = self._suspicion, f"{NAMES[self._number]} bump: {text}"
        return self.text if text else ""

    def _suspect(self, sample: Sample, configuration: Configuration) -> str:
        value, code = ((sample.hard, sample.hard_raw), (sample.soft, sample.soft_raw))[self._number]
        self._same = self._same + 1 if code == self._code else 0
        self._code = code
        steps = configuration.channel(self._number).capdac
        below = -value if steps < 0 else value
        saturated = bool(sample.status & SATURATION[self._number])
        if sample.status & Status.EXCITATION:
            return "short"
        if below < EMPTY_PF - _FALLEN * abs(steps) * registers.DAC_STEP_PF or (
            saturated and below < 0
        ):
            return "flat"
        return "same" if self._same >= _SAME_CODES and not saturated else ""

    def _confirm(self, configuration: Configuration) -> str:
        if self._suspicion == "same":
            return "every reading is the same: the converter does not measure; replug the board"
        plus, pins = (
            f"{configuration.input(self._number)}+",
            configuration.channel(self._number).excitation,
        )
        looks = {f"EXC{name}": self._look(plus, name) for name in pins}
        if self._suspicion == "short":
            shorted = " and ".join(name for name, found in looks.items() if found.shorted)
            return (
                shorted
                and f"{shorted} is shorted or overloaded (EXCERR): look at its wire, its plug and the probe"
            )
        if not all(found.is_empty for found in looks.values()):
            return ""
        levels = " and ".join(f"{found} on {name}" for name, found in looks.items())
        return f"CIN{plus} has {levels}: its wire is off: look at CIN{plus} and EXC{pins[0]}"
