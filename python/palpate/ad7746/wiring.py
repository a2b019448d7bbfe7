"""Mistakes of the wiring, in words: what the capacitances of the inputs show, which pin to look at, what to do.

Swapped inputs are not among them: both are connected. Only a press shows them (`palpate.sentences`).
"""

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from palpate.ad7746.configuration import HARD, NAMES, SOFT, Configuration
from palpate.ad7746.inputs import EMPTY_PF, Looking

_SOCKETS = {"1+": " (socket P4)", "1-": " (socket P3)", "A": " (socket P1)", "B": " (socket P2)"}
_DEMO = "the board's own length sensor, connected until R1 and R2 are removed"
_DEMO_PF = (0.9, 1.9)  # 1.4 pF by the schematic


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
        answers = all(self._answers(number) for number in (HARD, SOFT))
        for name in sorted({*self._pins(HARD), *self._pins(SOFT)} if answers else "AB"):
            if self._look("1+", name).shorted or self._look("2+", name).shorted:
                yield Mistake(
                    f"{self._at(name)} is shorted or overloaded (the chip reports EXCERR)",
                    f"look for a short from EXC{name} to ground or to a shield, in the cable, the plug and the probe",
                )

    def _of(self, number: int) -> Iterator[Mistake]:
        plus = self._plus(number)
        for name in self._pins(number) if self._answers(number) else "AB":
            if math.isinf(self._look(plus, name).capacitance):
                yield Mistake(
                    f"{NAMES[number]} bump: {self._at(plus)} has {self._look(plus, name)} on EXC{name}",
                    f"look for a short between CIN{plus} and EXC{name}, or a cable that is long or has no shield",
                )
                return
        if not self._answers(number):
            yield self._flat(number)
            return
        yield from self._besides(number)
        if self._configuration.differential:
            yield from self._exchanged(number)

    def _exchanged(self, number: int) -> Iterator[Mistake]:
        """Return that CIN+ minus CIN- is negative: of the wires, or of a reference that is larger than the bump."""
        pin, own = self._configuration.input(number), self._pins(number)
        plus, minus = (sum(self._look(f"{pin}{sign}", name).capacitance for name in own) for sign in "+-")
        if plus - minus < -EMPTY_PF:
            what = f"{NAMES[number]} bump: CIN{pin}+ minus CIN{pin}- is {plus - minus:.2f} pF"
            remedy = (
                f"exchange its wires at CIN{pin}+ and CIN{pin}-, unless the reference at CIN{pin}- is the larger one"
            )
            yield Mistake(what, remedy, fatal=False)

    def _besides(self, number: int) -> Iterator[Mistake]:
        """Return what is connected beside the bump: it does not prevent a measurement."""
        plus, own = self._plus(number), self._pins(number)
        demo = self._kit and plus == "2+"
        if all(self._look(plus, name).is_sensor for name in "AB"):
            what = f"{NAMES[number]} bump: {self._at(plus)} has {self._levels(plus)}"
            if demo and own == "B":
                yield Mistake(f"{what}, {_DEMO}", "remove them; the measurement on EXCB goes on", fatal=False)
            elif demo and own == "A" and self._is_demo(plus):
                yield Mistake(f"{what}, {_DEMO}", f"remove them{self._option('B', number, ', and use {}')}")
            elif demo:
                yield Mistake(f"{what}, {_DEMO}", f"remove them{self._option('B', number, ', or use {}')}", fatal=False)
            else:
                yield Mistake(what, f"pull off what is not the bump; measured is {self._driven(number)}", fatal=False)
        elif demo and self._look(plus, "A").is_sensor:
            what = f"{NAMES[number]} bump: EXCA also drives {_DEMO}"
            remedy = "remove them; the readings cannot show whether they are there"
            if self._is_demo(plus):  # a small bump may be as large: it is measured
                remedy += f". {self._look(plus, 'A')} is as much as they alone give: the bump may not be connected"
            yield Mistake(what, remedy, fatal=False)

    def _flat(self, number: int) -> Mistake:
        plus, own = self._plus(number), self._pins(number)
        here = f"{NAMES[number]} bump: {self._at(plus)} has {self._look(plus, own[0])} on {self._driven(number)}"
        for name in "AB".replace(own, ""):
            if self._look(plus, name).is_sensor:
                return Mistake(f"{here}, {self._look(plus, name)} on EXC{name}", self._to(name, number))
        if negative := self._negative(number):
            exchanged = f"exchange its wires at CIN{plus} and CIN{negative}"
            remedy = exchanged if self._configuration.differential else f"move it to CIN{plus}"
            return Mistake(f"{here}, its wire is at {self._at(negative)}", remedy)
        return Mistake(
            f"{NAMES[number]} bump: {self._at(plus)} has {self._levels(plus)}, nothing is connected",
            f"look at its wires, one to CIN{plus}, the other to EXC{own[0]}{self._unpopulated(plus)}",
        )

    def _to(self, name: str, number: int) -> str:
        """Return what to do about a bump that answers to another pin."""
        plus = self._plus(number)
        if self._is_demo(plus) and name == "A":
            return f"it is as large as {_DEMO}: remove them, and connect the bump to CIN2+ and EXCB"
        remedy = self._option(name, number, "use {}, or ") + f"move its wire from EXC{name} to {self._driven(number)}"
        if self._kit and (plus, name) == ("2+", "A"):
            remedy += f". It may be {_DEMO}: then remove them, and connect the bump to CIN2+ and EXCB"
        return remedy

    def _nothing(self) -> Mistake:
        levels = ", ".join(f"{self._at(plus)} has {self._levels(plus)}" for plus in ("1+", "2+"))
        wires = (f"the {NAMES[n]} bump to CIN{self._plus(n)} and EXC{self._pins(n)[0]}" for n in (HARD, SOFT))
        return Mistake(f"no probe is connected: {levels}", f"wire {', '.join(wires)}{self._unpopulated('2+')}")

    def _connected(self, number: int, name: str) -> bool:
        plus = self._plus(number)
        return not self._look(plus, name).is_empty or bool(self._negative(number))

    def _answers(self, number: int) -> bool:
        """Return whether a sensor is between CIN+ and a driven pin."""
        return any(self._look(self._plus(number), name).is_sensor for name in self._pins(number))

    def _negative(self, number: int) -> str:
        """Return the name of CIN- if the bump is there; else ""."""
        minus = f"{self._configuration.input(number)}-"
        return minus if any(self._look(minus, name).is_sensor for name in "AB") else ""

    def _is_demo(self, plus: str) -> bool:
        """Return whether CIN2+ has the capacitance of the board's length sensor on EXCA."""
        low, high = _DEMO_PF
        return self._kit and plus == "2+" and low < self._look(plus, "A").capacitance < high

    def _place(self, number: int) -> str:
        """Return the excitation for a bump: the one in use, if it answers; "": it answers to none."""
        own, plus = self._pins(number), self._plus(number)
        found = [
            name for name in "AB" if self._look(plus, name).is_sensor and not (name == "A" and self._is_demo(plus))
        ]
        return own if any(name in found for name in own) else "".join(found[:1])

    def _option(self, name: str, number: int, words: str) -> str:
        """Return, in words, the option that puts this bump on another pin; "": the other bump answers to none."""
        pins = [self._place(HARD), self._place(SOFT)]
        pins[number] = name
        if not all(pins):
            return ""
        value = pins[0] if pins[0] == pins[1] else ",".join(pins)
        return words.format(f"excitation={value} (as in usb:?excitation={value})")

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
