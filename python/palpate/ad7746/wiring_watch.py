"""Watch over the wires during a measurement: one comes off or is shorted; dead converter."""

from enum import StrEnum

from palpate.ad7746 import registers
from palpate.ad7746.configuration import NAMES, SATURATION, Configuration
from palpate.ad7746.wiring import EMPTY_PF, MeasureInput
from palpate.samples import Sample, Status

CONFIRM_S = 1.0  # The inputs are measured after suspicious readings for this long.
_AGAIN_S = 5.0  # until they are measured again, if that confirmed nothing
_BACK_S = 0.5
_FALLEN = 0.7  # share of the idle capacitance that is missing; it is known to 20 %
_SAME_CODES = 8  # the noise is above 8 codes rms at every speed: two are rarely the same


class _Suspicion(StrEnum):
    """What the readings of a channel may mean."""

    NONE = ""
    SHORT = "short"
    OFF = "off"
    SAME = "same"


class WiringWatch:
    """Watches one channel; `text` is the present trouble.

    A reading only raises a suspicion: with a CAPDAC in use, an open input is saturated, or far
    below its idle value. A measurement of the input itself decides, so that a deep press or a range
    that moved is never taken for a wire.
    """

    def __init__(self, number: int, measure: MeasureInput) -> None:
        self.text = ""
        self._number = number
        self._measure = measure
        self._suspicion = _Suspicion.NONE
        self._confirmed = _Suspicion.NONE
        self._since_ns = 0  # begin of the present suspicion
        self._code = -1
        self._same = 0

    def take(self, sample: Sample, configuration: Configuration) -> str:
        """Return the change with this sample, which is not lost; empty: there is none."""
        before = self._suspicion
        self._suspicion = self._suspect(sample, configuration)
        if self._suspicion != before:
            self._since_ns = sample.t_hard_ns
        if self._suspicion == self._confirmed:
            return ""
        needed_s = CONFIRM_S if self._suspicion else _BACK_S
        if (sample.t_hard_ns - self._since_ns) / 1e9 < needed_s:
            return ""
        if not self._suspicion:
            self._confirmed = _Suspicion.NONE
            self.text = ""
            return f"{NAMES[self._number]} bump: it is measured again"
        self._since_ns = sample.t_hard_ns + round((_AGAIN_S - CONFIRM_S) * 1e9)
        trouble = self._confirm(configuration)
        if not trouble:
            return ""
        self._confirmed = self._suspicion
        self.text = f"{NAMES[self._number]} bump: {trouble}"
        return self.text

    def _suspect(self, sample: Sample, configuration: Configuration) -> _Suspicion:
        value = (sample.hard, sample.soft)[self._number]
        code = (sample.hard_raw, sample.soft_raw)[self._number]
        self._same = self._same + 1 if code == self._code else 0
        self._code = code
        steps = configuration.channel(self._number).capdac
        below = -value if steps < 0 else value
        saturated = bool(sample.status & SATURATION[self._number])
        if sample.status & Status.EXCITATION:
            return _Suspicion.SHORT
        if below < EMPTY_PF - _FALLEN * abs(steps) * registers.DAC_STEP_PF:
            return _Suspicion.OFF
        if saturated and below < 0:
            return _Suspicion.OFF
        if self._same >= _SAME_CODES and not saturated:
            return _Suspicion.SAME
        return _Suspicion.NONE

    def _confirm(self, configuration: Configuration) -> str:
        """Return the trouble that a measurement of the input shows; empty: none."""
        if self._suspicion == _Suspicion.SAME:
            return "every reading is the same: the converter does not measure; replug the board"
        plus = f"{configuration.input(self._number)}+"
        pins = configuration.channel(self._number).excitation
        levels = {f"EXC{name}": self._measure(plus, name) for name in pins}
        if self._suspicion == _Suspicion.SHORT:
            shorted = [name for name, level in levels.items() if level.shorted]
            if not shorted:
                return ""
            return (
                f"{' and '.join(shorted)} is shorted or overloaded (EXCERR): "
                "look at its wire, its plug and the probe"
            )
        if not all(level.is_empty for level in levels.values()):
            return ""
        texts = [f"{level} on {name}" for name, level in levels.items()]
        where = f"look at CIN{plus} and EXC{pins[0]}"
        return f"CIN{plus} has {' and '.join(texts)}: its wire is off: {where}"
