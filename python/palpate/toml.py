"""TOML that anyone may have written: what would cost time or memory is refused before it is parsed."""

from pathlib import Path
from typing import Any

from palpate.files import read_bytes

MOST_BYTES = 1_000_000
MOST_DOTS = 32
"""Dots in a line. A key cannot go on in the next line, so it has at most one part more; n parts cost n**2."""
LONGEST = 10_000
"""Characters of a line."""
MOST_ENTRIES = 100_000
_ENTRIES = ".=,[{"
"""Each part of a key, each value and each table needs one of these. 100,000 take some 100 MB at most."""


def read(path: Path) -> dict[str, Any]:
    """Return the contents of a file.

    Raises
    ------
    OSError
        As `palpate.files.read_bytes`.
    ValueError
        As `loads`; or the file is not UTF-8.
    """
    return loads(read_bytes(path, MOST_BYTES).decode())


def loads(text: str) -> dict[str, Any]:
    """Return the contents of a text.

    Raises
    ------
    ValueError
        Not TOML, or beyond a limit.

    Examples
    --------
    >>> loads("a.b = 1")
    {'a': {'b': 1}}
    >>> loads("a." * 1000 + "b = 1")
    Traceback (most recent call last):
    ValueError: line 1: got 1,000 dots, allowed: 32 in a line
    """
    import tomllib

    require_small(text)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("got arrays or tables too deep in others, allowed: some hundred levels") from None


def require_small(text: str) -> None:
    """Check the limits, in time proportional to the length.

    Raises
    ------
    ValueError
        Too long, a line too long or with too many dots, or too many entries.
    """
    if len(text) > MOST_BYTES:
        raise ValueError(f"got {len(text):,} characters, allowed: {MOST_BYTES:,}")
    for number, line in enumerate(text.split("\n"), 1):
        if len(line) > LONGEST:
            raise ValueError(f"line {number}: got {len(line):,} characters, allowed: {LONGEST:,}")
        if (dots := line.count(".")) > MOST_DOTS:
            raise ValueError(f"line {number}: got {dots:,} dots, allowed: {MOST_DOTS} in a line")
    if (entries := sum(map(text.count, _ENTRIES))) > MOST_ENTRIES:
        raise ValueError(f"got {entries:,} of the characters {_ENTRIES}, allowed: {MOST_ENTRIES:,}")
