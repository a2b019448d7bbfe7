"""The scale of a converter's codes: a recording keeps the codes, and every reader computes the capacitances from them."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from palpate.ad7746.datasheet import CODES_PER_PF, LAST_CODE, ZERO_CODE
from palpate.errors import quoted

MOST: int = 2**31 - 1
"""Largest code that a sample can have."""


class Codes(NamedTuple):
    """What the codes of a converter mean; the default is the AD7746.

    A code is an integer from 0: add an offset to the codes of a converter that gives negative ones, as `zero`.

    Attributes
    ----------
    zero : int
        The code of 0 pF, -(2**31) to 2**31 - 1.
    per_pF : float
        Codes for one pF, 1e-6 to 1e15.
    largest : int
        Largest code, 1 to 2**31 - 1.

    Examples
    --------
    >>> fdc1004 = Codes(zero=2**23, per_pF=2**19, largest=2**24 - 1)
    >>> fdc1004.pF(2**23 + 2**20)
    2.0
    >>> {"codes": fdc1004._asdict()}  # in the description of a source
    {'codes': {'zero': 8388608, 'per_pF': 524288, 'largest': 16777215}}
    """

    zero: int = ZERO_CODE
    per_pF: float = CODES_PER_PF
    largest: int = LAST_CODE

    def pF(self, code: int) -> float:
        """Return the capacitance of a code; the readers of a recording compute the same bits."""
        return (code - self.zero) / self.per_pF

    def disagreement(self, name: str, code: int, value: float) -> str | None:
        """Return what is wrong with a value and its code; None: there is no code, or the value is the one of the code."""
        if code > self.largest:
            return f"{name}_raw: got {code}, allowed: -1 to {self.largest}, as describe()['codes'] says"
        if code < 0 or value == self.pF(code):
            return None
        return (
            f"{name}: got {value!r} pF for the code {code}, allowed: {self.pF(code)!r}, (code - zero) / per_pF with "
            f"describe()['codes'], by default those of the AD7746; or -1 in place of the code"
        )


def codes_of(device: Mapping[str, Any]) -> Codes:
    """Return the scale of the codes from the description of an instrument.

    Parameters
    ----------
    device : mapping
        As from `Source.describe`; its key `codes` has `zero`, `per_pF` and `largest`.

    Returns
    -------
    Codes
        That of the AD7746 without such a key.

    Raises
    ------
    ValueError
        A part is missing, unknown, or outside its range.

    Examples
    --------
    >>> codes_of({"codes": {"zero": 0, "per_pF": 1000, "largest": 65535}}).pF(1500)
    1.5
    """
    given = device.get("codes", Codes()._asdict())
    if not isinstance(given, Mapping) or set(given) != set(Codes._fields):
        raise ValueError(f"codes: got {quoted(given)}, allowed: the keys {', '.join(Codes._fields)}")
    found = Codes(**given)
    for name, low in (("zero", -MOST - 1), ("largest", 1)):
        if type(value := given[name]) is not int or not low <= value <= MOST:
            raise ValueError(f"codes: {name}: got {quoted(value)}, allowed: an integer from {low} to {MOST}")
    per_pF = found.per_pF
    if isinstance(per_pF, bool) or not isinstance(per_pF, int | float) or not 1e-6 <= per_pF <= 1e15:
        raise ValueError(f"codes: per_pF: got {quoted(per_pF)}, allowed: a number from 1e-6 to 1e15")
    return found
