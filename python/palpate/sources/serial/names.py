"""What the names of columns mean: `hard`, `C1 (pF)`, `t_hard_us`."""

from typing import NamedTuple

from palpate.errors import quoted
from palpate.sources.serial.cells import Refused
from palpate.tables.units import PICOFARADS

UNUSED = "-"
"""Name of a column that is not used."""
NANOSECONDS = {"s": 10**9, "sec": 10**9, "ms": 10**6, "us": 10**3, "µs": 10**3, "μs": 10**3, "ns": 1}
_CELSIUS = {"C": 1, "°C": 1, "degC": 1, "deg.C": 1}
_SMALL = {form: unit for unit in ("aF", "fF", "pF", "nF", "uF") for form in (unit.lower(), unit.upper())}
_ROLES = {
    "hard": ("hard", "c1", "c_hard", "chard"),
    "soft": ("soft", "c2", "c_soft", "csoft"),
    "t": ("t", "time", "timestamp"),
    "t_hard": ("t_hard", "time_hard"),
    "t_soft": ("t_soft", "time_soft"),
    "seq": ("seq", "sequence", "sample", "index", "count", "n"),
    "temperature": ("temperature", "temp"),
    "hard_raw": ("hard_raw", "raw_hard"),
    "soft_raw": ("soft_raw", "raw_soft"),
    "capdac_hard": ("capdac_hard",),
    "capdac_soft": ("capdac_soft",),
    "status": ("status",),
    "t_uncertainty_us": ("t_uncertainty_us",),
    UNUSED: (UNUSED,),
}
_NAMES = {name: role for role, names in _ROLES.items() for name in names}
_WITH_UNIT = {"millis": ("t", "ms"), "micros": ("t", "us")}


class Column(NamedTuple):
    """What a column is.

    Attributes
    ----------
    role : str
        One of hard, soft, t, t_hard, t_soft, seq, temperature, hard_raw, soft_raw, capdac_hard, capdac_soft, status,
        t_uncertainty_us, and "-": not used.
    unit : str
        As the name says it; empty: it does not.
    """

    role: str
    unit: str = ""


def column(name: str) -> Column:
    """Return what a name means.

    Raises
    ------
    Refused
        The name is not known, or its unit.

    Examples
    --------
    >>> column("C1 (fF)"), column("t_soft_us"), column("millis")
    (Column(role='hard', unit='fF'), Column(role='t_soft', unit='us'), Column(role='t', unit='ms'))
    """
    plain = name.strip().casefold()
    if plain in _WITH_UNIT:
        return Column(*_WITH_UNIT[plain])
    if plain in _NAMES:
        return Column(_NAMES[plain])
    base, unit = _parts(name.strip())
    role = _NAMES.get(base.casefold(), "")
    if unit and role:
        factor(role, unit)
        return Column(role, unit)
    raise Refused(f"the name {quoted(name)} is not known")


def factor(role: str, unit: str) -> float:
    """Return pF or ns in one of this unit; of a temperature 1.

    Raises
    ------
    Refused
        Not a unit of this column.
    """
    if role in ("hard", "soft"):
        known: dict[str, float] = PICOFARADS
        unit = unit if unit in known else _SMALL.get(unit, unit)
    elif role in ("t", "t_hard", "t_soft"):
        known = {name: float(ns) for name, ns in NANOSECONDS.items()}
    else:
        known = {name: float(one) for name, one in _CELSIUS.items()} if role == "temperature" else {}
    if unit not in known:
        raise Refused(f"{quoted(unit)} is not a unit of {role}; allowed: {', '.join(known) or 'none'}")
    return known[unit]


def _parts(name: str) -> tuple[str, str]:
    """Return a name and its unit: "t_ms" and "t (ms)" are t and ms."""
    for opening, closing in ("()", "[]"):
        if name.endswith(closing):
            base, _, unit = name[:-1].partition(opening)
            return base.rstrip(), unit
    base, _, unit = name.rpartition("_")
    return base, unit
