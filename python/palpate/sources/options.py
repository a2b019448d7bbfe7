"""Names and options of sources: parsing and checks, for sources of other packages, too.

A check is a function of the name and the value of an option: it returns the value in its type, or
raises ValueError with the name, the value and the allowed values. A value from the name of a source
is text; a value from a keyword has any type.
"""

import math
import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeVar
from urllib.parse import unquote

from palpate.messages import quoted, unlike

T = TypeVar("T")
D = TypeVar("D")
Check = Callable[[str, Any], T]  # (name, value) of an option -> checked value, or ValueError.

LONGEST = 10_000  # characters of the name of a source, with its options
_YES_NO = {"1": True, "0": False, "true": True, "false": False, "yes": True, "no": False}
# A scheme has two letters or more: C:\ is a drive. A long path of Windows begins with \\?\.
_NAME = re.compile(r"(?:([a-z][a-z0-9+.-]+):)?((?:\\\\\?\\)?[^?]*)\??(.*)", re.DOTALL)


class SourceName(NamedTuple):
    """The parts of the name of a source; the scheme of a path is ""."""

    scheme: str
    address: str
    options: dict[str, str]


def split(uri: str) -> SourceName:
    """Split the name of a source into scheme, address and options.

    Parameters
    ----------
    uri : str

    Returns
    -------
    SourceName
        The scheme is empty if the name is a path; a name that exists as a path has no options. In
        options %-escapes are decoded; a + stays a +.

    Raises
    ------
    ValueError
        The name is too long; an option is not NAME=VALUE, or is there twice.

    Examples
    --------
    >>> split("sim:sliding?seed=3&speed=1").options
    {'seed': '3', 'speed': '1'}
    >>> split("run.csv?rate=38.4")
    SourceName(scheme='', address='run.csv', options={'rate': '38.4'})
    """
    if len(uri) > LONGEST:
        raise ValueError(f"source: got {len(uri):,} characters, allowed: {LONGEST:,}: shorten it")
    match = _NAME.fullmatch(uri)
    if os.path.exists(uri) or not match:  # noqa: PTH110  Path's raises for a long name
        return SourceName("", uri, {})
    scheme, address, query = match.groups("")
    options: dict[str, str] = {}
    for part in filter(None, query.split("&")):
        name, equals, value = part.partition("=")
        if not equals or name in options:
            raise ValueError(
                f"source: got {quoted(part)}, allowed: NAME=VALUE, each name once, & between them"
            )
        options[unquote(name)] = unquote(value)
    return SourceName(scheme, address, options)


def is_file(source: str) -> bool:
    """Return whether a source is a recording to read as a whole, not one to play or a device.

    Examples
    --------
    >>> is_file("run.csv"), is_file("run.csv?speed=1"), is_file("sim:tremor")
    (True, False, False)
    """
    scheme, _, options = split(source)
    return "speed" not in options and (scheme == "" or is_path(source))


def is_path(source: str) -> bool:
    """Return whether there is a file or a folder of this name; an address may be too long for one.

    Examples
    --------
    >>> is_path("sim:tremor?fault=" + ",".join(["sleep:1@3"] * 40))
    False
    """
    try:
        return Path(source).exists()
    except OSError:
        return False


@dataclass(frozen=True)
class Options:
    """Options of a source: a frozen dataclass that derives from this one has a field for each.

    A field that is no `option` has no check; it is for an object that only Python code can pass.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class ProbeOptions(Options):
    ...     channel: int = option(whole_number(1, 4), 1)
    ...     chop: bool = option(yes_no, False)
    >>> ProbeOptions.parse("probe", {"channel": "3"})
    ProbeOptions(channel=3, chop=False)
    >>> ProbeOptions.parse("probe", {"chanel": "3"})
    Traceback (most recent call last):
    ValueError: probe: got option 'chanel', allowed: channel, chop; did you mean 'channel'?
    """

    @classmethod
    def parse(cls, scheme: str, values: Mapping[str, object]) -> Self:
        """Return the options with these values, converted to their types.

        Parameters
        ----------
        scheme : str
            For the message.
        values : mapping
            Name -> value.

        Returns
        -------
        Options

        Raises
        ------
        ValueError
            An option is unknown or outside its range.
        """
        checks = {each.name: each.metadata.get("check") for each in fields(cls)}
        for name in values:
            if name not in checks:
                raise ValueError(f"{scheme}: {unlike(name, checks, 'option')}")
        checked = {}
        for name, value in values.items():
            check = checks[name]
            if check:
                value = check(name, value)
            checked[name] = value
        return cls(**checked)


def option(check: Check[T], default: D) -> T | D:
    """Return a field of `Options` with its check and its default.

    Parameters
    ----------
    check : callable
        A check of this module, or a function (name, value) of your own.
    default : object
        The value of an option that is not set; it is not checked.

    Returns
    -------
    dataclasses.Field
    """
    return field(default=default, metadata={"check": check})


def number(low: float, high: float = math.inf, *, above: bool = False) -> Check[float]:
    """Return a check for numbers.

    Parameters
    ----------
    low, high : float
        Allowed range; infinity and nan are always refused.
    above : bool
        `low` itself is not allowed.

    Returns
    -------
    callable

    Examples
    --------
    >>> number(0, above=True)("period_s", "0.5")
    0.5
    """
    allowed = f"a number {'above' if above else 'from'} {low:.12g}"
    if high < math.inf:
        allowed += f" to {high:.12g}"

    def check(name: str, value: Any) -> float:
        result = math.nan
        with suppress(TypeError, ValueError, OverflowError):
            result = float(value)
        is_excluded = math.isinf(result) or (above and result == low)
        if is_excluded or not low <= result <= high:
            raise ValueError(f"{name}: got {quoted(value)}, allowed: {allowed}")
        return result

    return check


def whole_number(low: int, high: int) -> Check[int]:
    """Return a check for whole numbers.

    Parameters
    ----------
    low, high : int
        Allowed range.

    Returns
    -------
    callable

    Examples
    --------
    >>> whole_number(0, 3)("channel", "2")
    2
    >>> whole_number(0, 3)("channel", "4")
    Traceback (most recent call last):
    ValueError: channel: got '4', allowed: a whole number from 0 to 3
    """

    def check(name: str, value: Any) -> int:
        with suppress(TypeError, ValueError, OverflowError):
            result = int(value)
            is_whole = isinstance(value, str) or result == value
            if is_whole and low <= result <= high:
                return result
        allowed = f"a whole number from {low:.12g} to {high:.12g}"
        raise ValueError(f"{name}: got {quoted(value)}, allowed: {allowed}")

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


def choice(*allowed: str) -> Check[str]:
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
