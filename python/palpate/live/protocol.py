"""Messages from a page and to a page. Every other message is refused."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NoReturn

LONGEST = 8192  # bytes of a message
LONGEST_TEXT = 200  # characters of a mark, a name, a note
LONGEST_PLAN = 4000  # characters of a list of specimens
FEWEST_ROWS, ROWS = 16, 4096
"""Rows of a view, at least and at most."""
LARGEST_S = 1e12


class Refused(ValueError):
    """The message is not valid, or not possible now. The text says what is allowed."""


@dataclass(frozen=True)
class Command:
    """One message of a page.

    Attributes
    ----------
    do : str
        One of `COMMANDS`.
    given : dict
        The values that it needs, checked; those that may be left out are missing then.
    """

    do: str
    given: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Any:
        """Return a value."""
        return self.given[name]


def parse(message: str | bytes) -> Command:
    """Return the command of a message.

    Raises
    ------
    Refused
        The message is not a valid command.

    Examples
    --------
    >>> parse('{"do": "note", "text": "second specimen"}')
    Command(do='note', given={'text': 'second specimen'})
    >>> parse('{"do": "format the disk"}')  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    palpate.live.protocol.Refused: do: got 'format the disk', allowed: tare, tare anyway, ...
    """
    given = _object(message)
    do = given.pop("do", None)
    if not isinstance(do, str) or do not in COMMANDS:
        _refuse("do", do, ", ".join(COMMANDS))
    checked: dict[str, Any] = {}
    for name, check in COMMANDS[do].items():
        bare = name.rstrip("?")
        if bare in given or bare == name:
            checked[bare] = check(bare, given.pop(bare, None))
    if given:
        _refuse("message", min(given), f"no further names for {do}")
    return Command(do, checked)


def told(kind: str, /, **what: Any) -> str:
    """Return a message to a page: JSON, with null for nan and inf.

    Examples
    --------
    >>> told("state", ratio=float("nan"), touches=[1.5])
    '{"type": "state", "ratio": null, "touches": [1.5]}'
    """
    return json.dumps({"type": kind, **_plain(what)}, allow_nan=False)


def _object(message: str | bytes) -> dict[str, Any]:
    if isinstance(message, bytes):
        _refuse("message", f"{len(message)} bytes", "text")
    if len(message) > LONGEST:
        _refuse("message", f"{len(message)} characters", f"{LONGEST} at most")
    try:
        given = json.loads(message)
    except (ValueError, RecursionError):
        _refuse("message", message, "JSON")
    if not isinstance(given, dict):
        _refuse("message", given, 'an object, for example {"do": "tare"}')
    return given


Check = Callable[[str, Any], Any]


def _text(most: int, least: int = 1, *, lines: bool = False) -> Check:
    def check(name: str, text: Any) -> str:
        kind = "characters in lines" if lines else "printable characters"
        known = isinstance(text, str) and least <= len(text.strip()) <= most
        if not known or not all(part.isprintable() for part in _parts(text, lines=lines)):
            _refuse(name, text, f"{least} to {most} {kind}")
        return str(text).strip()

    return check


def _parts(text: str, *, lines: bool) -> list[str]:
    return text.replace("\t", " ").splitlines() if lines else [text]


def _whole(least: int, most: int) -> Check:
    def check(name: str, value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
            _refuse(name, value, f"a whole number from {least} to {most}")
        return value

    return check


def _seconds(name: str, value: Any) -> float:
    known = isinstance(value, int | float) and not isinstance(value, bool)
    if not known or not -LARGEST_S <= value <= LARGEST_S:
        _refuse(name, value, "a time, s")
    return float(value)


def _flag(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        _refuse(name, value, "true or false")
    return value


_ID = _whole(0, 2**32 - 1)
_NAME = _text(LONGEST_TEXT)
_MAYBE = _text(LONGEST_TEXT, 0)
COMMANDS: dict[str, dict[str, Check]] = {
    "tare": {},
    "tare anyway": {},
    "record": {"name?": _NAME},
    "stop": {},
    "again": {},
    "mark": {},
    "mark text": {"id": _ID, "text": _MAYBE},
    "note": {"text": _NAME},
    "centre": {},
    "device": {"capf?": _whole(0, 7), "excitation?": _NAME},
    "plan": {
        "text": _text(LONGEST_PLAN, 0, lines=True),
        "wanted": _whole(1, 99),
        "title?": _MAYBE,
        "operator?": _MAYBE,
    },
    "specimen": {"name": _MAYBE},
    "assign": {"touch": _ID, "name": _MAYBE},
    "discard": {"touch": _ID},
    "keep": {"touch": _ID},
    "more": {},
    "calibrating": {"on": _flag},
    "save calibration": {"name?": _NAME},
    "report": {},
    "noise": {"on": _flag},
    "trace": {"touch": _ID},
    "view": {"id": _ID, "from_s": _seconds, "to_s": _seconds, "rows": _whole(FEWEST_ROWS, ROWS)},
    "seen": {"frame": _ID},
}
"""The commands of a page, with the values that each needs; with a question mark: may be left out."""


def _refuse(name: str, value: Any, allowed: str) -> NoReturn:
    try:
        shown = ascii(value)
    except (ValueError, RecursionError):  # a number with too many digits
        shown = "a value too long to show"
    shown = shown if len(shown) <= 60 else f"{shown[:57]}..."
    raise Refused(f"{name}: got {shown}, allowed: {allowed}")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
