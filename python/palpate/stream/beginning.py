"""Where a recording begins that is started later than the measurement: so that its replay has the same touches."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate._core import Tracker
from palpate.recording.sidecar import BEGUN
from palpate.samples import Block, columns_for
from palpate.stream.kept import Kept
from palpate.stream.places import BASELINE, Measured, Places

_Numbers = NDArray[np.int64]
_SETTLED = 2 * BASELINE
"""Readings without contact after which a replay that begins there may measure the baseline, and that it needs for it."""
SAME = "a replay has the same bits from there on"
NO_BASELINE = "a replay has no baseline from them"
NEAR = "a replay has the same touches within their uncertainty, not the same bits"


class Beginning(NamedTuple):
    """The first rows of a recording, the tares and gaps in them, and a note on where they begin; "": with the measurement."""

    block: Block
    marks: list[dict[str, Any]]
    note: str


class Place(NamedTuple):
    """A row with which a recording may begin, as its position, and what is there."""

    at: int
    what: str


class Memory:
    """What a stream keeps for a recording that begins later.

    Parameters
    ----------
    keep : int
        How many samples, as in `Kept`.

    Attributes
    ----------
    kept : Kept
    places : Places
    """

    def __init__(self, keep: int) -> None:
        self.kept: Kept = Kept(keep)
        self.places: Places = Places()

    def beginning(self, tracker: Tracker, read: int, recorded: int | None) -> Beginning:
        """Return how a recording begins; the caller has the lock of the samples.

        Parameters
        ----------
        tracker : Tracker
        read : int
            Samples read so far.
        recorded : int or None
            Number of the last sample of the recording before this one: it begins at the last place before the end of
            that, so that no sample is missing between them. None: there was no other; it begins at the first place of all.
        """
        block = self.kept.block()
        seqs = np.ascontiguousarray(block["seq"])  # it is searched often
        exact = sorted(_exact(block, seqs, self.kept, self.places, tracker))
        found = _chosen(exact, seqs, recorded) or _without_contact(seqs, self.places)
        if found is None:
            return Beginning(block[:0], [], f"{BEGUN}{read} pairs; {NO_BASELINE}" if read else "")
        rest = block[found.at :]
        begin = int(seqs[found.at]) if len(rest) else int(seqs[-1]) + 1
        marks = sorted((mark for mark in self.kept.marks if mark["seq"] >= begin), key=lambda mark: int(mark["seq"]))
        before = read - len(rest)
        is_same = found in exact and not tracker.settings.get("host_stamps", False)
        note = f"{BEGUN}{before} pairs, {found.what}: {SAME if is_same else NEAR}"
        return Beginning(rest, marks, note if before else "")


def _chosen(places: list[Place], seqs: _Numbers, recorded: int | None) -> Place | None:
    before = [] if recorded is None else [place for place in places if _follows(place, seqs, recorded)]
    return before[-1] if before else places[0] if places else None


def _follows(place: Place, seqs: _Numbers, recorded: int) -> bool:
    """Return whether no sample is missing between a recording that ended with a sample, and a place."""
    return place.at <= int(np.searchsorted(seqs, recorded, "right"))


def _exact(block: Block, seqs: _Numbers, kept: Kept, places: Places, tracker: Tracker) -> Iterator[Place]:
    """Yield the places from which a replay has the same state."""
    if kept.has_all and len(block):
        yield Place(0, "with the measurement")
    if tracker.scene == "fixed":  # it has no baseline, and is always in contact: a touch begins with the first row
        return
    gaps = {mark["seq"] for mark in kept.marks if mark.get("gap")}
    for seq in {mark["seq"] for mark in kept.marks}:
        at = _position(seqs, seq)
        if at is not None:  # the replay needs the mark of a gap, and so the row before it; after a tare it begins anew
            yield Place(at, "at a gap") if seq in gaps else Place(at + 1, "after a tare")
    good = _good(block, tracker)
    for measured in places.measured():
        at = _first(seqs, good, measured)
        if at is not None:
            yield Place(at, "after a release")


def _first(seqs: _Numbers, good: NDArray[np.bool_], measured: Measured) -> int | None:
    """Return the first reading of a baseline, if it is certain: each of them, and the one before, has both values."""
    before, last = _position(seqs, measured.before), _position(seqs, measured.last)
    if before is None or last is None or last - before != BASELINE or not good[before : last + 1].all():
        return None
    return before + 1


def _good(block: Block, tracker: Tracker) -> NDArray[np.bool_]:
    _, _, hard, soft = columns_for(tracker, block)
    limit = tracker.settings["full_scale"]
    return np.asarray((np.abs(hard) < limit) & (np.abs(soft) < limit))


def _position(seqs: _Numbers, seq: int) -> int | None:
    at = int(np.searchsorted(seqs, seq))
    return at if at < len(seqs) and seqs[at] == seq else None


def _without_contact(seqs: _Numbers, places: Places) -> Place | None:
    """Return the first place without contact where a replay can measure a baseline, its own."""
    for begin, end in places.without_contact():
        is_whole = len(seqs) > 0 and begin >= seqs[0]  # its begin may be a release that is not yet over
        at = int(np.searchsorted(seqs, begin)) + (_SETTLED if is_whole else 0)
        if int(np.searchsorted(seqs, end)) - at >= _SETTLED:
            return Place(at, "without contact")
    return None
