"""What is connected to an input of the AD7746: its capacitance to an excitation pin, whatever the range in use."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, Channel
from palpate.ad7746.converter import Converter
from palpate.samples import Status

# An input with less than this has no sensor. Open inputs of a real board are expected to have some fF [?].
EMPTY_PF = 0.05
MOST_PF = 17.0  # Range that every chip has; most have more.
# CAPDAC steps that are tried: two neighbours see a common value on every chip, whose steps are 0.13 to 0.2 pF.
_STEPS = (0, 37, 74, 111, datasheet.DAC_STEPS)


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

    @property
    def is_unknown(self) -> bool:
        """Whether it was not measured: the driver was interrupted."""
        return math.isnan(self.capacitance) and not self.shorted

    def __str__(self) -> str:
        """Return the capacitance with the digits that are known."""
        if self.shorted:
            return "a short (EXCERR)"
        if math.isinf(self.capacitance):
            return f"more than {MOST_PF:g} pF"
        size = abs(self.capacitance)
        return f"about {self.capacitance:.1f} pF" if size >= datasheet.FULL_SCALE_PF else f"{self.capacitance:.3f} pF"


Looking = Callable[[str, str], Look]  # (input, excitation) -> `Look`, as `palpate.ad7746.driver.Ad7746.look`.


def look(converter: Converter, name: str, excitation: str) -> Look:
    """Measure the capacitance between an input and an excitation pin."""
    plus = _capacitance(converter, int(name[0]), excitation, differential=False)
    if name[1] == "+" or plus.shorted:
        return plus
    both = _capacitance(converter, int(name[0]), excitation, differential=True)
    return both if both.shorted else Look(plus.capacitance - both.capacitance)


def _capacitance(converter: Converter, pin: int, excitation: str, *, differential: bool) -> Look:
    own = converter.configuration
    sign = 1
    try:
        for steps in _STEPS:
            there = Channel(capdac=sign * steps, excitation=excitation)
            converter.configuration = replace(own, capf=0, hard_input=pin, differential=differential, hard=there)
            reading = converter.patiently(HARD)
            if reading.status & Status.EXCITATION:
                return Look(math.nan, shorted=True)
            if not reading.status:
                return Look(reading.capacitance + sign * steps * datasheet.DAC_STEP_PF)
            sign = 1 if reading.capacitance > 0 else -1
    finally:
        converter.configuration = own
    return Look(sign * math.inf)
