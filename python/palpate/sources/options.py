"""Address and options of a source: parsing and checks, for sources of other packages, too.

A check is a function of the name and the value of an option: it returns the value in its type, or raises ValueError with
the name, the value and what is allowed. A value from the name of a source is text, one from a keyword has any type.
"""

import math
import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any
from urllib.parse import unquote

from palpate.messages import quoted, unlike

__all__ = ["Check", "anything", "checked", "choice", "number", "split", "text", "yes_no"]

Check = Callable[[str, Any], Any]  # (name, value) of an option -> checked value, or ValueError.

_YES_NO = {"1": True, "0": False, "true": True, "false": False, "yes": True, "no": False}
# A scheme has two letters or more: C:\ is a drive. An address may begin with \\?\, as long paths of Windows do.
_NAME = re.compile(r"(?:([a-z][a-z0-9+.-]+):)?((?:\\\\\?\\)?[^?]*)\??(.*)", re.DOTALL)


def split(uri: str) -> tuple[str, str, dict[str, str]]:
    """Split the name of a source into scheme, address and options.

    Parameters
    ----------
    uri : str

    Returns
    -------
    scheme, address, options
        The scheme is empty if the name is a path; a name that exists as a path has no options. In options %-escapes are decoded; a + stays a +.

    Raises
    ------
    ValueError
        An option is not NAME=VALUE, or is given twice.

    Examples
    --------
    >>> split("sim:sliding?seed=3&speed=1")
    ('sim', 'sliding', {'seed': '3', 'speed': '1'})
    >>> split("run.csv?rate=38.4")
    ('', 'run.csv', {'rate': '38.4'})
    """
    match = _NAME.fullmatch(uri)
    if os.path.exists(uri) or not match:  # noqa: PTH110  Path's raises for a long name
        return "", uri, {}
    scheme, address, query = match.groups("")
    options: dict[str, str] = {}
    for part in filter(None, query.split("&")):
        name, equals, value = part.partition("=")
        if not equals or name in options:
            raise ValueError(
                f"source: got {quoted(part)}, allowed: NAME=VALUE, each name once, & between them"
            )
        options[unquote(name)] = unquote(value)
    return scheme, address, options


def checked(scheme: str, given: Mapping[str, Any], allowed: Mapping[str, Check]) -> dict[str, Any]:
    """Return the options converted to their types.

    Parameters
    ----------
    scheme : str
        For the message.
    given : mapping
        Name -> value.
    allowed : mapping
        Name -> `Check`.

    Returns
    -------
    dict
        Name -> checked value.

    Raises
    ------
    ValueError
        An option is unknown or outside its range.

    Examples
    --------
    >>> checked("sim", {"seed": "3"}, {"seed": number(0, whole=True)})
    {'seed': 3}
    >>> checked("sim", {"sed": "3"}, {"seed": number(0, whole=True)})
    Traceback (most recent call last):
    ValueError: sim: got option 'sed', allowed: seed; did you mean 'seed'?
    """
    for name in given:
        if name not in allowed:
            raise ValueError(f"{scheme}: {unlike(name, allowed, 'option')}")
    return {name: allowed[name](name, value) for name, value in given.items()}


def number(
    low: float, high: float = math.inf, *, whole: bool = False, above: bool = False
) -> Check:
    """Return a check for numbers.

    Parameters
    ----------
    low, high : float
        Allowed range; infinity and nan are always refused.
    whole : bool
        Only integers; the value becomes an int, else a float.
    above : bool
        `low` itself is not allowed.

    Returns
    -------
    callable

    Examples
    --------
    >>> number(0, 3, whole=True)("channel", "2"), number(0, above=True)("period_s", "0.5")
    (2, 0.5)
    >>> number(0, 3, whole=True)("channel", "4")
    Traceback (most recent call last):
    ValueError: channel: got '4', allowed: a whole number from 0 to 3
    """
    kind = "a whole number" if whole else "a number"
    bounds = f"{'above' if above else 'from'} {low:.12g}" + (
        "" if math.isinf(high) else f" to {high:.12g}"
    )

    def check(name: str, value: Any) -> Any:
        found: float = math.nan
        with suppress(TypeError, ValueError, OverflowError):
            found = int(value) if whole else float(value)
        is_cut = whole and not isinstance(value, str) and found != value
        if is_cut or not low <= found <= high or found == math.inf or (above and found == low):
            raise ValueError(f"{name}: got {quoted(value)}, allowed: {kind} {bounds}")
        return found

    return check


def yes_no(name: str, value: Any) -> bool:
    """Return 1, true, yes as True and 0, false, no as False; anything else is an error.

    Examples
    --------
    >>> yes_no("chop", "yes"), yes_no("chop", 0)
    (True, False)
    """
    word = str(value).lower()
    if word not in _YES_NO:
        raise ValueError(f"{name}: got {quoted(value)}, allowed: {', '.join(_YES_NO)}")
    return _YES_NO[word]


def choice(*allowed: str) -> Check:
    """Return a check for one of these words.

    Examples
    --------
    >>> choice("slow", "fast")("speed", "fast")
    'fast'
    """

    def check(name: str, value: Any) -> str:
        if value not in allowed:
            raise ValueError(f"{name}: {unlike(value, allowed)}")
        return str(value)

    return check


def text(name: str, value: Any) -> str:
    """Return the value as text; an empty text is an error.

    Examples
    --------
    >>> text("port", "/dev/ttyUSB0")
    '/dev/ttyUSB0'
    """
    if not str(value):
        raise ValueError(f"{name}: got nothing, allowed: some text")
    return str(value)


def anything(_: str, value: Any) -> Any:
    """Return any object unchanged, for options that only Python code can pass."""
    return value
