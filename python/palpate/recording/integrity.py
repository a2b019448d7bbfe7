"""Whether a recording is as it was written: its rows against the end or the checkpoint, its sidecar against its checksum."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.filelock import is_locked
from palpate.recording.lines import Pass
from palpate.tables.packed import STANDARD_INPUT, unpacked_name

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

    doubts: tuple[str, ...]
    limits: tuple[str, ...]
    remarks: tuple[str, ...]
    verified: int


@dataclass(frozen=True)
class Known:
    """What was known of a recording before its rows were read.

    Attributes
    ----------
    document : dict or None
        The sidecar; None: missing or not valid.
    intact : bool or None
        Whether the sidecar is as it was written; None: it has no checksum.
    problem : str
        Why there is no document.
    running : bool
        Whether it is still being recorded.
    """

    document: dict[str, Any] | None
    intact: bool | None
    problem: str
    running: bool

    @property
    def end(self) -> dict[str, Any]:
        """The end of the recording; empty without one."""
        return dict((self.document or {}).get("end", {}))

    @property
    def seal(self) -> dict[str, Any]:
        """Rows, bytes and CRC-32 of the end, or else of the last checkpoint; empty without both."""
        return self.end or dict((self.document or {}).get("checkpoint", {}))

    @property
    def rows(self) -> int:
        """Number of rows that were written, from the end; 0 without one."""
        return _count(self.end.get("rows")) or 0

    @property
    def marked(self) -> int | None:
        """Number of bytes that the CRC-32 is of; None: all, or unknown."""
        return _count(self.seal.get("bytes"))

    @property
    def is_old(self) -> bool:
        """Whether the sidecar has the first schema, in which a checksum may be missing."""
        return (self.document or {}).get("schema") != sidecar.SCHEMA


def known_of(path: Path) -> Known:
    """Return what is known of a recording, from its sidecar and its lock."""
    try:
        running = is_locked(path)  # before the sidecar is read: a recording that ends in between has its end there
        loaded = sidecar.load_checked(path)
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror or error}") from error
    except RecordingError as error:
        return Known(None, None, str(error), running)
    if loaded is None:
        missing = Path(unpacked_name(path)).with_suffix(".json").name
        problem = "standard input has none" if path == STANDARD_INPUT else f"{missing} is missing"
        return Known(None, None, problem, running)
    return Known(*loaded, "", running)


def judge(known: Known, seen: Pass, rows: int) -> Integrity:
    """Compare what was read with what is known.

    Parameters
    ----------
    known : Known
    seen : Pass
        The pass over the whole file.
    rows : int
        Number of rows in it.

    Returns
    -------
    Integrity
    """
    if known.document is None:
        what = "the rows cannot be verified, the device and its range are unknown"
        return Integrity((), (f"no valid sidecar ({known.problem}): {what}",), (), 0)
    found = _ended(known, seen, rows) if known.end else _open(known, seen, rows)
    if known.intact is not False:
        return found
    changed = (
        "the sidecar was changed after it was written (its checksum differs): device, settings, marks, end may be wrong"
    )
    only = (
        "; the rows agree with the checksum in it: take the sidecar from a copy"
        if found.verified and not found.doubts
        else ""
    )
    return found._replace(doubts=(changed + only, *found.doubts))


def _ended(known: Known, seen: Pass, rows: int) -> Integrity:
    end = known.end
    doubts, limits, remarks = list(map(str, _items(end, "doubts"))), list[str](), list(_remarks(end))
    checksum = _count(end.get("crc32"))
    held = seen.checksum if known.marked is None else seen.marked_checksum
    if held != checksum == seen.joined_checksum:
        held = checksum
        remarks.append("the line ends were changed to those of Windows; the rows are as they were written")
    if end.get("rows") != rows:
        written = f"{end.get('rows')!r:.20}"
        there = f"{rows} rows in the file, but {written}" if seen.size else f"the file is empty, but {written} rows"
        doubts.append(f"{there} were written")
    elif checksum is None and not known.is_old:
        doubts.append(
            "the end in the sidecar has no checksum, which palpate always writes: the rows cannot be verified"
        )
    elif checksum is None:
        remarks.append("no checksum in the sidecar, which an older palpate wrote: only the number of rows is verified")
    elif checksum != held:
        doubts.append(_changed(f"the {rows:,} rows"))
    if not end.get("clean") and "repaired" not in end:
        limits.append(f"the recorder stopped with an error: {end.get('error')!s:.300}")
    proven = rows if end.get("rows") == rows and checksum is not None and checksum == held else 0
    before = _count(end.get("verified"))  # of a repaired one
    return Integrity(tuple(doubts), tuple(limits), tuple(remarks), proven if before is None else min(proven, before))


def _remarks(end: dict[str, Any]) -> Iterator[str]:
    if "repaired" in end:
        yield f"repaired: {end['repaired']!s:.500}"
    elif end.get("clean") and end.get("error"):
        yield f"{SOURCE_FAILED}: {end['error']!s:.300}"


def _open(known: Known, seen: Pass, rows: int) -> Integrity:
    """Judge a recording without an end, by its last checkpoint."""
    size, checksum = known.marked, _count(known.seal.get("crc32"))
    claimed = _count(known.seal.get("rows")) or 0
    doubts, verified = list[str](), 0
    if size is not None and seen.size < size:
        doubts.append(
            f"the file ends {size - seen.size:,} bytes before its last checkpoint: rows that were written are missing"
        )
    elif size is not None and checksum is not None and seen.marked_checksum == checksum:
        verified = min(claimed, rows)
    elif known.seal:
        doubts.append(_changed(f"the first {claimed:,} rows"))
    return Integrity(tuple(doubts), (_unended(known, verified, rows),), (), verified)


def _unended(known: Known, verified: int, rows: int) -> str:
    part = f"the first {verified:,} of {rows:,} rows are verified" if verified else "no row is verified"
    if known.running:
        return f"still being recorded: only the rows written until now are there; {part}"
    why = "" if known.seal else " (it has no checkpoint)"
    return f"no end in the sidecar: the recording was not closed; {part}{why}; palpate check --repair writes an end"


def _changed(what: str) -> str:
    return (
        "the rows were changed after they were written, or the sidecar belongs to another recording (checksum of "
        f"{what} differs): results may be wrong; take the file from a copy"
    )


def _items(end: dict[str, Any], name: str) -> list[Any]:
    found = end.get(name, [])
    return found if isinstance(found, list) else [found]


def _count(value: Any) -> int | None:
    """Return a number from a sidecar, if it is one."""
    return value if type(value) is int and value >= 0 else None
