"""The options of `serial:`."""

import re
from collections.abc import Mapping
from typing import Any

from palpate.errors import quoted
from palpate.recording.table import PICOFARADS
from palpate.sources.options import Check, checked, choice, number, text
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Given, require_pair, require_units
from palpate.sources.serial.names import Column, column
from palpate.sources.serial.port import LONGEST, Port
from palpate.sources.serial.source import SerialSource


def open_serial(address: str, options: Mapping[str, Any]) -> SerialSource:
    """Return the source of `serial:PORT`."""
    given = checked("serial", options, _ALLOWED)
    lines = {name: given.pop(name) for name in ("columns", "pattern", "unit", "decimal", "code_pF") if name in given}
    if {"columns", "pattern"} <= set(lines):
        raise ValueError("columns: got a pattern, too, allowed: one of them; the groups of a pattern are its columns")
    lines["decimal"] = {"comma": ",", "point": ".", None: ""}[lines.get("decimal")]
    port = Port(
        text("serial's port", address),
        given.get("baud", 115200),
        given.get("replug", 30.0),
        reset=given.get("reset", "yes") == "yes",
    )
    return SerialSource(port, Given(**lines))


def _columns(name: str, value: Any) -> tuple[Column, ...]:
    names = [part.strip() for part in str(value).split(",")]
    try:
        found = tuple(map(column, names))
        require_pair(found)
        require_units(found)
    except Refused as error:
        allowed = "names of all cells in order, separated by commas, with hard and soft, for example t_ms,hard,soft"
        raise ValueError(f"{name}: got {quoted(str(value))} ({error}), allowed: {allowed}; - is not used") from error
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
        columns = tuple(map(column, groups))
        require_pair(columns)
        require_units(columns)
    except Refused as error:
        allowed = "both (?P<hard>...) and (?P<soft>...), and others named as columns are"
        raise ValueError(f"{name}: got groups {quoted(sorted(groups))} ({error}), allowed: {allowed}") from error
    return found


_ALLOWED: dict[str, Check] = {
    "columns": _columns,
    "pattern": _pattern,
    "unit": choice(*PICOFARADS),
    "decimal": choice("comma", "point"),
    "code_pF": number(0, above=True),
    "baud": number(50, 4_000_000, whole=True),
    "reset": choice("yes", "no"),
    "replug": number(0, 86400),
}
