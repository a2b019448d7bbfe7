"""Repairs a recording: takes out what is no row, keeps that, and keeps the files as they were before.

Beside NAME.csv there are then:

- NAME.csv.unrepaired and NAME.json.unrepaired: the bytes of the files before the repair, each only if it was changed.
- NAME.torn: what was taken out. Its first line is JSON: `file`, `bytes` and `crc32` of the file before the repair, and
  `parts`, each with `offset` and `bytes` in that file; after that line come the bytes of the parts, one after the
  other. With `written` (a header that was missing) it tells text that was put before everything else.

A second repair writes NAME.csv.unrepaired-2 and so on: no file is overwritten.
"""

import json
import os
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from palpate.errors import RecordingError
from palpate.files import open_regular, replacing
from palpate.recording import sidecar
from palpate.recording.integrity import judge
from palpate.recording.lines import Damage, Pass
from palpate.recording.own_file import Recorded
from palpate.systems import to_disk
from palpate.tables.packed import is_packed

_CHUNK = 1 << 20
_PACKED = "not repaired: it is standard input, or a packed file: unpack it, and repair that"
_FORMAT = "palpate-torn-1"


class _Names(NamedTuple):
    rows: Path
    document: Path
    torn: Path


class _Plan(NamedTuple):
    """What is taken out: ranges of bytes; and whether the header is written anew."""

    parts: list[tuple[int, int]]
    written: bytes


def why_not(recording: Recorded, damage: list[Damage], *, remove_damage: bool) -> str | None:
    """Return why a recording is not to be repaired: "" if there is nothing to repair; None if it is to be."""
    known = recording.known
    if known.running:
        return "not repaired: it is still being recorded"
    if damage and not remove_damage:
        return (
            f"not repaired: {sum(place.bytes for place in damage):,} damaged bytes would be taken out, and kept in a file: "
            "not confirmed"
        )
    if damage or (known.document is not None and not known.end):
        return _PACKED if is_packed(recording.path) else None
    if known.document is None:
        return "not repaired: every line is a row, and what the sidecar said cannot be known again"
    if recording.doubts:
        return f"not repaired: {_why_doubted(recording)}"
    return ""


def _why_doubted(recording: Recorded) -> str:
    """Return why a recording with an end, in which every line is a row, cannot be repaired."""
    known, rows = recording.known, recording.survey.rows
    if known.intact is not False and known.rows > rows:
        return f"{known.rows - rows:,} rows that were written are missing: take the file from a copy"
    if known.intact is False and len(recording.doubts) == 1:
        return "only the sidecar was changed, and what it said before cannot be known: take it from a copy"
    return "every line is a row, and which ones are not as they were written cannot be known"


def repair(recording: Recorded, damage: list[Damage]) -> None:
    """Take out damaged places and an incomplete last row, and write the end into the sidecar.

    Parameters
    ----------
    recording : Recorded
        After `blocks(damage)`.
    damage : list of Damage

    Raises
    ------
    RecordingError
        A file cannot be written, or has changed in the meantime: then all is as it was.
    """
    rows = recording.path.resolve()
    beside = sidecar.sidecar_path(recording.path).resolve()
    try:
        names = _free(rows, beside)
        plan = _plan(recording, damage)
        with ExitStack() as undo:
            if beside.exists():
                _keep(beside, names.document, undo)
            seen = recording.seen
            if plan.parts or plan.written:
                _keep(rows, names.rows, undo)
                seen = _take_out(recording, plan, names, undo)
            sidecar.save(beside, _document(recording, _done(recording, damage, names.torn.name), seen))
            undo.pop_all()
    except OSError as error:
        reason = f"cannot be repaired: {error.strerror or error}; all files are as they were"
        raise RecordingError(recording.path, reason) from error


def _plan(recording: Recorded, damage: list[Damage]) -> _Plan:
    parts = [(place.offset, place.bytes) for place in damage if place.bytes]
    if recording.torn_bytes:
        parts.append((recording.seen.size - recording.torn_bytes, recording.torn_bytes))
    return _Plan(parts, b"" if recording.headed else (",".join(recording.columns) + "\n").encode())


def _free(rows: Path, beside: Path) -> _Names:
    """Return three names that no file has."""
    for number in count(1):
        suffix = f"-{number}" if number > 1 else ""
        names = _Names(
            rows.with_name(f"{rows.name}.unrepaired{suffix}"),
            beside.with_name(f"{beside.name}.unrepaired{suffix}"),
            rows.with_name(f"{rows.stem}.torn{suffix}"),
        )
        if not any(os.path.lexists(name) for name in names):
            return names
    raise AssertionError


