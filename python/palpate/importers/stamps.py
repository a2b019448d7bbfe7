"""Stamps that a terminal or logging program puts before each captured line: time, level, name."""

import re
from typing import NamedTuple

from palpate.importers.units import simple_name

_MONTH = "(?:Jan|Feb|Mar|Apr|May|Jun|Jul|Aug|Sep|Oct|Nov|Dec)"
_NUMERIC_DATE = r"\d{4}[-/.]\d\d[-/.]\d\d|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}"
_NAMED_DATE = rf"(?:[A-Z][a-z]{{2}} )?{_MONTH} +\d{{1,2}}"
_CLOCK = r"\d{1,2}:\d\d:\d\d(?:[.,:]\d{1,9})?"
_ZONE = r"(?:Z|[+-]\d\d:?\d\d| ?[AaPp][Mm])?"
_STAMP = re.compile(
    rf"[\[(<]?(?:(?P<date>{_NUMERIC_DATE})[T ,_]+|(?P<named>{_NAMED_DATE}),? (?:\d{{4}} )?)?"
    rf"(?P<clock>{_CLOCK}{_ZONE})(?(named)(?: \d{{4}})?)[\])>]?"
)
_SECONDS = re.compile(r"\[\s*(?P<seconds>\d+\.\d+)(?:\s+\d+\.\d+)?\]|(?P<epoch>\d{10}\.\d+)")
_MILLISECONDS = re.compile(r"[EWIDV] \((?P<ms>\d+)\)")
_FOURTH_PART = re.compile(r"^(\d{1,2}:\d\d:\d\d):(\d{1,9})")  # 14:22:10:370
_LEVEL = re.compile(r"(?:TRACE|DEBUG|INFO|NOTICE|WARNING|WARN|ERROR|CRITICAL|FATAL)\b")
# Between a stamp and the text of the board: an arrow, a level, the name of a logger or a port.
_SIGN = re.compile(
    r"\s*(?:->|=>|>>|[>|:;-])(?=\s|$)\s*|\s*[,;](?=\s*(?:[A-Za-z_][\w ()\[\]]*[=:]|\{))\s*"
)
_BRACKETED = re.compile(r"\s*[\[(<][A-Za-z][^\])>]*[\])>]:?\s*")
_WORD = re.compile(r"\s*[A-Za-z_][\w\-]*(?:\.[A-Za-z_]\w*)*(?:\[\d+\])?:?(?=\s)\s*")
_LEVEL_AND_NAME = re.compile(r"\s*[A-Z]+:[\w.\-]+:\s*")  # of Python's logging, by default
_MOST_WORDS = 5
_CHANNEL_WORDS = frozenset(
    {"hard", "soft", "c1", "c2", "cin1", "cin2", "cap1", "cap2", "t", "time"}
)
_SHOWN = 40  # lines that show whether there are stamps
_STAMPED = 0.9  # of them


class StampedText(NamedTuple):
    """A text without the stamps before its lines.

    Attributes
    ----------
    text : str
        As many lines as before.
    stamps : list of str
        Of each line: date and time, seconds, or "" without a stamp.
    unit : str
        Of stamps that are numbers: "s" or "ms"; else "".
    is_foreign : bool
        Whether the stamps are no column of a table: they are separated from the rest by another
        sign than the cells of the rest.
    """

    text: str
    stamps: list[str]
    unit: str
    is_foreign: bool


class _Prefix(NamedTuple):
    """What a program writes before a line: its stamp, its unit, and the length of the whole."""

    stamp: str
    unit: str
    length: int
    separator: str


def split_stamps(text: str) -> StampedText | None:
    """Return a text without stamps, and the stamps; None if most of its lines have none.

    Examples
    --------
    >>> split_stamps("14:22:10.370 -> 6.8090,4.7730").stamps
    ['14:22:10.370']
    >>> split_stamps("2024-03-05 14:22:10,370 INFO 6.8090,4.7730").text
    '6.8090,4.7730'
    """
    shown = _shown_lines(text)
    prefixes = list(map(_prefix, shown))
    count = len(prefixes) - prefixes.count(None)
    if not shown or count < _STAMPED * len(shown):
        return None
    rests = []
    stamps = []
    units = set()
    for line in text.split("\n"):
        prefix = _prefix(line)
        if prefix is None:
            rests.append(line)
            stamps.append("")
        else:
            rests.append(line[prefix.length :])
            stamps.append(prefix.stamp)
            units.add(prefix.unit)
    if len(units) > 1:  # stamps of several kinds: the kind of a line may be a coincidence
        return None
    is_foreign = all(map(_is_foreign, shown))
    return StampedText("\n".join(rests), stamps, units.pop(), is_foreign)


def _shown_lines(text: str) -> list[str]:
    """Return lines from the middle of a text, else from its begin."""
    half = text.find("\n", len(text) // 2)
    lines = text[half + 1 : half + 1 + 200 * _SHOWN].split("\n")[:_SHOWN]
    filled = list(filter(str.strip, lines))
    if len(filled) > 2:
        return filled[:-1]  # the last one may be cut
    return list(filter(str.strip, text[: 200 * _SHOWN].split("\n")))[:_SHOWN]


def _is_foreign(line: str) -> bool:
    """Return whether the stamp of a line is no cell of a table."""
    prefix = _prefix(line)
    if prefix is None:
        return True
    rest = line[prefix.length :].strip()
    if prefix.separator.strip() or not prefix.stamp:
        return True
    joined = re.sub(r"\s*([,;|=:])\s*", r"\1", rest)
    return "\t" not in joined and " " not in joined


def _prefix(line: str) -> _Prefix | None:
    """Return what a program wrote before a line; None: nothing."""
    match = _STAMP.match(line) or _SECONDS.match(line) or _MILLISECONDS.match(line)
    if match is None:
        return _prefix_without_stamp(line)
    groups = match.groupdict()
    unit = ""
    if "clock" in groups:
        stamp = _iso_text(groups["date"], groups["clock"])
    elif "ms" in groups:
        stamp = groups["ms"]
        unit = "ms"
    else:
        stamp = groups["seconds"] or groups["epoch"]
        unit = "s"
    length = _after_words(line, match.end())
    if length == match.end() or not line[length:].strip():
        return None
    return _Prefix(stamp, unit, length, line[match.end() : length])


def _prefix_without_stamp(line: str) -> _Prefix | None:
    match = _LEVEL_AND_NAME.match(line)
    if match is None or not _LEVEL.match(line):
        return None
    return _Prefix("", "", match.end(), match[0])


def _iso_text(date: str | None, clock: str) -> str:
    """Return a stamp as a column of times has it; a date with the name of a month is left out."""
    clock = _FOURTH_PART.sub(r"\1.\2", clock)
    if date is None:
        return clock
    return f"{date} {clock}"


def _after_words(line: str, begin: int) -> int:
    """Return where the text of the board begins: after an arrow, a level and names."""
    for _ in range(_MOST_WORDS):
        match = _SIGN.match(line, begin) or _BRACKETED.match(line, begin)
        if match is None:
            match = _LEVEL_AND_NAME.match(line, begin)
        if match is None:
            match = _WORD.match(line, begin)
            if match and simple_name(match[0].strip(" \t:")) in _CHANNEL_WORDS:
                match = None
        if match is None:
            break
        begin = match.end()
    blank = re.compile(r"\s*").match(line, begin)
    return blank.end() if blank else begin
