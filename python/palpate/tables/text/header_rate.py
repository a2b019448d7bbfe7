"""The rate that the lines above a table say."""

import re
from collections.abc import Iterable

_SAMPLES = re.compile(r"\b(?:sampl|abtast)", re.IGNORECASE)
_HERTZ = re.compile(r"\b(?:hz|sps)\b|/s\b", re.IGNORECASE)
_NUMBER = re.compile(r"[0-9]+(?:[.,][0-9]+)?")


def header_rate(lines: Iterable[list[str]]) -> str:
    """Return the number of the first line that has the word for samples, a unit of a rate, and one number; else "".

    Examples
    --------
    >>> header_rate([["# Frequency: 1000 Hz"], ["# Sample rate: 25 Hz"]]), header_rate([["Samples", "100"]])
    ('25', '')
    """
    for text in map(" ".join, lines):
        found = _NUMBER.findall(text)
        if len(found) == 1 and _SAMPLES.search(text) and _HERTZ.search(text):
            return str(found[0])
    return ""
