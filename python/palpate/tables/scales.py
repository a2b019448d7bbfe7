"""The unit of the two capacitances: from the header, or by the size of the values."""

import numpy as np
from numpy.typing import NDArray

from palpate.errors import quoted
from palpate.tables.asked import Asked
from palpate.tables.roles import Side
from palpate.tables.table import Column
from palpate.tables.units import PICOFARADS, no_capacitance, unit_in

Array = NDArray[np.float64]
_SURE = {"pF": (0.05, 100.0), "F": (0.05e-12, 100e-12)}
"""Sizes that leave no doubt about a unit: gauges have some pF, and change by some tenths."""
_COUNTS = ("counts", "count", "cnt", "cnts", "raw", "lsb", "adc", "digits", "codes")
_ROUNDED = 1e-9  # of 1
_FAR = 100.0  # the two gauges of a probe differ by less


def units(hard: Side, soft: Side, values: tuple[Array, Array], asked: Asked) -> tuple[str, str, list[str]]:
    """Return the units of the hard and the soft channel, and notes.

    Raises
    ------
    ValueError
        Not a capacitance, or neither header nor size tells the unit, or the two do not fit together.
    """
    if asked.unit is not None:
        return asked.unit, asked.unit, _contradicted((hard, soft), asked.unit)
    given = [_in_header(side) for side in (hard, soft)]
    known = [unit for unit in given if unit]
    if len(known) == 2:
        told = [] if given[0] == given[1] else [f"the channels have different units: {given[0]} and {given[1]}"]
    elif known:
        named, bare = (hard, soft) if given[0] else (soft, hard)
        told = [f"no unit in the header of {bare.name}: {known[0]}, as that of {named.name}"]
    else:
        known, told = _by_size(hard, values)
    result = (given[0] or known[0], given[1] or known[0])
    _require_alike(hard, soft, values, result)
    return *result, told


def _in_header(side: Side) -> str | None:
    column, name = side.table.columns[side.value], quoted(side.table.name(side.value))
    unit, other = _said_unit(column)
    if other is None:
        return unit
    ratio = "a ratio of changes of capacitance is wanted"
    if unit is not None:
        raise ValueError(
            f"column: got {name}, with a scale, allowed: a column in one of {', '.join(PICOFARADS)}: multiply it first"
        )
    if other.casefold() in _COUNTS:
        raise ValueError(
            f"column: got {name}, in {other}, allowed: a capacitance ({ratio}); counts of one scale that are proportional "
            'to it: unit="aF" (--unit aF)'
        )
    what = "per cent" if other == "%" else other
    raise ValueError(f"column: got {name}, in {what}, allowed: a capacitance: {ratio}")


def _said_unit(column: Column) -> tuple[str | None, str | None]:
    """Return the unit of capacitance that the names of a column say, and what they say that is none, or a scale."""
    for text in filter(None, [column.unit, *reversed(column.names)]):
        unit, other = unit_in(text, PICOFARADS), no_capacitance(text)
        if other is not None:
            return ("F" if "F" in other else None), other
        if unit == "%":
            return None, unit
        if unit is not None:
            return unit, None
    return None, None


def _contradicted(channels: tuple[Side, Side], wanted: str) -> list[str]:
    """Return notes on headers that say another unit than the user."""
    notes = []
    for side in channels:
        unit, other = _said_unit(side.table.columns[side.value])
        said = other or unit
        if said is not None and PICOFARADS.get(said) != PICOFARADS[wanted]:
            notes.append(f"the header of {side.name} says {said}: {wanted} is used, as asked")
    return notes


def _size(values: Array) -> float:
    """Return the size of the larger values, but not of single wrong ones; 0 without values."""
    finite = np.abs(values[np.isfinite(values)])
    return float(np.quantile(finite, 0.99)) if len(finite) else 0.0


def _by_size(hard: Side, values: tuple[Array, Array]) -> tuple[list[str], list[str]]:
    size = max(map(_size, values))
    if size == 0.0:
        return ["pF"], []
    for unit, (low, high) in _SURE.items():
        if low <= size <= high:
            return [unit], [
                f"no unit in the header: {unit} assumed" + (", by the size of the values" if unit == "F" else "")
            ]
    raise ValueError(
        f"unit: got none in the header, and values of about {size:.3g} in {hard.name}, allowed: one of "
        f"{', '.join(dict.fromkeys(PICOFARADS))} (--unit)"
    )


def _are_surely_alike(values: tuple[Array, Array], found: tuple[str, str]) -> bool:
    """Return whether even the largest of one channel is near the smallest of the other, and no quantile is needed."""
    ends = [
        (max(low, -high) * PICOFARADS[unit], max(high, -low) * PICOFARADS[unit])
        for each, unit in zip(values, found, strict=True)
        if len(each)
        for low, high in [(float(each.min()), float(each.max()))]
    ]
    return len(ends) == 2 and all(most < _FAR / 2 * least for (_, most), (least, _) in (ends, ends[::-1]))


def are_of_one_size(hard: Side, soft: Side, spans: tuple[Array, Array], found: tuple[str, str]) -> bool:
    """Return whether `units` surely finds these units: `spans` are the smallest and the largest value of each channel."""
    if not _are_surely_alike(spans, found):
        return False
    if _in_header(hard) or _in_header(soft):
        return True
    low, high = _SURE[found[0]]
    return all(low * (1 + _ROUNDED) < each.min() and each.max() < high * (1 - _ROUNDED) for each in spans)


def _require_alike(hard: Side, soft: Side, values: tuple[Array, Array], found: tuple[str, str]) -> None:
    if _are_surely_alike(values, found):
        return
    sizes = [_size(each) * PICOFARADS[unit] for each, unit in zip(values, found, strict=True)]
    if min(sizes) > 0 and max(sizes) / min(sizes) > _FAR:
        raise ValueError(
            f"unit: got about {sizes[0]:.3g} pF in {hard.name} and {sizes[1]:.3g} pF in {soft.name}, allowed: channels "
            "of similar size; if this is right, give their unit (--unit)"
        )
