"""The clock of a device beside that of the computer: a wrong unit of its times is an error, another difference is told."""

from palpate.errors import ProtocolError
from palpate.sources.serial.names import NANOSECONDS

_PAIRS = 10
_SPAN_NS = 10**9
_FACTOR = 3.0
"""No clock is so wrong, but the next unit is more."""
_UNITS = ("s", "ms", "us", "ns")


class Pace:
    """Compares the time that goes by in the lines with that on the computer.

    It does so over stretches of 10 pairs and 1 s or more. Two of them, one after the other, must be wrong in the same
    direction: after a burst of lines that waited somewhere the next one is right, or wrong the other way.

    Parameters
    ----------
    unit : str
        Unit of the times, if the name of the column says it.
    """

    def __init__(self, unit: str) -> None:
        self._unit = unit
        self._before = 0.0
        self._told = False
        self._begin()

    def add(self, step_ns: int, waited_ns: int) -> str:
        """Take the time since the pair before, by the lines and by arrival, ns.

        Returns
        -------
        str
            What to tell, once: the clock of the lines is more than 3 times too fast or too slow, and no other unit
            explains it, as where stored lines are sent again. Else "".

        Raises
        ------
        ProtocolError
            It is, and another unit explains it.
        """
        if step_ns <= 0:  # it restarted
            return ""
        self._pairs += 1
        self._clock_ns += step_ns
        self._waited_ns += waited_ns
        if self._pairs < _PAIRS or self._waited_ns < _SPAN_NS:
            return ""
        before, ratio = self._before, self._clock_ns / self._waited_ns
        if min(before, ratio) > _FACTOR or 0 < max(before, ratio) < 1 / _FACTOR:
            text = self._judged(ratio)
            self._told, text = True, "" if self._told else text
        else:
            text = ""
        self._before = ratio
        self._begin()
        return text

    def _begin(self) -> None:
        self._pairs = self._clock_ns = self._waited_ns = 0

    def _judged(self, ratio: float) -> str:
        spans = f"{self._clock_ns / 1e9:.4g} s went by in {self._waited_ns / 1e9:.4g} s of the computer's clock"
        scale = NANOSECONDS.get(self._unit, 0) / ratio
        for unit in _UNITS:
            if 1 / _FACTOR < scale / NANOSECONDS[unit] < _FACTOR:
                raise ProtocolError(
                    f"the times of the lines are not in {self._unit or 'their unit'}: by them {spans}. In {unit} they agree: "
                    f"name the column t_{unit}, for example columns=t_{unit},hard,soft"
                )
        return f"by the times of the lines {spans}: is the clock of the board right?"
