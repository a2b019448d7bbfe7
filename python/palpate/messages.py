"""Parts of error messages and notes: values from outside as text, lists of names, similar names."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

LONGEST = 60
"""Characters of a value from outside in a message, at most."""
_LIKE = 0.7  # share of the characters of two names that agree, at least


def quoted(value: object) -> str:
    """Return a value from outside as a message quotes it: its beginning, if it is long.

    Examples
    --------
    >>> quoted("C1 (pF)"), len(quoted("9" * 1_000_000)) < 100
    ("'C1 (pF)'", True)
    """
    return shortened(repr(value))


def printable(text: str, keep: str = "") -> str:
    r"""Return a text from outside for a terminal: control and hidden characters as escapes, but for those in `keep`.

    Examples
    --------
    >>> print(printable("run\x1b[2J.csv"))
    run\x1b[2J.csv
    """
    return (
        text
        if text.isprintable()
        else "".join(c if c.isprintable() or c in keep else repr(c)[1:-1] for c in text)
    )


def shortened(text: str, most: int = LONGEST) -> str:
    """Return a text as `printable`, or its beginning and its length."""
    shown = printable(text[:most])
    return shown if len(text) <= most else f"{shown}... ({len(text):,} characters)"


def listed(names: Collection[str], most: int = 20) -> str:
    """Return names as a message lists them, separated by commas.

    Examples
    --------
    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    shown = ", ".join(shortened(name) for name, _ in zip(names, range(most), strict=False))
    return shown if len(names) <= most else f"{shown} and {len(names) - most:,} more"


def unlike(given: object, allowed: Iterable[str], what: str = "") -> str:
    """Return what a message says of a wrong name: `what` it is of, the name, the allowed ones, and the most similar one.

    Examples
    --------
    >>> print(unlike("treshold", ["drift", "threshold"]))
    got 'treshold', allowed: drift, threshold; did you mean 'threshold'?
    """
    names = list(allowed)
    got = f"got {what} {quoted(given)}" if what else f"got {quoted(given)}"
    return f"{got}, allowed: {', '.join(names) or 'none'}{nearest(given, names)}"


def nearest(given: object, allowed: Iterable[str]) -> str:
    """Return the end of a message about a wrong name: the most similar name, or nothing.

    Examples
    --------
    >>> nearest("Handeld", ["paper", "handheld"]), nearest("x", ["paper"])
    ("; did you mean 'handheld'?", '')
    """
    text = str(given)
    if len(text) > LONGEST:
        return ""
    from difflib import get_close_matches

    names = {name.casefold(): name for name in allowed}
    found = get_close_matches(text.casefold(), names, 1, _LIKE)
    return f"; did you mean {names[found[0]]!r}?" if found else ""
