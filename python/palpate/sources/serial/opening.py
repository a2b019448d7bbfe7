"""The options of `serial:`."""

import re
from collections.abc import Mapping
from typing import Any

from palpate.errors import quoted
from palpate.sources.options import Check, checked, choice, number, text, yes_no
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Given, require_pair, require_units
from palpate.sources.serial.names import Column, column
from palpate.sources.serial.port import LONGEST, Port
from palpate.sources.serial.source import SerialSource
from palpate.tables.units import PICOFARADS


def open_serial(address: str, options: Mapping[str, Any]) -> SerialSource:
    """Return the source of `serial:PORT`."""
    given = checked("serial", options, {**_OF_LINES, **_OF_PORT})
    lines = said(given)
    port = {name: given[name] for name in _OF_PORT if name in given}
    return SerialSource(Port(text("serial's port", address), **port), lines)


def said(given: Mapping[str, Any]) -> Given:
    """Return what checked options say about the lines."""
    if {"columns", "pattern"} <= set(given):
        raise ValueError("columns: got a pattern, too, allowed: one of them; the groups of a pattern are its columns")
    return Given(**{name: given[name] for name in _OF_LINES if name in given})


def _columns(name: str, value: Any) -> tuple[Column, ...]:
    names = [part.strip() for part in str(value).split(",")]
    try:
        return _complete(names)
    except Refused as error:
        allowed = "names of all cells in order, separated by commas, with hard and soft, for example t_ms,hard,soft"
        raise ValueError(f"{name}: got {quoted(str(value))}, allowed: {allowed} ({error})") from error


def _complete(names: list[str]) -> tuple[Column, ...]:
    """Return the columns of these names: with both channels, and their units. Raises Refused."""
    found = tuple(map(column, names))
    require_pair(found)
    require_units(found)
    return found


def _pattern(name: str, value: Any) -> "re.Pattern[str]":
    if len(str(value)) > LONGEST:
        raise ValueError(f"{name}: got {len(str(value)):,} characters, allowed: {LONGEST}")
    try:
        found = re.compile(str(value))
    except (re.error, OverflowError, RecursionError) as error:
        raise ValueError(f"{name}: got {quoted(value)}, allowed: a regular expression ({error})") from error
    groups = list(found.groupindex)
    try:
        _complete(groups)
    except Refused as error:
        allowed = "both (?P<hard>...) and (?P<soft>...), and others named as columns are"
        raise ValueError(f"{name}: got groups {quoted(sorted(groups))}, allowed: {allowed} ({error})") from error
    return found


def _decimal(name: str, value: Any) -> str:
    return {"comma": ",", "point": "."}[choice("comma", "point")(name, value)]


_OF_LINES: dict[str, Check] = {
    "columns": _columns,
    "pattern": _pattern,
    "unit": choice(*PICOFARADS),
    "decimal": _decimal,
    "code_pF": number(0, above=True),
}
_OF_PORT: dict[str, Check] = {
    "baud": number(50, 4_000_000, whole=True),
    "reset": yes_no,
    "replug": number(0, 86400),
}
