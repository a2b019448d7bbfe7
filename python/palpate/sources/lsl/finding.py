"""The search for streams of Lab Streaming Layer."""

import time
from collections.abc import Callable, Mapping
from typing import Any

from palpate.errors import DeviceNotFound, listed, quoted, shortened
from palpate.sources.lsl.library import library

WAIT_S = 5.0
_POLL_S = 0.05
_OTHERS_S = 1.0
"""After each stream the search waits so long for others that match, too: LSL asks twice in this time."""

PROPERTIES = {"name": "name", "type": "type", "source_id": "source_id", "host": "hostname"}
"""Options that choose a stream -> property of LSL."""


def search(
    wanted: Mapping[str, str],
    limit_s: float,
    stopped: Callable[[], bool] = lambda: False,
    others_s: float | None = None,
) -> list[Any]:
    """Return all streams with these properties that answer; empty after the limit, or if `stopped`.

    Parameters
    ----------
    wanted : mapping
        Property of LSL -> value; empty: any stream.
    limit_s : float
        Longest time until the first answer, s.
    stopped : callable
    others_s : float
        Longest time from one answer to the next, s.

    Returns
    -------
    list of pylsl.StreamInfo
        Without their descriptions; sorted.
    """
    predicate = " and ".join(f"{name}={_literal(name, value)}" for name, value in wanted.items())
    pylsl = library()
    resolver = pylsl.ContinuousResolver(pred=predicate) if predicate else pylsl.ContinuousResolver()
    found: list[Any] = []
    until = time.monotonic() + limit_s
    while time.monotonic() < until and not stopped():
        answered = resolver.results()
        if len(answered) > len(found):
            found, until = answered, time.monotonic() + (_OTHERS_S if others_s is None else others_s)
        time.sleep(_POLL_S)
    return sorted(found, key=told)


def only(wanted: Mapping[str, str], limit_s: float) -> Any:
    """Return the one stream with these properties.

    Raises
    ------
    DeviceNotFound
        There is none, or there are several.
    """
    found = search(wanted, limit_s)
    asked = ", ".join(f"{name} {quoted(value)}" for name, value in wanted.items())
    if not found:
        raise DeviceNotFound(
            f"lsl: no stream with {asked} answered within {limit_s:g} s: is it running, in the same network? "
            "`palpate devices --lsl` lists those that answer"
        )
    if len(found) > 1:
        there = listed([told(info) for info in found])
        raise DeviceNotFound(
            f"lsl: {len(found)} streams have {asked}: {there}; choose one by its name and ?type=, source_id= or host="
        )
    return found[0]


def told(info: Any) -> str:
    """Return a stream as a message shows it."""
    marked = f", source_id {quoted(info.source_id())}" if info.source_id() else ""
    return f"{shown(info.name())} ({shown(info.type()) or 'no type'}, on {shown(info.hostname())}{marked})"


def shown(text: str) -> str:
    r"""Return a text from the network as a terminal may show it.

    Examples
    --------
    >>> shown("EEG"), shown("EEG\x1b[2J")
    ('EEG', "'EEG\\x1b[2J'")
    """
    return shortened(text) if text.isprintable() else quoted(text)


def _literal(name: str, value: str) -> str:
    """Return a text in the quotes of XPath 1.0, which has no escapes."""
    if '"' in value and "'" in value:
        raise ValueError(f"{name}: got {quoted(value)}, allowed: no text with both kinds of quotes")
    return f"'{value}'" if '"' in value else f'"{value}"'
