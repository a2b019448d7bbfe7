"""Mistakes of the wiring, in words: what the capacitances of the inputs show, which pin to look at, what to do.

Swapped inputs are not among them: both are connected. Only a press shows them (`palpate.sentences`).
"""

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from palpate.ad7746.configuration import HARD, NAMES, SOFT, Configuration
from palpate.ad7746.inputs import Looking

_SOCKETS = {"1+": " (socket P4)", "1-": " (socket P3)", "A": " (socket P1)", "B": " (socket P2)"}
_DEMO = "the board's own length sensor, connected until R1 and R2 are removed"


class Mistake(NamedTuple):
    """One mistake.

    Attributes
    ----------
    what : str
        What was measured, and where.
    remedy : str
        What to do.
    fatal : bool
        Whether no ratio can be measured.
    """

    what: str
    remedy: str
    fatal: bool = True

    def __str__(self) -> str:
        """Return both as one sentence."""
        return f"{self.what}: {self.remedy}"


class Wiring:
    """The wiring that looks at the inputs show.

    Parameters
    ----------
    look : Looking
        Called once at most for each input and excitation.
    configuration : Configuration
    kit : bool
        Whether it is the evaluation kit, with its sockets and its length sensor.
    """

    def __init__(self, look: Looking, configuration: Configuration, *, kit: bool) -> None:
        self._look = cache(look)
        self._configuration = configuration
        self._kit = kit

    def mistakes(self) -> list[Mistake]:
        """Return all mistakes, those that prevent a measurement first."""
        if any(self._look(plus, name).is_unknown for plus in ("1+", "2+") for name in "AB"):
            return []
        if shorts := list(self._shorts()):
            return shorts
        if not any(self._connected(number, name) for number in (HARD, SOFT) for name in "AB"):
            return [self._nothing()]
        found = [mistake for number in (HARD, SOFT) for mistake in self._of(number)]
        return sorted(found, key=lambda mistake: not mistake.fatal)

    def _shorts(self) -> Iterator[Mistake]:
        for name in sorted({self._pins(HARD)[0], self._pins(HARD)[-1], self._pins(SOFT)[0], self._pins(SOFT)[-1]}):
            if self._look("1+", name).shorted or self._look("2+", name).shorted:
                yield Mistake(
                    f"{self._at(name)} is shorted or overloaded (the chip reports EXCERR)",
                    f"look for a short from EXC{name} to ground or to a shield, in the cable, the plug and the probe",
                )

    def _of(self, number: int) -> Iterator[Mistake]:
        plus, own = self._plus(number), self._pins(number)
        for name in own:
            if math.isinf(self._look(plus, name).capacitance):
                yield Mistake(
                    f"{NAMES[number]} bump: {self._at(plus)} has {self._look(plus, name)} on EXC{name}",
                    f"look for a short between CIN{plus} and EXC{name}, or a cable that is long or has no shield",
                )
                return
        if any(self._look(plus, name).is_sensor for name in own):
            yield from self._besides(number)
        elif not self._configuration.differential or not self._negative(number):
            yield self._flat(number)

    def _besides(self, number: int) -> Iterator[Mistake]:
        """Return what is connected beside the bump: it does not prevent a measurement."""
        plus, own = self._plus(number), self._pins(number)
        demo = self._kit and plus == "2+"
        if all(self._look(plus, name).is_sensor for name in "AB"):
            what = f"{NAMES[number]} bump: {self._at(plus)} has {self._levels(plus)}"
            if demo and own == "B":
                yield Mistake(f"{what}, {_DEMO}", "remove them; the measurement on EXCB goes on", fatal=False)
            elif demo:
                yield Mistake(f"{what}, {_DEMO}", f"remove them, or use {self._option('B', number)}", fatal=False)
            else:
                yield Mistake(what, f"pull off what is not the bump; measured is {self._driven(number)}", fatal=False)
        elif demo and self._look(plus, "A").is_sensor:
            what = f"{NAMES[number]} bump: EXCA also drives {_DEMO}"
            yield Mistake(what, "remove them; the readings cannot show whether they are there", fatal=False)

    def _flat(self, number: int) -> Mistake:
        plus, own = self._plus(number), self._pins(number)
        here = f"{NAMES[number]} bump: {self._at(plus)} has {self._look(plus, own[0])} on {self._driven(number)}"
        for name in "AB".replace(own, ""):
            if self._look(plus, name).is_sensor:
                remedy = f"use {self._option(name, number)}, or move its wire from EXC{name} to {self._driven(number)}"
                if self._kit and (plus, name) == ("2+", "A"):
                    remedy += f". It may be {_DEMO}: then remove them, and connect the bump to CIN2+ and EXCB"
                return Mistake(f"{here}, {self._look(plus, name)} on EXC{name}", remedy)
        if negative := self._negative(number):
            return Mistake(
                f"{here}, its wire is at {self._at(negative)}", f"move it to CIN{plus}, or use differential=yes"
            )
        return Mistake(
            f"{NAMES[number]} bump: {self._at(plus)} has {self._levels(plus)}, nothing is connected",
            f"look at its wires, one to CIN{plus}, the other to EXC{own[0]}{self._unpopulated(plus)}",
        )

    def _nothing(self) -> Mistake:
        levels = ", ".join(f"{self._at(plus)} has {self._levels(plus)}" for plus in ("1+", "2+"))
        wires = (f"the {NAMES[n]} bump to CIN{self._plus(n)} and EXC{self._pins(n)[0]}" for n in (HARD, SOFT))
        return Mistake(f"no probe is connected: {levels}", f"wire {', '.join(wires)}{self._unpopulated('2+')}")

    def _connected(self, number: int, name: str) -> bool:
        plus = self._plus(number)
        return not self._look(plus, name).is_empty or bool(self._negative(number))

    def _negative(self, number: int) -> str:
        """Return the name of CIN- if the bump is there; else ""."""
        minus = f"{self._configuration.input(number)}-"
        return minus if any(self._look(minus, name).is_sensor for name in self._pins(number)) else ""

    def _option(self, name: str, number: int) -> str:
        """Return the option that puts this bump on another pin, and the other one where it answers."""
        pins = []
        for each in (HARD, SOFT):
            own, plus = self._pins(each), self._plus(each)
            other = next((pin for pin in "AB" if self._look(plus, pin).is_sensor), own)
            pins.append(own if any(self._look(plus, pin).is_sensor for pin in own) else other)
        pins[number] = name
        value = pins[0] if pins[0] == pins[1] else ",".join(pins)
        return f"excitation={value} (as in usb:?excitation={value})"

    def _levels(self, plus: str) -> str:
        return " and ".join(f"{self._look(plus, name)} on EXC{name}" for name in "AB")

    def _plus(self, number: int) -> str:
        return f"{self._configuration.input(number)}+"

    def _pins(self, number: int) -> str:
        return self._configuration.channel(number).excitation

    def _driven(self, number: int) -> str:
        return " and ".join(f"EXC{name}" for name in self._pins(number))

    def _at(self, name: str) -> str:
        pin = f"EXC{name}" if name in "AB" else f"CIN{name}"
        return pin + (_SOCKETS.get(name, "") if self._kit else "")

    def _unpopulated(self, plus: str) -> str:
        return "; the board has no socket for CIN2+ (P6)" if self._kit and plus == "2+" else ""
