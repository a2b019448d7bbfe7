"""Units of capacitances and times, and the units in the names of columns."""

import re
from collections.abc import Collection

PICOFARADS = {"aF": 1e-6, "fF": 1e-3, "pF": 1.0, "nF": 1e3, "uF": 1e6, "µF": 1e6, "μF": 1e6, "mF": 1e9, "F": 1e12}
SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0, "d": 86400.0}

_UNIT = re.compile(r"(?:^|[\s_(\[/])(%|[A-Za-zµμ]{1,3})[)\]]?$")


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


def bare(name: str) -> str:
    """Return a name without its unit: 'C1 (pF)' gives 'C1'."""
    match = _UNIT.search(name)
    known = match and (match[1] in PICOFARADS or match[1] in SECONDS or match[1] == "%")
    return (name[: match.start()] if match and known else name).strip(" _/")


def bare_name(name: str) -> str:
    """Return a name in lower case and without its unit: 'C (pF)', 'c_pF' and 'C' are equal."""
    return bare(name).casefold()
