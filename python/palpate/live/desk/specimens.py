"""The list of specimens as a user types, pastes or loads it."""

import re

from palpate.errors import quoted
from palpate.live.protocol import Refused
from palpate.recording.session import Specimen
from palpate.tables.cell.numbers import to_number

MOST = 200
"""Specimens of a list."""
LONGEST = 80
"""Characters of a name."""
LARGEST_MPa = 1e6
"""Of a modulus: steel has 2e5."""
_FORM = "a line for each specimen: its name, or its name, a semicolon and its modulus in MPa, as 30 OO; 0.143"


def specimens_of(text: str, wanted: int) -> list[Specimen]:
    r"""Return the specimens of a list: one in each line, "name" or "name; modulus in MPa"; also with a tab or a comma.

    The decimal point may be a comma. A first line with the names of the columns is left out, and so are empty lines.

    Parameters
    ----------
    text : str
    wanted : int
        How many touches of each are wanted.

    Raises
    ------
    Refused
        The list has a line that is not of this form, or a name twice; the text says which line, and what is allowed.

    Examples
    --------
    >>> [(one.name, one.modulus_MPa) for one in specimens_of("30 OO; 0,143\ngel 7\n70 A\t8.68", 4)]
    [('30 OO', 0.143), ('gel 7', None), ('70 A', 8.68)]
    >>> specimens_of("30 OO\n30 OO", 4)
    Traceback (most recent call last):
    palpate.live.protocol.Refused: line 2: got '30 OO' again, which is in line 1, allowed: each name once
    """
    found: dict[str, tuple[int, Specimen]] = {}
    for number, line in enumerate(text.splitlines(), 1):
        name, modulus = _cells(line)
        if not (name or modulus) or (not found and _is_heading(modulus)):
            continue
        if name in found:
            raise Refused(
                f"line {number}: got {quoted(name)} again, which is in line {found[name][0]}, allowed: each name once"
            )
        found[name] = (number, _specimen(number, name, modulus, wanted))
    if len(found) > MOST:
        raise Refused(f"text: got {len(found)} specimens, allowed: {MOST} at most")
    return [specimen for _, specimen in found.values()]


def _cells(line: str) -> tuple[str, str]:
    """Return name and modulus, as text; of a line without a tab and a semicolon the first comma is between them."""
    between = next((mark for mark in "\t;" if mark in line), ",")
    name, _, modulus = line.partition(between)
    return name.strip().strip('"').strip(), modulus.strip().strip('"').strip(" \t;")


def _is_heading(modulus: str) -> bool:
    return bool(re.search("modul|mpa", modulus, re.IGNORECASE)) and not re.search(r"\d", modulus)


def _specimen(number: int, name: str, modulus: str, wanted: int) -> Specimen:
    if not 1 <= len(name) <= LONGEST:
        raise Refused(f"line {number}: got {quoted(name)} as a name, allowed: 1 to {LONGEST} characters; {_FORM}")
    try:
        return Specimen(name, _modulus(modulus) if modulus else None, wanted)
    except ValueError as error:
        raise Refused(
            f"line {number}: got {quoted(modulus)} as the modulus of {quoted(name)}, allowed: a number above 0, "
            f"{LARGEST_MPa:g} at most, in MPa; {_FORM}"
        ) from error


def _modulus(text: str) -> float:
    number = to_number(text[:-3].rstrip() if text.lower().endswith("mpa") else text)
    if not 0 < number <= LARGEST_MPa:
        raise ValueError(text)
    return number
