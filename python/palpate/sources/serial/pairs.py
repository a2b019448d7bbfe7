"""Pairs of both channels, and the samples made of them."""

import math
from collections.abc import Iterator

from palpate.ad7746.datasheet import capacitance_pF, saturated
from palpate.samples import Sample, Status
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Values


class Halves:
    """Joins a hard value and the soft value after it, where a line has one of them.

    Attributes
    ----------
    lost : int
        Hard values without a soft one.
    """

    def __init__(self) -> None:
        self.lost: int = 0
        self._hard: Values = {}
        self._arrived_ns = 0

    def clear(self) -> None:
        """Forget a hard value."""
        self._hard = {}

    def pairs(self, values: Values, arrived_ns: int) -> Iterator[tuple[Values, tuple[int, int]]]:
        """Return the pairs that end with this line, with the arrival of both channels; one may lack the soft value.

        Raises
        ------
        Refused
            A soft value without the hard value before it, or with another number.
        """
        hard, soft = ({name, f"{name}_raw"} & values.keys() for name in ("hard", "soft"))
        before, self._hard = self._hard, {}
        if before and (hard or before.get("seq") != values.get("seq", before.get("seq"))):
            self.lost += 1
            yield {**before, "status": int(Status.LOST)}, (self._arrived_ns, self._arrived_ns)
            before = {}
        if hard and soft:
            yield values, (arrived_ns, arrived_ns)
        elif hard:
            self._hard, self._arrived_ns = _timed(values, "t_hard"), arrived_ns
        elif before:
            yield {**_timed(values, "t_soft"), **before}, (self._arrived_ns, arrived_ns)
        else:
            raise Refused("a soft value without the hard value of its pair before it")


def sample(values: Values, code_pF: float | None) -> Sample:
    """Return the values as a sample, without number and times.

    Parameters
    ----------
    values : dict
    code_pF : float, optional
        pF of one code; default: codes of the AD7746.

    Raises
    ------
    Refused
        Its status says that a value is missing and none is, or the reverse.
    """
    hard_raw, hard = _channel(values, "hard", code_pF)
    soft_raw, soft = _channel(values, "soft", code_pF)
    lost = math.isnan(hard) or math.isnan(soft)
    said = values.get("status", int(Status.LOST) if lost else 0)
    if (said == Status.LOST) != lost:
        raise Refused(f"its status is {said}, but {'a value' if lost else 'no value'} is missing")
    if not lost:
        said |= Status.HARD_SATURATED * (hard_raw >= 0 and saturated(hard_raw))
        said |= Status.SOFT_SATURATED * (soft_raw >= 0 and saturated(soft_raw))
    return Sample(0, 0, 0, hard_raw, soft_raw, hard, soft, int(said), values.get("t_uncertainty_us", -1))


def _channel(values: Values, name: str, code_pF: float | None) -> tuple[int, float]:
    """Return code and capacitance of a channel; -1 and nan: none."""
    if name in values:
        return -1, values[name]
    code = values.get(f"{name}_raw", -1)
    if code_pF:
        return -1, code * code_pF if f"{name}_raw" in values else math.nan
    return code, capacitance_pF(code) if code >= 0 else math.nan


def _timed(values: Values, name: str) -> Values:
    """Return values whose time is that of one channel."""
    return {name if role == "t" else role: value for role, value in values.items()}
