"""Options that read lines which are not read: each one is tried on them before it is said."""

import re
from collections.abc import Iterable

from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Format, Given, decoded
from palpate.sources.serial.names import column

_NUMBER = r"[-+0-9.eE]+"
_PART = re.compile(
    r"([A-Za-z_][A-Za-z0-9_]*+)([ :=]++)[-+]?+(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][-+]?+[0-9]++)?+(?![0-9.])"
    r"(?:( ?)([afpnum]?F)(?![A-Za-z]))?+([ ,;/|]*+)"
)
"""A name, a number, and perhaps a unit of capacitance; then what separates it from the next."""


def pattern_for(lines: Iterable[str]) -> str:
    """Return the option `pattern` that reads these lines, of one channel each or of both; empty: none was found.

    Examples
    --------
    >>> pattern_for(["hard 6.7", "soft 4.4"])
    'pattern=hard (?P<hard>[-+0-9.eE]+)|soft (?P<soft>[-+0-9.eE]+)'
    """
    texts = [decoded(line) for line in lines]
    found: dict[frozenset[str], str] = {}
    for text in texts:
        channels, pattern = _of_line(text)
        found.setdefault(channels, pattern)
    both = found.get(frozenset({"hard", "soft"}), "")
    halves = [found.get(frozenset({name}), "") for name in ("hard", "soft")]
    pattern = both or ("|".join(halves) if all(halves) else "")
    return f"pattern={pattern}" if pattern and _reads(pattern, texts) else ""


def _of_line(text: str) -> tuple[frozenset[str], str]:
    """Return the channels of a line, and a pattern for it; no channel: it is none, or has one twice."""
    at, pattern, channels = 0, "", []
    while at < len(text):
        part = _PART.match(text, at)
        if not part:
            return frozenset(), ""
        label, sign, blank, unit, after = part.groups(default="")
        role = _role(label)
        group = _NUMBER
        if role:
            channels.append(role)
            group = f"(?P<{role}{'_' * bool(unit)}{unit}>{_NUMBER})"
        pattern += f"{label}{sign}{group}{blank}{unit}{after.replace('|', '[|]')}"
        at = part.end()
    twice = len(set(channels)) < len(channels)
    return frozenset() if twice else frozenset(channels), pattern


def _role(label: str) -> str:
    try:
        role, unit = column(label)
    except Refused:
        return ""
    return role if role in ("hard", "soft") and not unit else ""


def _reads(pattern: str, texts: list[str]) -> bool:
    """Return whether a pattern reads both channels from the lines."""
    given = Given(pattern=re.compile(pattern))
    seen: set[str] = set()
    for text in texts:
        try:
            seen |= Format(given.groups, given).read(text).keys()
        except Refused:
            continue
    return seen >= {"hard", "soft"}
