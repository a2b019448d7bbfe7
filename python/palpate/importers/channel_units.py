"""The units of the two channels of a table: as wanted, as stated, or by the size of the values."""

from dataclasses import dataclass

import numpy as np

from palpate.importers.table import Array, Column, Option, OptionError, ReadOptions
from palpate.importers.units import PICOFARADS
from palpate.messages import quoted

# Sizes of gauges, which have some pF, in the units that need no name.
_PROBABLE_SIZES = {"pF": (0.05, 100.0), "F": (0.05e-12, 100e-12)}
_LARGEST_QUOTIENT = 100.0  # the two gauges of a probe differ by less
_SIZE_ROWS = 10_000  # that show the size of all
_SIZE_QUANTILE = 0.99  # not the largest value, which may be a wrong one
_ALLOWED_UNITS = ", ".join(PICOFARADS)
_OTHER_SIGNALS = "two signals of another kind: their unit, as --unit counts"


@dataclass(frozen=True)
class ChannelUnits:
    """The units of the hard and the soft channel, and notes on those that were not stated."""

    hard: str
    soft: str
    notes: list[str]


def channel_units(
    hard: Column, soft: Column, hard_values: Array, soft_values: Array, options: ReadOptions
) -> ChannelUnits:
    """Return the units of both channels: as wanted, as stated, or by the size of the values."""
    columns = (hard, soft)
    if options.unit:
        return _wanted_units(columns, options.unit)
    for column in columns:
        if column.stated_unit and not column.in_farads:
            got = f"{quoted(column.name)}, in {column.stated_unit}"
            allowed = f"a capacitance in one of {_ALLOWED_UNITS}, without a scale; {_OTHER_SIGNALS}"
            raise OptionError(Option.COLUMN, got, allowed)
    sizes = [_typical_size(hard_values), _typical_size(soft_values)]
    stated = hard.stated_unit or soft.stated_unit
    if stated:
        unit = stated
        reason = f"{unit}, as the other channel"
    else:
        unit = _unit_by_size(hard, max(sizes))
        reason = f"{unit} assumed, by the size of the values"
    units = ChannelUnits(hard.stated_unit or unit, soft.stated_unit or unit, notes=[])
    for column in columns:
        if not column.stated_unit:
            units.notes.append(f"no unit in the header of {column.label}: {reason}")
    _require_similar_sizes(columns, sizes, units)
    return units


def _wanted_units(columns: tuple[Column, Column], wanted: str) -> ChannelUnits:
    """Return one wanted unit for both channels, with a note where a header has another one."""
    notes = []
    for column in columns:
        stated = column.stated_unit or wanted
        # Units of one scale are equal (uF and µF); units of other signals have no scale.
        if PICOFARADS.get(stated, stated) != PICOFARADS.get(wanted, wanted):
            header = f"the header of {column.label} says {stated}"
            notes.append(f"{header}: {wanted} is used, as asked")
    return ChannelUnits(wanted, wanted, notes)


def _typical_size(values: Array) -> float:
    """Return the magnitude of nearly all values; 0 without a value."""
    some = np.abs(values[:: max(1, len(values) // _SIZE_ROWS)])
    some = some[np.isfinite(some)]
    if not len(some):
        return 0.0
    return float(np.quantile(some, _SIZE_QUANTILE))


def require_probable_pF(hard: Array, soft: Array) -> None:
    """Check that the values of both channels may be those of gauges, in pF.

    Raises
    ------
    ValueError
        They are smaller or larger.
    """
    size = max(_typical_size(hard), _typical_size(soft))
    low, high = _PROBABLE_SIZES["pF"]
    if size and not low <= size <= high:
        capacitances = f"the unit of capacitances, one of {_ALLOWED_UNITS}"
        allowed = f"{capacitances}, or of other signals, as unit='N'"
        raise ValueError(f"unit: got none, and values of about {size:.3g}, allowed: {allowed}")


def _unit_by_size(hard: Column, size: float) -> str:
    for unit, (low, high) in _PROBABLE_SIZES.items():
        if size == 0 or low <= size <= high:
            return unit
    got = f"none in the header, and values of about {size:.3g} in {hard.label}"
    raise OptionError(Option.UNIT, got, f"one of {_ALLOWED_UNITS} (--unit); {_OTHER_SIGNALS}")


def _require_similar_sizes(
    columns: tuple[Column, Column], sizes: list[float], units: ChannelUnits
) -> None:
    """Refuse channels of which one probably has another unit than it says."""
    sizes_pF = [sizes[0] * PICOFARADS[units.hard], sizes[1] * PICOFARADS[units.soft]]
    if min(sizes_pF) > 0 and max(sizes_pF) / min(sizes_pF) > _LARGEST_QUOTIENT:
        found = []
        for size_pF, column in zip(sizes_pF, columns, strict=True):
            found.append(f"{size_pF:.3g} pF in {column.label}")
        advice = "write the unit into each head, as C2 (pF); if it is one of both, give it (--unit)"
        allowed = f"channels of similar size: {advice}"
        raise OptionError(Option.UNIT, f"about {' and '.join(found)}", allowed)
