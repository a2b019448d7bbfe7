"""Messages from a page and to a page. Every other message is refused."""

import json
import math
from dataclasses import dataclass
from typing import Any, NoReturn

LONGEST = 4096  # bytes of a message
LONGEST_TEXT = 200  # characters of a mark
PLAIN = ("tare", "tare anyway", "record", "stop", "again")
"""Commands without parameters: measure the baseline again, also in contact; begin and end a recording; start a new
measurement."""


class Refused(ValueError):
    """The message is not valid, or not possible now. The text says what is allowed."""


@dataclass(frozen=True)
class Command:
    """One message of a page.

    Attributes
    ----------
    do : str
        One of `PLAIN`, "mark", or "seen".
    text : str
        Text of a mark.
    frame : int
        Number of the newest frame that the page has received.
    """

    do: str
    text: str = ""
    frame: int = 0


def parse(message: str | bytes) -> Command:
    """Return the command of a message.

    Raises
    ------
    Refused
        The message is not a valid command.

    Examples
    --------
    >>> parse('{"do": "mark", "text": "second specimen"}')
    Command(do='mark', text='second specimen', frame=0)
    >>> parse('{"do": "format the disk"}')
    Traceback (most recent call last):
    palpate.live.protocol.Refused: do: got 'format the disk', allowed: tare, tare anyway, record, stop, again, mark, seen
    """
    given = _object(message)
    do = given.pop("do", None)
    if do == "mark":
        command = Command("mark", text=_text(given.pop("text", None)))
    elif do == "seen":
        command = Command("seen", frame=_frame(given.pop("frame", None)))
    elif do in PLAIN:
        command = Command(str(do))
    else:
        _refuse("do", do, ", ".join((*PLAIN, "mark", "seen")))
    if given:
        _refuse("message", min(given), f"no further names for {do}")
    return command


def told(kind: str, **what: Any) -> str:
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


def _text(text: Any) -> str:
    if not isinstance(text, str) or not 0 < len(text.strip()) <= LONGEST_TEXT or not text.isprintable():
        _refuse("text", text, f"1 to {LONGEST_TEXT} printable characters")
    return text.strip()


def _frame(frame: Any) -> int:
    if not isinstance(frame, int) or isinstance(frame, bool) or not 0 <= frame < 2**32:
        _refuse("frame", frame, "a whole number from 0, below 2**32")
    return frame


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
