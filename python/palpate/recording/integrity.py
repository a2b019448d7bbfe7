"""Whether a recording is as it was written: its bytes are compared with its sidecar."""

import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from palpate.errors import RecordingError
from palpate.files import STANDARD_INPUT, file_errors, unpacked_name
from palpate.recording.sidecar import RecordingEnd, Sidecar, load_checked
from palpate.recording.writer import is_locked

SOURCE_FAILED = "the source ended with an error"
"""First words of the remark on a recording that ended so."""


class Integrity(NamedTuple):
    """The verdict on a recording that was read to its end.

    Attributes
    ----------
    doubts : tuple of str
        Differences from the file as it was written: results may be wrong.
    limits : tuple of str
        Rows that cannot be verified, and why.
    remarks : tuple of str
        Earlier events: a repair, the error that ended it.
    verified : int
        Rows whose checksum is right.
    """

    doubts: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    verified: int = 0

    def doubts_before(self, change: str, end: RecordingEnd | None) -> list[str]:
        """Return the doubts for the end of a changed file; new ones are from before the change."""
        old = end.doubts if end else ()
        return [text if text in old else f"before the {change}: {text}" for text in self.doubts]


@dataclass(frozen=True)
class Known:
    """The facts about a recording before its rows are read.

    Attributes
    ----------
    sidecar : Sidecar
        Empty: missing or not valid.
    problem : str
        Why there is no sidecar.
    running : bool
        Whether it is still being recorded.
    """

    sidecar: Sidecar = field(default_factory=Sidecar)
    problem: str = ""
    running: bool = False


@dataclass
class Bytes:
    """Counts over a file.

    `marked` is the CRC-32 of its first `to_mark` bytes, `joined` the one without carriage returns.
    """

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
        is_joined = self.joined != self.crc32 or b"\r" in data
        self.crc32 = zlib.crc32(data, self.crc32)
        if is_joined:
            self.joined = zlib.crc32(data.replace(b"\r", b""), self.joined)
        else:
            self.joined = self.crc32
        self.size += len(data)


def known_of(path: Path) -> Known:
    """Return the facts about a recording, from its sidecar and its lock."""
    with file_errors(path, "cannot be read"):
        # Before the sidecar is read: a recording that ends in between has its end there.
        running = is_locked(path)
        try:
            found = load_checked(path)
        except RecordingError as error:
            return Known(problem=str(error), running=running)
    if found is not None:
        return Known(found, running=running)
    problem = "standard input has none"
    if path != STANDARD_INPUT:
        name = Path(unpacked_name(path)).with_suffix(".json").name
        problem = f"{name} is missing"
    return Known(problem=problem, running=running)


def judge(known: Known, seen: Bytes) -> Integrity:
    """Compare the bytes of a recording that was read to its end with its sidecar."""
    torn = ""
    if seen.torn:
        torn = f"the last row is cut off: its {seen.torn} bytes are left out"
    if not known.sidecar.entries:
        doubts = (torn,) if torn else ()
        limit = (
            f"no valid sidecar ({known.problem}): the rows cannot be verified, "
            "the device and its range are unknown"
        )
        return Integrity(doubts, (limit,))
    end = known.sidecar.end
    if end:
        found = _judge_closed(known.sidecar, end, seen, torn)
    else:
        found = _judge_open(known, seen, torn)
    if known.sidecar.intact is not False:
        return found
    changed = (
        "the sidecar was changed after it was written (its checksum differs): "
        "device, settings, marks, end may be wrong"
    )
    if found.verified and not found.doubts:
        changed += "; the rows agree with the checksum in it: take the sidecar from a copy"
    return found._replace(doubts=(changed, *found.doubts))


def _judge_closed(sidecar: Sidecar, end: RecordingEnd, seen: Bytes, torn: str) -> Integrity:
    """Judge a recording by its end."""
    checksum = sidecar.seal.crc32
    remarks = list[str]()
    if end.repaired is not None:
        remarks.append(f"repaired: {end.repaired:.500}")
    elif end.clean and end.error:
        remarks.append(f"{SOURCE_FAILED}: {end.error:.300}")
    in_file = seen.crc32 if sidecar.seal.bytes is None else seen.marked
    if in_file != checksum == seen.joined:
        in_file = checksum
        remarks.append(
            "the line ends were changed to those of Windows; the rows are as they were written"
        )
    is_complete = end.rows == seen.rows
    if checksum is None and is_complete and not sidecar.is_of_this_version:
        remarks.append(
            "no checksum in the sidecar, which an older palpate wrote: "
            "only the number of rows is verified"
        )
    doubts = end.doubts
    wrong = _wrong(sidecar, end, seen, in_file, torn)
    if wrong:
        doubts += (wrong,)
    limits = tuple[str, ...]()
    if not end.clean and end.repaired is None:
        limits = (f"the recorder stopped with an error: {end.error!s:.300}",)
    verified = 0
    if is_complete and checksum is not None and checksum == in_file:
        verified = seen.rows
    if end.verified is not None:
        verified = min(verified, end.verified)
    return Integrity(doubts, limits, tuple(remarks), verified)


def _wrong(sidecar: Sidecar, end: RecordingEnd, seen: Bytes, in_file: int | None, torn: str) -> str:
    """Return how the rows differ from the end in the sidecar; "" if they do not."""
    checksum = sidecar.seal.crc32
    if torn and sidecar.seal.rows == seen.rows + 1:
        return torn
    if end.rows != seen.rows:
        there = f"{seen.rows} rows in the file, but {end.rows!r:.20} were written"
        if not seen.size:
            there = f"the file is empty, but {end.rows!r:.20} rows were written"
        return f"{there}; {torn}" if torn else there
    if checksum is None and sidecar.is_of_this_version:
        return (
            "the end in the sidecar has no checksum, which palpate always writes: "
            "the rows cannot be verified"
        )
    if checksum in (None, in_file):
        return torn
    return _changed(f"the {seen.rows:,} rows")


def _judge_open(known: Known, seen: Bytes, torn: str) -> Integrity:
    """Judge a recording without an end, by its last checkpoint."""
    sidecar = known.sidecar
    size = sidecar.seal.bytes
    claimed = sidecar.seal.rows or 0
    doubts = list[str]()
    verified = 0
    if size is not None and seen.size < size:
        missing = f"{size - seen.size:,} bytes before its last checkpoint"
        doubts.append(f"the file ends {missing}: rows that were written are missing")
    elif size is not None and seen.marked == sidecar.seal.crc32:
        verified = min(claimed, seen.rows)
    elif sidecar.has_checkpoint:
        doubts.append(_changed(f"the first {claimed:,} rows"))
    if torn and not known.running and seen.size >= (size or 0):
        doubts.append(torn)
    part = "no row is verified"
    if verified:
        part = f"the first {verified:,} of {seen.rows:,} rows are verified"
    if known.running:
        limit = f"still being recorded: only the rows written until now are there; {part}"
    else:
        why = "" if sidecar.has_checkpoint else " (it has no checkpoint)"
        limit = (
            "no end in the sidecar: the recording was not closed; "
            f"{part}{why}; palpate check --repair writes an end"
        )
    return Integrity(tuple(doubts), (limit,), (), verified)


def _changed(rows: str) -> str:
    return (
        "the rows were changed after they were written, or the sidecar belongs to another "
        f"recording (checksum of {rows} differs): results may be wrong; take the file from a copy"
    )
