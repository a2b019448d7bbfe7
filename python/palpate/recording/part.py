"""A part of a recording, between two times."""

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.recording.recording import Recording


def part(recording: Recording, span: slice) -> Recording:
    """Return the pairs whose hard reading is at `span.start` or later, and before `span.stop`, s.

    Raises
    ------
    TypeError
        Not a slice of seconds: whole numbers may be meant as rows.
    ValueError
        The recording has no times, or there is no pair between these.

    Examples
    --------
    >>> from palpate.recording import read
    >>> recording = read("tests/data/four-specimens.csv")
    >>> later = part(recording, slice(10.0, 20.0))
    >>> float(later.t_hard_s[0]), recording.zero_utc_ns == later.zero_utc_ns
    (10.01, True)
    """
    begin, end = _seconds(span)
    length_s = recording.duration.total_seconds()  # an error without times
    t_s = recording.t_hard_s
    inside = (t_s >= begin) & (t_s < end)
    if not inside.any() or begin < 0 <= t_s[0]:
        first, last = (f"{float(t):.3f}" for t in (t_s[0], t_s[0] + length_s)) if len(t_s) else ("", "")
        raise ValueError(f"recording[{_told(span)}]: got no pair, allowed: times from {first} to {last} s")
    rows = np.concatenate([[0], np.cumsum(inside)])  # how many are kept before each row
    gaps = [int(rows[row]) for row in recording.gap_rows]
    kept: dict[str, Any] = {name: getattr(recording, name)[inside] for name in ("t_hard_s", "t_soft_s", "hard", "soft")}
    return replace(
        recording,
        **kept,
        gap_rows=tuple(sorted({row for row in gaps if 0 < row < rows[-1]})),
        marks=tuple(mark for mark in recording.marks if begin <= mark.t_s < end),
        notes=(*recording.notes, f"the part {_told(span)} s of a recording; other notes and doubts are of the whole"),
    )


def _seconds(span: slice) -> tuple[float, float]:
    if not isinstance(span, slice) or span.step is not None:
        raise TypeError(f"recording: got [{span!r:.40}], allowed: seconds, as recording[2.0:5.0]")
    for end in (span.start, span.stop):
        if end is not None and not isinstance(end, float | np.floating):
            raise TypeError(
                f"recording[{_told(span)}]: got {end!r:.40}, allowed: seconds with a point, as recording[2.0:5.0]; rows are "
                "those of the arrays, as recording.hard[2:5]"
            )
    begin, end = span.start, span.stop
    return -np.inf if begin is None else float(begin), np.inf if end is None else float(end)


def _told(span: slice) -> str:
    return ":".join("" if end is None else f"{end!s:.20}" for end in (span.start, span.stop))
