"""The parts of what the page says: the word, the line, and the grammar of their sentences."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from palpate.live.desk.facts import Facts
from palpate.live.desk.watching import CHANNELS


class Now(NamedTuple):
    """What to do now.

    Attributes
    ----------
    word : str
        An imperative: Touch, Hold, Lift, Repeat, Stop, Tare, Wait; File: nothing is measured.
    sub : str
    tone : str
        "idle", "busy", "good", "caution" or "fault".
    share : float or None
        Part of the touch that is measured.
    """

    word: str
    sub: str
    tone: str = "idle"
    share: float | None = None


class Line(NamedTuple):
    """What there is to know.

    Attributes
    ----------
    what : str
        A key.
    level : str
        "quiet", "note", "caution" or "fault".
    title, text : str
    said : str
        What a screen reader says in place of a text whose numbers run; empty: the text.
    """

    what: str
    level: str
    title: str
    text: str
    said: str = ""


class View(NamedTuple):
    """A line, and what to do; None: what one would do without it."""

    line: Line
    now: Now | None = None


Rule = Callable[[Facts], View | None]


def which(lasting_s: tuple[float, float], least_s: float) -> list[str]:
    """Return the channels for which something has lasted so long."""
    return [name for name, long_s in zip(CHANNELS, lasting_s, strict=True) if long_s >= least_s]


def subject(names: Sequence[str]) -> str:
    """Return the subject of a sentence about channels, with its verb."""
    return f"{names[0]} channel is" if len(names) == 1 else "channels are"


def read_by(names: Sequence[str]) -> str:
    """Return the subject of a sentence about what channels read."""
    return f"The {names[0]} channel reads" if len(names) == 1 else "Both channels read"


def count(number: int, noun: str) -> str:
    """Return so many of something, with the verb."""
    return f"1 {noun} is" if number == 1 else f"{number} {noun}s are"


def sentence(text: str) -> str:
    """Return a text as a sentence: with a capital, unless it begins with the name of a file or a device; a full stop.

    Examples
    --------
    >>> sentence("offset: hold the probe upright"), sentence("run.csv: disk full")
    ('Offset: hold the probe upright.', 'run.csv: disk full.')
    """
    text = text.strip()
    first = text.partition(" ")[0].rstrip(".")
    begin = text[:1] if set(first) & set("./\\") else text[:1].upper()
    return begin + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