@contextmanager
def _created(path: Path, undo: ExitStack) -> Iterator[BinaryIO]:
    """Write a new file; if the repair fails, it is removed."""
    with path.open("xb") as file:
        undo.callback(path.unlink, missing_ok=True)
        yield file
        file.flush()
        to_disk(file.fileno())


def _keep(path: Path, kept: Path, undo: ExitStack) -> None:
    """Copy a file to a new name."""
    import shutil

    with open_regular(path) as file, _created(kept, undo) as copy:
        shutil.copyfileobj(file, copy, _CHUNK)
    with suppress(OSError):
        shutil.copymode(path, kept)


def _take_out(recording: Recorded, plan: _Plan, names: _Names, undo: ExitStack) -> Pass:
    """Write the torn parts, and the rows without them; return what was counted of the rows."""
    seen, rows = recording.seen, recording.path.resolve()
    about = {"format": _FORMAT, "file": rows.name, "bytes": seen.size, "crc32": seen.checksum}
    about |= {"parts": [{"offset": offset, "bytes": size} for offset, size in plan.parts]}
    about |= {"written": plan.written.decode()} if plan.written else {}
    with open_regular(names.rows) as kept:
        if _sum(_ranged(kept, 0, seen.size + 1)) != (seen.size, seen.checksum):
            raise OSError("it has changed in the meantime")
        with _created(names.torn, undo) as torn:
            torn.write(json.dumps(about).encode() + b"\n")
            for offset, size in plan.parts:
                torn.writelines(_ranged(kept, offset, size))
        left = Pass(rows, recording.known.marked)
        with replacing(rows) as file:
            for data in _remaining(kept, plan, seen.size):
                file.write(data)
                left.count(data)
    undo.callback(names.rows.replace, rows)
    return left


def _remaining(kept: BinaryIO, plan: _Plan, size: int) -> Iterator[bytes]:
    yield plan.written
    begin = 0
    for offset, length in [*plan.parts, (size, 0)]:
        yield from _ranged(kept, begin, offset - begin)
        begin = offset + length


def _ranged(file: BinaryIO, offset: int, size: int) -> Iterator[bytes]:
    file.seek(offset)
    while size and (data := file.read(min(size, _CHUNK))):
        size -= len(data)
        yield data


def _sum(parts: Iterator[bytes]) -> tuple[int, int]:
    """Return the size and the CRC-32 of bytes."""
    size = checksum = 0
    for part in parts:
        size, checksum = size + len(part), zlib.crc32(part, checksum)
    return size, checksum


def _document(recording: Recorded, done: str, seen: Pass) -> dict[str, Any]:
    """Return the sidecar after the repair: the rows of the end are those of now, not those that were measured."""
    known, rows = recording.known, recording.survey.rows
    after = judge(known, seen, rows)
    found = recording.integrity if after.doubts else after  # without what was added, it may be as it was written
    document = dict(known.document or _unknown(recording))
    document.pop("checkpoint", None)
    lost = found.doubts if known.document and not known.end else (*found.doubts, *found.limits)
    old = known.end.get("doubts", [])
    doubts = [text if text in old else f"before the repair: {text}" for text in lost]
    end = {"dropped": 0, **known.end, "rows": rows, "bytes": seen.size, "crc32": seen.checksum, "clean": False}
    end |= {"verified": found.verified, "repaired": f"{done}; {found.verified:,} of {rows:,} rows are verified"}
    end |= {"doubts": doubts} if doubts else {}
    return {**document, "schema": sidecar.SCHEMA, "end": end}


def _unknown(recording: Recorded) -> dict[str, Any]:
    """Return the sidecar of a recording that has lost its own."""
    return sidecar.made({**recording.describe(), "full_scale_pF": recording.full_scale_pF}, 0, b"")


def _done(recording: Recorded, damage: list[Damage], torn: str) -> str:
    parts = [place for place in damage if place.bytes]
    count_ = "1 damaged place" if len(parts) == 1 else f"{len(parts)} damaged places"
    removed = (
        [f"{sum(place.bytes for place in parts)} bytes of {count_}, from line {parts[0].line} on"] if parts else []
    )
    removed += [f"{recording.torn_bytes} bytes of an incomplete row"] if recording.torn_bytes else []
    done = [f"removed {' and '.join(removed)} (kept in {torn})"] if removed else []
    done += [] if recording.headed else ["wrote the missing header"]
    return ", ".join(done) or "wrote the missing end"
