"""Wiring of the simulated chip: what hangs between which input and which excitation pin.

`WIRINGS` has the wiring of the evaluation kit's guide and the mistakes that are made with it. What is marked [?] is an
assumption.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from palpate.ad7746 import datasheet

# (bump, begin, end) -> mean capacitance, pF, of the hard (1) or the soft bump (2) between two times, s.
Pins = Callable[[int, float, float], float]

HARD, SOFT = 1, 2  # Numbers of the bumps, and of their inputs.
STRAY_PF = 0.003  # Capacitance of an input without a wire to a driven excitation pin [?].
# The board's length sensor between CIN2+ and EXCA, which R1 and R2 connect; the value is from its schematic.
DEMO_PF = 1.4
SHORT_PF = 1000.0  # An input that is shorted to an excitation pin: far outside every range.


@dataclass(frozen=True)
class Wiring:
    """Where the two bumps hang, at an input and an excitation pin as "1+B", "" nowhere; what else is there; a shorted pin."""

    hard: str = "1+B"
    soft: str = "2+B"
    constant_pF: Mapping[str, float] = field(default_factory=dict)
    shorted: str = ""

    def mean_pF(self, bumps: Pins, setup: int, excitation: int, begin_s: float, end_s: float, loose: int = 0) -> float:
        """Return the mean capacitance that the chip measures between two times."""
        pin, driven = 2 if setup & datasheet.CIN2 else 1, self._driven(excitation)
        signs = {"+": 1.0, "-": -1.0} if setup & datasheet.CAPDIFF else {"+": 1.0}
        seen = {f"{pin}{end}{name}": sign for end, sign in signs.items() for name in driven if pin != loose}
        wired = ((self.hard, HARD), (self.soft, SOFT))
        found = [seen[place] * bumps(bump, begin_s, end_s) for place, bump in wired if place in seen]
        found += [seen[place] * constant_pF for place, constant_pF in self.constant_pF.items() if place in seen]
        return sum(found) if found else STRAY_PF * bool(driven)

    def fails(self, excitation: int) -> bool:
        """Return whether a driven pin is shorted, for the register EXC_SETUP."""
        return any(pin in self.shorted for pin in self._driven(excitation))

    @staticmethod
    def _driven(excitation: int) -> str:
        return ("A" if excitation & datasheet.EXCA else "") + ("B" if excitation & datasheet.EXCB else "")


_DEMO = {"2+A": DEMO_PF}

# By name: both bumps on EXCB, as in the guide; then other wirings. exca, hard-exca, soft-exca: both bumps, or one, on EXCA.
# swapped: the hard bump on CIN2. demo, demo-exca, demo-alone: R1 and R2 are left in, with both bumps on EXCB, both on
# EXCA, no soft bump. hard-minus: the hard bump on CIN1-. hard-open, soft-open, open: not connected. hard-shorted, soft-
# shorted: the input to EXCB. exca-shorted, excb-shorted: the pin to ground. differential: a constant capacitor between
# each CIN- and EXCB.
WIRINGS: dict[str, Wiring] = {
    "guide": Wiring(),
    "exca": Wiring("1+A", "2+A"),
    "hard-exca": Wiring("1+A", "2+B"),
    "soft-exca": Wiring("1+B", "2+A"),
    "swapped": Wiring("2+B", "1+B"),
    "demo": Wiring(constant_pF=_DEMO),
    "demo-exca": Wiring("1+A", "2+A", _DEMO),
    "demo-alone": Wiring("1+B", "", _DEMO),
    "hard-minus": Wiring("1-B", "2+B"),
    "hard-open": Wiring("", "2+B"),
    "soft-open": Wiring("1+B", ""),
    "open": Wiring("", ""),
    "hard-shorted": Wiring(constant_pF={"1+B": SHORT_PF}),
    "soft-shorted": Wiring(constant_pF={"2+B": SHORT_PF}),
    "exca-shorted": Wiring(shorted="A"),
    "excb-shorted": Wiring(shorted="B"),
    "differential": Wiring(constant_pF={"1-B": 2.0, "2-B": 1.5}),
}
