"""What is known of a recording beside its rows, and whether it is as it was written."""

import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from palpate.errors import RecordingError
from palpate.files import STANDARD_INPUT, file_errors, unpacked_name
from palpate.recording import sidecar
from palpate.recording.writer import is_locked

SOURCE_FAILED = "the source ended with an error"
"""First words of the remark on a recording that ended so."""


class Integrity(NamedTuple):
    """What can be said of a recording that was read to its end.

    Attributes
    ----------
    doubts : tuple of str
        What is not as it was written: the results may be wrong.
    limits : tuple of str
        What cannot be verified, and why.
    remarks : tuple of str
        What is known of it from before: a repair, the error that ended it.
    verified : int
        Rows whose checksum is right.
    """

    doubts: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    verified: int = 0

    def doubts_before(self, change: str, end: dict[str, Any]) -> list[str]:
        """Return the doubts for the end of a changed file: those that are not in its end yet are from before the change."""
        return [
            text if text in end.get("doubts", []) else f"before the {change}: {text}"
            for text in self.doubts
        ]


@dataclass(frozen=True)
class Known:
    """What is known of a recording before its rows are read.

    Attributes
    ----------
    document : dict
        The sidecar; empty: missing or not valid.
    intact : bool or None
        Whether the sidecar is as it was written; None: it has no checksum.
    problem : str
        Why there is no document.
    running : bool
        Whether it is still being recorded.
    """

    document: dict[str, Any] = field(default_factory=dict)
    intact: bool | None = None
    problem: str = ""
    running: bool = False

    @property
    def end(self) -> dict[str, Any]:
        """The end of the recording; empty without one."""
        return dict(self.document.get("end", {}))

    def sealed(self, name: str) -> int | None:
        """Return rows, bytes or CRC-32 of the end, or else of the last checkpoint; None: not there."""
        value = (self.end or self.document.get("checkpoint", {})).get(name)
        return value if type(value) is int and value >= 0 else None


@dataclass
class Bytes:
    """Counts over a file; `marked` is the CRC-32 of its first `to_mark` bytes, `joined` the one without carriage returns."""

    to_mark: int | None = None
    size: int = 0
    crc32: int = 0
    joined: int = 0
    marked: int | None = None
    rows: int = 0
    torn: int = 0

    def count(self, data: bytes) -> None:
        """Count the next bytes."""
        left = -1 if self.to_mark is None else self.to_mark - self.size
        if 0 <= left <= len(data):
            self.marked = zlib.crc32(data[:left], self.crc32)
        before, self.crc32 = self.crc32, zlib.crc32(data, self.crc32)
        is_joined = self.joined != before or b"\r" in data
        self.joined = zlib.crc32(data.replace(b"\r", b""), self.joined) if is_joined else self.crc32
        self.size += len(data)


def known_of(path: Path) -> Known:
    """Return what is known of a recording, from its sidecar and its lock."""
    with file_errors(path, "cannot be read"):
        running = is_locked(
            path
        )  # before the sidecar is read: a recording that ends in between has its end there
        try:
            loaded = sidecar.load_checked(path)
        except RecordingError as error:
            return Known(problem=str(error), running=running)
    if loaded is None:
        missing = Path(unpacked_name(path)).with_suffix(".json").name
        problem = "standard input has none" if path == STANDARD_INPUT else f"{missing} is missing"
        return Known(problem=problem, running=running)
    return Known(*loaded, running=running)


def judge(known: Known, seen: Bytes) -> Integrity:
    """Compare what was read to the end with what is known."""
    torn = f"the last row is cut off: its {seen.torn} bytes are left out" if seen.torn else ""
    if not known.document:
        what = "the rows cannot be verified, the device and its range are unknown"
        return Integrity((torn,) if torn else (), (f"no valid sidecar ({known.problem}): {what}",))
    found = _judge_closed(known, seen, torn) if known.end else _judge_open(known, seen, torn)
    if known.intact is not False:
        return found
    parts = "device, settings, marks, end"
    changed = (
        f"the sidecar was changed after it was written (its checksum differs): {parts} may be wrong"
    )
    if found.verified and not found.doubts:
        changed += "; the rows agree with the checksum in it: take the sidecar from a copy"
    return found._replace(doubts=(changed, *found.doubts))


