"""Repairs a recording: keeps the files as they were, keeps the rows that can be read, and reports what was taken out.

NAME.csv.unrepaired and NAME.json.unrepaired have the bytes of the files before the repair, each only if it was changed.
A second repair writes NAME.csv.unrepaired-2 and so on: no file is overwritten.
"""

import os
import shutil
import zlib
from contextlib import ExitStack, suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

from palpate.errors import RecordingError
from palpate.files import open_regular, write
from palpate.recording import sidecar
from palpate.recording.integrity import judge
from palpate.recording.own_file import Damage, Recorded
from palpate.systems import to_disk
from palpate.tables.packed import STANDARD_INPUT

_PACKED = "not repaired: it is standard input, or a packed or converted file: unpack it, and repair that"


def why_not(recording: Recorded, damage: list[Damage], *, remove_damage: bool) -> str | None:
    """Return why a recording is not to be repaired: "" if there is nothing to repair; None if it is to be."""
    known, rows = recording.known, recording.survey.rows
    if known.running:
        return "not repaired: it is still being recorded"
    if damage and not remove_damage:
        size = sum(place.bytes for place in damage)
        return f"not repaired: {size:,} damaged bytes would be taken out, and kept in a file: not confirmed"
    if damage or (known.document and not known.end):
        path = recording.path  # a packed file of another name is no text that can be repaired: it is left as it is
        is_packed = recording.data is not None or path == STANDARD_INPUT or path.suffix.lower() == ".gz"
        return _PACKED if is_packed else None
    lines = "the other lines are rows" if recording.seen.torn else "every line is a row"
    if not known.document:
        return f"not repaired: {lines}, and what the sidecar said cannot be known again"
    if not recording.doubts:
        return ""
    missing = (known.sealed("rows") or 0) - rows
    if known.intact is not False and missing > 0:
        return f"not repaired: {missing:,} rows that were written are missing: take the file from a copy"
    if known.intact is False and len(recording.doubts) == 1:
        return (
            "not repaired: only the sidecar was changed, and what it said before cannot be known: take it from a copy"
        )
    return f"not repaired: {lines}, and which ones are not as they were written cannot be known"


def repair(recording: Recorded, damage: list[Damage]) -> None:
    """Take out what `blocks(damage)` has found, and write the end; after a RecordingError all files are as they were."""
    path, beside = recording.path.resolve(), sidecar.sidecar_path(recording.path).resolve()
    try:
        with open_regular(path) as file:
            before = file.read()
        if (len(before), zlib.crc32(before)) != (recording.seen.size, recording.seen.crc32):
            raise OSError("it has changed in the meantime")
        after = _without(recording, damage, before)
        suffix = _free_suffix(path, beside)
        with ExitStack() as undo:
            if beside.exists():
                _keep(beside, suffix, undo)
            if after != before:
                kept = _keep(path, suffix, undo)
                write(path, after)
                undo.callback(kept.replace, path)
            done = _report(recording, damage, path.name + suffix)
            sidecar.save(beside, _document(recording, done, after))
            undo.pop_all()
    except OSError as error:
        reason = f"cannot be repaired: {error.strerror or error}; all files are as they were"
        raise RecordingError(recording.path, reason) from error


def _without(recording: Recorded, damage: list[Damage], data: bytes) -> bytes:
    """Return the header and the rows: without damaged places and an incomplete last row."""
    ends = [0, *(place.offset + place.bytes for place in damage)]
    begins = [*(place.offset for place in damage), len(data) - recording.seen.torn]
    header = b"" if recording.headed else (",".join(recording.columns) + "\n").encode()
    return header + b"".join(data[end:begin] for end, begin in zip(ends, begins, strict=True))


def _free_suffix(*paths: Path) -> str:
    """Return what to add to the names of the files as they were: no file has these names."""
    suffixes = (f".unrepaired{f'-{number}' if number > 1 else ''}" for number in count(1))
    return next(suffix for suffix in suffixes if not any(os.path.lexists(f"{path}{suffix}") for path in paths))


def _keep(path: Path, suffix: str, undo: ExitStack) -> Path:
    """Copy a file to a new name; if the repair fails, the copy is removed."""
    kept = path.with_name(path.name + suffix)
    with open_regular(path) as file, kept.open("xb") as copy:
        undo.callback(kept.unlink, missing_ok=True)
        shutil.copyfileobj(file, copy)
        copy.flush()
        to_disk(copy.fileno())
    with suppress(OSError):
        shutil.copymode(path, kept)
    return kept


def _document(recording: Recorded, done: str, data: bytes) -> dict[str, Any]:
    """Return the sidecar after the repair: its end counts the rows that are left, not the rows that were measured."""
    known, again = recording.known, Recorded(recording.path, recording.known, data)
    for _ in again.blocks():
        pass
    rows, found = again.survey.rows, again.integrity
    if found.doubts:  # what is left is not as it was written: it may have been so with what is taken out
        found = judge(known, replace(recording.seen, torn=0))
    if not known.document or known.end:
        found = found._replace(doubts=(*found.doubts, *found.limits))
    unknown = {**recording.describe(), "full_scale_pF": recording.full_scale_pF}
    document = dict(known.document or sidecar.made(unknown, 0, b""))
    document.pop("checkpoint", None)
    end = {"dropped": 0, **known.end, "rows": rows, "bytes": len(data), "crc32": again.seen.crc32, "clean": False}
    end |= {"verified": found.verified, "repaired": f"{done}; {found.verified:,} of {rows:,} rows are verified"}
    if doubts := found.doubts_before("repair", known.end):
        end["doubts"] = doubts
    return {**document, "schema": sidecar.SCHEMA, "end": end}


def _report(recording: Recorded, damage: list[Damage], kept: str) -> str:
    """Return what was taken out."""
    parts, torn, removed = [place for place in damage if place.bytes], recording.seen.torn, list[str]()
    if parts:
        places = "1 damaged place" if len(parts) == 1 else f"{len(parts)} damaged places"
        removed.append(f"{sum(place.bytes for place in parts)} bytes of {places}, from line {parts[0].line} on")
    if torn:
        removed.append(f"{torn} bytes of an incomplete row")
    done = [f"removed {' and '.join(removed)} (the file before: {kept})"] if removed else []
    done += [] if recording.headed else ["wrote the missing header"]
    return ", ".join(done) or "wrote the missing end"
