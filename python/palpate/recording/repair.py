"""Repairs a recording that was not closed, or that has damaged places.

A repair keeps the rows that can be read, and reports what was taken out. NAME.csv.unrepaired and
NAME.json.unrepaired have the bytes of the files before it, each only if it was changed. A second
repair writes NAME.csv.unrepaired-2 and so on: no file is overwritten.
"""

import os
import shutil
import zlib
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path

from palpate.errors import RecordingError
from palpate.files import STANDARD_INPUT, Json, open_regular, to_disk, write_file
from palpate.recording import sidecar
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.integrity import judge

_PACKED = (
    "not repaired: it is standard input, or a packed or converted file: unpack it, and repair that"
)


def reason_against_repair(recording: RecordingFile, *, remove_damage: bool) -> str | None:
    """Return why a recording must not be repaired: "" if nothing is wrong; None: it can be repaired."""
    known = recording.known
    damage = recording.damaged
    if known.running:
        return "not repaired: it is still being recorded"
    if damage and not remove_damage:
        size = sum(place.bytes for place in damage)
        return (
            f"not repaired: {size:,} damaged bytes would be taken out, and kept in a file: "
            "not confirmed"
        )
    has_sidecar = bool(known.sidecar.entries)
    if damage or (has_sidecar and known.sidecar.end is None):
        return _PACKED if _is_packed(recording) else None
    lines = "the other lines are rows" if recording.seen.torn else "every line is a row"
    if not has_sidecar:
        return f"not repaired: {lines}, and what the sidecar said cannot be known again"
    if not recording.doubts:
        return ""
    is_changed = known.sidecar.intact is False
    missing = (known.sidecar.seal.rows or 0) - recording.survey.rows
    if missing > 0 and not is_changed:
        return (
            f"not repaired: {missing:,} rows that were written are missing: "
            "take the file from a copy"
        )
    if is_changed and len(recording.doubts) == 1:
        return (
            "not repaired: only the sidecar was changed, and "
            "what it said before cannot be known: take it from a copy"
        )
    return f"not repaired: {lines}, and which ones are not as they were written cannot be known"


def _is_packed(recording: RecordingFile) -> bool:
    """Return whether a file is not plain text: it is left as it is."""
    path = recording.path
    return recording.data is not None or path == STANDARD_INPUT or path.suffix.lower() == ".gz"


def repair_files(recording: RecordingFile) -> None:
    """Remove damage, and write the end; after a RecordingError all files are as they were."""
    path = recording.path.resolve()
    beside = sidecar.sidecar_path(recording.path).resolve()
    try:
        with open_regular(path) as file:
            before = file.read()
        if (len(before), zlib.crc32(before)) != (recording.seen.size, recording.seen.crc32):
            raise OSError("it has changed in the meantime")
        after = _without(recording, before)
        suffix = _free_suffix(path, beside)
        with ExitStack() as undo:
            if beside.exists():
                _keep(beside, suffix, undo)
            if after != before:
                kept = _keep(path, suffix, undo)
                write_file(path, after)
                undo.callback(kept.replace, path)
            done = _report(recording, path.name + suffix)
            sidecar.save(beside, _document(recording, done, after))
            undo.pop_all()
    except OSError as error:
        reason = f"cannot be repaired: {error.strerror or error}; all files are as they were"
        raise RecordingError(recording.path, reason) from error


def _without(recording: RecordingFile, data: bytes) -> bytes:
    """Return the header and the rows: without damaged places and an incomplete last row."""
    parts = list[bytes]()
    if not recording.headed:
        parts.append((",".join(recording.columns) + "\n").encode())
    begin = 0
    for place in recording.damaged:
        parts.append(data[begin : place.offset])
        begin = place.offset + place.bytes
    parts.append(data[begin : len(data) - recording.seen.torn])
    return b"".join(parts)


def _free_suffix(*paths: Path) -> str:
    """Return a suffix for the names of the files before the repair: no file has these names."""
    suffix = ".unrepaired"
    number = 1
    while any(os.path.lexists(f"{path}{suffix}") for path in paths):
        number += 1
        suffix = f".unrepaired-{number}"
    return suffix


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


def _document(recording: RecordingFile, done: str, data: bytes) -> Json:
    """Return the sidecar after the repair; its end counts the rows that are left."""
    known = recording.known
    again = RecordingFile(recording.path, known, data)
    for _ in again.blocks():
        pass
    rows = again.survey.rows
    found = again.integrity
    if found.doubts:
        # The rest is not as it was written: it may have been so together with the removed places.
        found = judge(known, replace(recording.seen, torn=0))
    if not known.sidecar.entries or known.sidecar.end:
        found = found._replace(doubts=(*found.doubts, *found.limits))
    document = dict(known.sidecar.entries)
    if not document:
        device = {**recording.describe(), "full_scale_pF": recording.full_scale_pF}
        document = sidecar.made(device, 0, b"")
    document.pop("checkpoint", None)
    before = known.sidecar.entries.get("end", {})
    end = {
        "dropped": 0,
        **before,
        "rows": rows,
        "bytes": len(data),
        "crc32": again.seen.crc32,
        "clean": False,
        "verified": found.verified,
        "repaired": f"{done}; {found.verified:,} of {rows:,} rows are verified",
    }
    doubts = found.doubts_before("repair", known.sidecar.end)
    if doubts:
        end["doubts"] = doubts
    return {**document, "schema": sidecar.SCHEMA, "end": end}


def _report(recording: RecordingFile, kept: str) -> str:
    """Return what was taken out."""
    removed = list[str]()
    places = [place for place in recording.damaged if place.bytes]
    if places:
        size = sum(place.bytes for place in places)
        count = "1 damaged place" if len(places) == 1 else f"{len(places)} damaged places"
        removed.append(f"{size} bytes of {count}, from line {places[0].line} on")
    if recording.seen.torn:
        removed.append(f"{recording.seen.torn} bytes of an incomplete row")
    done = list[str]()
    if removed:
        done.append(f"removed {' and '.join(removed)} (the file before: {kept})")
    if not recording.headed:
        done.append("wrote the missing header")
    return ", ".join(done) or "wrote the missing end"
