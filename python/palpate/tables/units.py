"""Units of capacitances and times, and the units in the names of columns."""

import re
from collections.abc import Collection

PICOFARADS = {"aF": 1e-6, "fF": 1e-3, "pF": 1.0, "nF": 1e3, "uF": 1e6, "µF": 1e6, "μF": 1e6, "mF": 1e9, "F": 1e12}
SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0, "d": 86400.0}

_UNIT = re.compile(r"(?:^|[\s_(\[/])(%|[A-Za-zµμ]{1,3})[)\]]?$")

_SHORT = frozenset({"v", "a", "n", "g", "k", "c", "m", "°c", "%", "ω"})
"""Units, in lower case, that are names as well, as in "sensor C": they count in brackets only."""
_OTHERS = """
    mv uv µv volt volts ohm kohm mohm kω mω hz khz mhz ma ua na mn kn pa kpa mm um kg degc deg percent
    counts count cnt cnts raw lsb adc digits codes norm normalized normalised rel dc/c0 dc/c δc/c0 δc/c
"""
_LONG = frozenset(_OTHERS.split())
_BRACKET = re.compile(r"[(\[]([^()\[\]]*)[)\]]\s*$")
_OTHER = re.compile(r"(?:^|[\s_])([^\s_]+)$")


def unit_in(name: str, units: Collection[str]) -> str | None:
    """Return the unit at the end of a name: one of `units`, "%", or None.

    Examples
    --------
    >>> unit_in("C1 (pF)", PICOFARADS), unit_in("t_ms", SECONDS), unit_in("Ch1", PICOFARADS)
    ('pF', 'ms', None)
    """
    match = _UNIT.search(name)
    if not match:
        return None
    known = {unit.casefold(): unit for unit in units}
    unit = match[1] if match[1] in units else known.get(match[1].casefold())
    return unit or ("%" if match[1] == "%" else None)


def no_capacitance(text: str) -> str | None:
    """Return what the end of a name says that is no capacitance, or one on a scale of its own; else None.

    Examples
    --------
    >>> no_capacitance("hard (V)"), no_capacitance("C1 [0.1 pF]"), no_capacitance("hard_counts"), no_capacitance("C1")
    ('V', '0.1 pF', 'counts', None)
    >>> no_capacitance("sensor C"), no_capacitance("C1 (pF)"), no_capacitance("C1 (hard)")
    (None, None, None)
    """
    bracket = _BRACKET.search(text)
    if bracket:
        inside = bracket[1].strip()
        scale = re.search(r"\d", inside) and re.search(r"(?:^|[\s\d*.])[afpnuµμm]?F\b", inside)
        return inside if scale or inside.casefold() in _SHORT | _LONG else None
    match = _OTHER.search(text)
    return match[1] if match and match[1].casefold() in _LONG else None


def bare(name: str) -> str:
    """Return a name without its unit: 'C1 (pF)' gives 'C1'."""
    match = _UNIT.search(name)
    known = match and (match[1] in PICOFARADS or match[1] in SECONDS or match[1] == "%")
    return (name[: match.start()] if match and known else name).strip(" _/")


def bare_name(name: str) -> str:
    """Return a name in lower case and without its unit: 'C (pF)', 'c_pF' and 'C' are equal."""
    return bare(name).casefold()