def _judge_closed(known: Known, seen: Bytes, torn: str) -> Integrity:
    """Judge a recording by its end."""
    end, checksum, remarks = known.end, known.sealed("crc32"), list[str]()
    if "repaired" in end:
        remarks.append(f"repaired: {end['repaired']!s:.500}")
    elif end.get("clean") and end.get("error"):
        remarks.append(f"{SOURCE_FAILED}: {end['error']!s:.300}")
    held = seen.crc32 if known.sealed("bytes") is None else seen.marked
    if held != checksum == seen.joined:
        held = checksum
        remarks.append(
            "the line ends were changed to those of Windows; the rows are as they were written"
        )
    is_complete = end.get("rows") == seen.rows
    if checksum is None and is_complete and known.document["schema"] != sidecar.SCHEMA:
        remarks.append(
            "no checksum in the sidecar, which an older palpate wrote: only the number of rows is verified"
        )
    before, wrong = end.get("doubts", []), _wrong(known, seen, held, torn)
    doubts = [
        *map(str, before if isinstance(before, list) else [before]),
        *([wrong] if wrong else []),
    ]
    stopped = not (end.get("clean") or "repaired" in end)
    limits = (f"the recorder stopped with an error: {end.get('error')!s:.300}",) if stopped else ()
    verified = seen.rows if is_complete and checksum is not None and checksum == held else 0
    if type(end.get("verified")) is int and end["verified"] >= 0:  # of a repaired one
        verified = min(verified, end["verified"])
    return Integrity(tuple(doubts), limits, tuple(remarks), verified)


def _wrong(known: Known, seen: Bytes, held: int | None, torn: str) -> str:
    """Return how the rows differ from what the end says of them; "" if they do not."""
    written, checksum = known.end.get("rows"), known.sealed("crc32")
    if torn and known.sealed("rows") == seen.rows + 1:
        return torn
    if written != seen.rows:
        there = f"{seen.rows} rows in the file, but {written!r:.20} were written"
        there = there if seen.size else f"the file is empty, but {written!r:.20} rows were written"
        return f"{there}; {torn}" if torn else there
    if checksum is None and known.document["schema"] == sidecar.SCHEMA:
        return "the end in the sidecar has no checksum, which palpate always writes: the rows cannot be verified"
    return torn if checksum in (None, held) else _changed(f"the {seen.rows:,} rows")


def _judge_open(known: Known, seen: Bytes, torn: str) -> Integrity:
    """Judge a recording without an end, by its last checkpoint."""
    size, claimed = known.sealed("bytes"), known.sealed("rows") or 0
    doubts, verified = list[str](), 0
    if size is not None and seen.size < size:
        missing = f"{size - seen.size:,} bytes before its last checkpoint"
        doubts.append(f"the file ends {missing}: rows that were written are missing")
    elif size is not None and seen.marked == known.sealed("crc32"):
        verified = min(claimed, seen.rows)
    elif known.document.get("checkpoint"):
        doubts.append(_changed(f"the first {claimed:,} rows"))
    if torn and not known.running and seen.size >= (size or 0):
        doubts.append(torn)
    part = (
        f"the first {verified:,} of {seen.rows:,} rows are verified"
        if verified
        else "no row is verified"
    )
    if known.running:
        limit = f"still being recorded: only the rows written until now are there; {part}"
    else:
        why = "" if known.document.get("checkpoint") else " (it has no checkpoint)"
        end = f"{part}{why}; palpate check --repair writes an end"
        limit = f"no end in the sidecar: the recording was not closed; {end}"
    return Integrity(tuple(doubts), (limit,), (), verified)


def _changed(what: str) -> str:
    why = (
        "the rows were changed after they were written, or the sidecar belongs to another recording"
    )
    return f"{why} (checksum of {what} differs): results may be wrong; take the file from a copy"
