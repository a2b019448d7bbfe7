"""What a user says about a table: the meaning of its columns, their units, their rate."""

import math
import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields

from palpate.errors import listed, quoted, unlike
from palpate.tables.table import DECIMALS
from palpate.tables.units import PICOFARADS, SECONDS

KEYS = ("hard", "soft", "time", "soft_time")
_KEY = re.compile(r"(?:^|,)\s*(hard|soft|time|soft_time)\s*=")


def parsed_map(text: str) -> dict[str, str]:
    """Parse hard=COL,soft=COL[,time=COL]; a name may contain commas.

    Raises
    ------
    ValueError
        Not such a text.

    Examples
    --------
    >>> parsed_map("hard=C1 (pF),soft=3")
    {'hard': 'C1 (pF)', 'soft': '3'}
    """
    parts = _KEY.split(text)
    if parts[0].strip() or len(parts) < 3 or len(set(parts[1::2])) < len(parts[1::2]):
        raise ValueError(f"map: got {quoted(text)}, allowed: hard=COL,soft=COL[,time=COL], each once")
    return {key: name.strip() for key, name in zip(parts[1::2], parts[2::2], strict=True)}


@dataclass(frozen=True)
class Asked:
    """What a user says about a table of another program; None: palpate finds it out.

    Attributes
    ----------
    columns : mapping, optional
        Columns of "hard", "soft", "time", and "soft_time" if the soft channel has its own times: names, or positions
        from 1.
    unit : str, optional
        Unit of both capacitances, aF to F.
    time_unit : str, optional
        Unit of the times, ns to d.
    rate : float, optional
        Pairs a second, above 0: the rows have this distance, times in the file are not used.
    decimal : str, optional
        Decimal mark of the numbers, "point" or "comma".
    soft : path-like, optional
        File of the soft channel, if the other one has the hard channel only.
    part : str, optional
        Name of the sheet of a workbook, or of the stream of an XDF file.

    Raises
    ------
    ValueError
        A value that is not allowed, or values that contradict each other.

    Examples
    --------
    >>> Asked(columns={"hard": 2, "soft": 3}, rate=38.4).given
    {'columns': {'hard': 2, 'soft': 3}, 'rate': 38.4}
    """

    columns: Mapping[str, str | int] | None = None
    unit: str | None = None
    time_unit: str | None = None
    rate: float | None = None
    decimal: str | None = None
    soft: str | os.PathLike[str] | None = None
    part: str | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        words: dict[str, Collection[str]] = {"unit": PICOFARADS, "time_unit": SECONDS, "decimal": DECIMALS}
        for name, allowed in words.items():
            value = getattr(self, name)
            if value is not None and value not in allowed:
                raise ValueError(f"{name}: {unlike(value, allowed)}")
        if self.columns is not None:
            if not {"hard", *(() if self.soft else ("soft",))} <= set(self.columns) <= set(KEYS):
                raise ValueError(
                    f"columns: got {listed(self.columns) or 'none'}, allowed: hard, soft and, if wanted, time, soft_time"
                )
            if self.rate is not None and {"time", "soft_time"} & set(self.columns):
                raise ValueError("rate: got it together with a column of times, allowed: one of them")
        if self.rate is not None and not (isinstance(self.rate, float | int) and 0 < self.rate < math.inf):
            raise ValueError(f"rate: got {quoted(self.rate)}, allowed: a number above 0, pairs a second")

    @property
    def given(self) -> dict[str, object]:
        """The values that were given, by name."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if value is not None}
