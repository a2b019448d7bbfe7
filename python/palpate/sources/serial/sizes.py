"""The size of capacitances whose unit nothing says: what cannot be pF is asked about."""

from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Format, Values
from palpate.tables.units import PICOFARADS

SMALLEST_PF, LARGEST_PF = 0.01, 100.0
_OTHERS = ("fF", "aF", "nF", "uF", "F")


class Sizes:
    """Checks the first capacitance of each channel, if nothing says its unit."""

    def __init__(self) -> None:
        self._seen: set[str] = set()

    def require(self, settled: Format, values: Values) -> None:
        """Check the values of a line.

        Raises
        ------
        Refused
            Without a unit, the first value of a channel is not 0.01 to 100 pF.
        """
        if settled.has_unit or len(self._seen) == 2:
            return
        found = {role: abs(values[role]) for role in ("hard", "soft") if abs(values.get(role, float("nan"))) >= 0}
        if wrong := [size for role, size in found.items() if role not in self._seen and not _plausible(size)]:
            raise Refused(
                f"{wrong[0]:.6g} without a unit is read as pF from {SMALLEST_PF:g} to {LARGEST_PF:g} only: in which "
                "unit are the numbers, or what else are they?",
                f"unit={_unit(max(found.values()))}",
            )
        self._seen |= found.keys()


def _plausible(size_pF: float) -> bool:
    return SMALLEST_PF <= size_pF <= LARGEST_PF


def _unit(size: float) -> str:
    """Return the unit in which a number is a plausible capacitance; pF if there is none."""
    return next((unit for unit in _OTHERS if _plausible(size * PICOFARADS[unit])), "pF")
