"""Parts of error messages and notes: values from outside as text, lists of names, similar names."""

from __future__ import annotations

from itertools import islice

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

LONGEST = 60
"""Characters of a value from outside in a message, at most."""
_LIKE = 0.7  # share of the characters of two names that agree, at least


def quoted(value: object) -> str:
    """Return a value from outside as a quoted text: only its beginning, if it is long.

    Examples
    --------
    >>> quoted("C1 (pF)"), len(quoted("9" * 1_000_000)) < 100
    ("'C1 (pF)'", True)
    """
    return shortened(repr(value))


def printable(text: str, keep: str = "") -> str:
    r"""Return a text from outside for a terminal, with escapes for control and hidden characters.

    The characters in `keep` stay.

    Examples
    --------
    >>> print(printable("run\x1b[2J.csv"))
    run\x1b[2J.csv
    """
    if text.isprintable():
        return text
    shown = ""
    for character in text:
        if character.isprintable() or character in keep:
            shown += character
        else:
            shown += repr(character)[1:-1]
    return shown


def shortened(text: str, limit: int = LONGEST) -> str:
    """Return a text as `printable`, or its beginning and its length."""
    shown = printable(text[:limit])
    if len(text) > limit:
        shown += f"... ({len(text):,} characters)"
    return shown


def listed(names: Collection[str], limit: int = 20) -> str:
    """Return names separated by commas; above the limit, the number of the others.

    Examples
    --------
    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    shown = ", ".join(map(shortened, islice(names, limit)))
    if len(names) > limit:
        shown += f" and {len(names) - limit:,} more"
    return shown


def unlike(name: object, allowed: Iterable[str], kind: str = "") -> str:
    """Return a message about a wrong name: its kind, the name, the allowed ones, the most similar.

    Examples
    --------
    >>> print(unlike("treshold", ["drift", "threshold"]))
    got 'treshold', allowed: drift, threshold; did you mean 'threshold'?
    """
    names = list(allowed)
    got = f"{kind} {quoted(name)}" if kind else quoted(name)
    return f"got {got}, allowed: {', '.join(names) or 'none'}{nearest(name, names)}"


def nearest(name: object, allowed: Iterable[str]) -> str:
    """Return the end of a message about a wrong name: the most similar name, or nothing.

    Examples
    --------
    >>> nearest("Handeld", ["paper", "handheld"]), nearest("x", ["paper"])
    ("; did you mean 'handheld'?", '')
    """
    text = str(name)
    if len(text) > LONGEST:
        return ""
    from difflib import get_close_matches

    names = {each.casefold(): each for each in allowed}
    similar = get_close_matches(text.casefold(), names, 1, _LIKE)
    if not similar:
        return ""
    return f"; did you mean {names[similar[0]]!r}?"
