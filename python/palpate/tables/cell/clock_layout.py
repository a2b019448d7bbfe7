"""Layouts of dates and times in text: where each field is, found once for all cells of the same shape."""

import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

LONGEST = 64
"""Characters of a date with time, at most."""

Ints = NDArray[np.int64]
Digits = NDArray[np.uint8]

_AS_SHAPE = str.maketrans("123456789", "0" * 9)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_SECOND_NS = 1_000_000_000

_CELL = re.compile(
    r"(?:(?:(?P<year>[0-9]{4})[-/.](?P<month>[0-9]{1,2})[-/.](?P<day>[0-9]{1,2})"
    r"|(?P<first>[0-9]{1,2})(?P<mark>[-/.])(?P<second>[0-9]{1,2})[-/.](?P<last>[0-9]{4}|[0-9]{2})"
    r"|(?P<on>[0-9]{1,2})[- ](?P<word>[A-Za-z]{3})[- ](?P<of>[0-9]{4}))(?:,? |T|$))?"
    r"(?P<sign>[-+]?)(?:(?P<days>[0-9]{1,5}) days?,? )?"
    r"(?:(?:(?P<hours>[0-9]{1,5}):)?(?P<minutes>[0-9]{1,5}):(?P<seconds>[0-9]{1,2})"
    r"(?:[.,](?P<fraction>[0-9]{1,9})|:(?P<fourth>[0-9]{1,3}))?)?"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?"
    r"(?: ?(?P<zone>Z|UTC|GMT|(?P<east>[-+])(?P<zone_h>[0-9]{2})(?::?(?P<zone_min>[0-9]{2}))?))?"
)


@dataclass(frozen=True)
class Layout:
    """Where the fields of a date or time are in the text.

    Attributes
    ----------
    spans : mapping
        First and last position + 1 of the digits of each field.
    texts : mapping
        Fields that are no digits: mark, word, sign, half, zone, east.
    """

    spans: dict[str, tuple[int, int]]
    texts: dict[str, str]

    @property
    def dated(self) -> bool:
        """Whether there is a date."""
        return not self.spans.keys().isdisjoint(("year", "last", "of"))

    @property
    def timed(self) -> bool:
        """Whether there is a time."""
        return "minutes" in self.spans

    @property
    def hours(self) -> bool:
        """Whether there are hours besides minutes and seconds."""
        return "hours" in self.spans

    @property
    def fraction(self) -> bool:
        """Whether there is a fraction of a second."""
        return "fraction" in self.spans

    @property
    def fourth(self) -> int:
        """Digits of a fourth number, after a colon: 0 if none."""
        begin, end = self.spans.get("fourth", (0, 0))
        return end - begin

    @property
    def zoned(self) -> bool:
        """Whether there is a time zone."""
        return "zone" in self.texts

    @property
    def half(self) -> bool:
        """Whether AM or PM is said."""
        return "half" in self.texts

    @property
    def elapsed(self) -> bool:
        """Whether it is an elapsed time surely: with days, or a sign."""
        return "days" in self.spans or "sign" in self.texts

    @property
    def order_open(self) -> bool:
        """Whether the first number may be the day or the month."""
        return self.texts.get("mark", ".") != "."

    @property
    def kind(self) -> tuple[bool, ...]:
        """What all cells of a column have in common."""
        return self.dated, self.zoned, self.half, self.order_open

    def number(self, digits: Digits, name: str) -> Ints:
        """Return the values of a field, shape (n,), from the digits of the cells, shape (n, longest cell); 0 if it is absent."""
        begin, end = self.spans.get(name, (0, 0))
        powers: Ints = 10 ** np.arange(end - begin, dtype=np.int64)[::-1]
        return digits[:, begin:end].astype(np.int64) @ powers

    def date(self, digits: Digits) -> tuple[Ints, Ints, Ints]:
        """Return year, month and day; if their order is open, the first number as the month, the second as the day."""
        if "word" in self.texts:
            month = _MONTHS.index(self.texts["word"].lower()) + 1
            return self.number(digits, "of"), np.full(len(digits), month), self.number(digits, "on")
        if "last" not in self.spans:
            return self.number(digits, "year"), self.number(digits, "month"), self.number(digits, "day")
        begin, end = self.spans["last"]
        year = self.number(digits, "last") + (2000 if end - begin == 2 else 0)
        first, second = self.number(digits, "first"), self.number(digits, "second")
        return (year, first, second) if self.order_open else (year, second, first)

    def time_ns(self, digits: Digits) -> tuple[Ints, NDArray[np.bool_]]:
        """Return ns since midnight, of UTC if there is a zone, or elapsed; and whether all numbers are in their range."""
        hours, minutes, seconds = (self.number(digits, name) for name in ("hours", "minutes", "seconds"))
        if self.dated and not self.hours:  # 12:00 after a date
            hours, minutes, seconds = minutes, seconds, np.zeros_like(seconds)
        fits = (seconds < 60) & ((minutes < 60) | (not self.dated and not self.hours))
        if self.half:
            fits &= (hours >= 1) & (hours <= 12)
            hours = hours % 12 + (12 if self.texts["half"] in "Pp" else 0)
        if self.dated:
            fits &= hours < 24
        ns = ((hours + 24 * self.number(digits, "days")) * 3600 + minutes * 60 + seconds) * _SECOND_NS
        begin, end = self.spans.get("fraction", (0, 0))
        ns += self.number(digits, "fraction") * 10 ** (9 - (end - begin)) + self.number(digits, "fourth") * 1_000_000
        if self.texts.get("sign") == "-":
            ns = -ns
        if "east" in self.texts:
            offset = (self.number(digits, "zone_h") * 60 + self.number(digits, "zone_min")) * 60 * _SECOND_NS
            ns += offset if self.texts["east"] == "-" else -offset
        return ns, fits


@lru_cache(maxsize=1024)
def layout_of(shape: str) -> Layout | None:
    """Return the layout of cells of one shape, a cell with all its digits 0; None: not a date or time.

    Examples
    --------
    >>> layout_of("0000-00-00T00:00:00.000Z").spans["fraction"]
    (20, 23)
    """
    match = _CELL.fullmatch(shape)
    if not match:
        return None
    texts = {name: match[name] for name in ("mark", "word", "sign", "half", "zone", "east") if match[name]}
    spans = {name: match.span(name) for name, text in match.groupdict().items() if text and text.isdecimal()}
    layout = Layout(spans, texts)
    allowed = (
        layout.dated or layout.timed,
        layout.timed or not {"days", "sign", "half", "zone"} & {*spans, *texts},
        not layout.dated or not layout.elapsed,
        not layout.zoned or layout.dated,
        not layout.half or layout.hours or layout.dated,
        texts.get("word", "jan").lower() in _MONTHS,
    )
    return layout if all(allowed) else None


def is_time(cell: str) -> bool:
    """Return whether a cell is a date, a time of day, or an elapsed time with colons.

    Examples
    --------
    >>> is_time("21.11.2026 12:00:00,5"), is_time("C1"), is_time("0.5")
    (True, False, False)
    """
    return cell.isascii() and 0 < len(cell) <= LONGEST and layout_of(cell.translate(_AS_SHAPE)) is not None
