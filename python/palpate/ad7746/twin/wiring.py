"""Wiring of the simulated chip: what hangs between which input and which excitation pin.

`WIRINGS` has the wiring of the evaluation kit's guide and the mistakes that are made with it. What is marked [?] is an
assumption.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from palpate.ad7746 import datasheet

# (bump, begin, end) -> mean capacitance, pF, of the hard (1) or the soft bump (2) between two times, s.
Pins = Callable[[int, float, float], float]

HARD, SOFT = 1, 2  # Numbers of the bumps, and of their inputs.
STRAY_PF = 0.003  # Capacitance of an input without a wire to a driven excitation pin [?].
# The board's length sensor between CIN2+ and EXCA, which R1 and R2 connect; the value is from its schematic.
DEMO_PF = 1.4
SHORT_PF = 1000.0  # An input that is shorted to an excitation pin: far outside every range.


class Wire(NamedTuple):
    """A capacitor between an input and an excitation pin."""

    input: str
    excitation: str
    bump: int = 0
    constant_pF: float = 0.0

    def mean_pF(self, bumps: Pins, begin_s: float, end_s: float) -> float:
        """Return its mean capacitance between two times."""
        return self.constant_pF + (bumps(self.bump, begin_s, end_s) if self.bump else 0.0)


@dataclass(frozen=True)
class Wiring:
    """All wires of a board."""

    wires: tuple[Wire, ...]
    shorted: str = ""

    def mean_pF(self, bumps: Pins, setup: int, excitation: int, begin_s: float, end_s: float, loose: int = 0) -> float:
        """Return the mean capacitance that the chip measures between two times."""
        pin = 2 if setup & datasheet.CIN2 else 1
        signs = {f"{pin}+": 1.0} | ({f"{pin}-": -1.0} if setup & datasheet.CAPDIFF else {})
        driven = self._driven(excitation)
        found = [wire for wire in self.wires if wire.input in signs and wire.excitation in driven and pin != loose]
        if not found:
            return STRAY_PF if driven else 0.0
        return sum(signs[wire.input] * wire.mean_pF(bumps, begin_s, end_s) for wire in found)

    def fails(self, excitation: int) -> bool:
        """Return whether a driven pin is shorted, for the register EXC_SETUP."""
        return any(pin in self.shorted for pin in self._driven(excitation))

    @staticmethod
    def _driven(excitation: int) -> str:
        return ("A" if excitation & datasheet.EXCA else "") + ("B" if excitation & datasheet.EXCB else "")


def _bumps(hard: str, soft: str) -> tuple[Wire, ...]:
    """Return the two bumps, each at an input and an excitation, as "1+B"; "": not connected."""
    wired = ((hard, HARD), (soft, SOFT))
    return tuple(Wire(place[:2], place[2], bump) for place, bump in wired if place)


_GUIDE = _bumps("1+B", "2+B")
_DEMO = Wire("2+", "A", constant_pF=DEMO_PF)
_REFERENCES = (Wire("1-", "B", constant_pF=2.0), Wire("2-", "B", constant_pF=1.5))

# By name: both bumps on EXCB, as in the guide; then other wirings. exca, hard-exca, soft-exca: both bumps, or one, on EXCA.
# swapped: the hard bump on CIN2. demo, demo-exca, demo-alone: R1 and R2 are left in, with both bumps on EXCB, both on
# EXCA, no soft bump. hard-minus: the hard bump on CIN1-. hard-open, soft-open, open: not connected. hard-shorted, soft-
# shorted: the input to EXCB. exca-shorted, excb-shorted: the pin to ground. differential: a constant capacitor between
# each CIN- and EXCB.
WIRINGS: dict[str, Wiring] = {
    "guide": Wiring(_GUIDE),
    "exca": Wiring(_bumps("1+A", "2+A")),
    "hard-exca": Wiring(_bumps("1+A", "2+B")),
    "soft-exca": Wiring(_bumps("1+B", "2+A")),
    "swapped": Wiring(_bumps("2+B", "1+B")),
    "demo": Wiring((*_GUIDE, _DEMO)),
    "demo-exca": Wiring((*_bumps("1+A", "2+A"), _DEMO)),
    "demo-alone": Wiring((*_bumps("1+B", ""), _DEMO)),
    "hard-minus": Wiring(_bumps("1-B", "2+B")),
    "hard-open": Wiring(_bumps("", "2+B")),
    "soft-open": Wiring(_bumps("1+B", "")),
    "open": Wiring(()),
    "hard-shorted": Wiring((*_GUIDE, Wire("1+", "B", constant_pF=SHORT_PF))),
    "soft-shorted": Wiring((*_GUIDE, Wire("2+", "B", constant_pF=SHORT_PF))),
    "exca-shorted": Wiring(_GUIDE, shorted="A"),
    "excb-shorted": Wiring(_GUIDE, shorted="B"),
    "differential": Wiring((*_GUIDE, *_REFERENCES)),
}
