"""Units beside the numbers of a table: in the same cell, or in the next one."""

from collections.abc import Sequence

from palpate.errors import quoted
from palpate.tables.cell.decimals import written
from palpate.tables.cell.kinds import NONE, NUMBER, kind
from palpate.tables.cell.numbers import UNITS
from palpate.tables.table import Column
from palpate.tables.units import unit_in


def column_of(names: tuple[str, ...], cells: Sequence[str | None], notes: list[str]) -> Column:
    """Return a column; the unit that all its numbers have is taken from the cells, others stay there."""
    first = next((cell for cell in cells if cell and kind(cell) != NONE), "")
    number = written(first) if kind(first) == NUMBER else None
    found = unit_in(number.unit, UNITS) if number else None
    if not found or found == "%":
        return Column(names, cells)
    bare = [_without(cell, found) for cell in cells]
    if any(cell is None for cell in bare):
        return Column(names, cells)
    named = next((unit for name in reversed(names) if (unit := unit_in(name, UNITS))), found)
    if named != found:
        notes.append(f"{quoted(names[-1])}: its cells have the unit {found}, which is used, not {named}")
    return Column(names, bare, found)


def _without(cell: str | None, unit: str) -> str | None:
    """Return a cell without its unit; None if it has another one."""
    if cell is None or kind(cell) == NONE:
        return cell
    number = written(cell)
    same = number and unit_in(number.unit, UNITS) == unit
    return cell[: -len(number.unit)].rstrip() if number and same else None


def joined_units(columns: list[Sequence[str | None]], pattern: Sequence[bool]) -> list[Sequence[str | None]]:
    """Return columns; where all cells of the column on the right are units, the numbers have them."""
    found: list[Sequence[str | None]] = []
    for column, cells in enumerate(columns):
        following = columns[column + 1] if column + 1 < len(columns) else ()
        has_unit = (*pattern, *[False] * len(columns))[column] and all(map(_is_unit, set(following))) and following
        found.append([f"{cell} {unit}" for cell, unit in zip(cells, following, strict=True)] if has_unit else cells)
    return found


def _is_unit(cell: str | None) -> bool:
    """Return whether a cell is a unit; one letter may be a status."""
    return cell in UNITS and len(cell) > 1
