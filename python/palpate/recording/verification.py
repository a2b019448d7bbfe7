"""Checks whether a recording is complete, and whether samples are missing or saturated; and repairs it.

A repair keeps the rows that can be read, and reports what was taken out. NAME.csv.unrepaired and NAME.json.unrepaired
have the bytes of the files before it, each only if it was changed. A second repair writes NAME.csv.unrepaired-2 and so
on: no file is overwritten.
"""

import os
import shutil
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any

from palpate.errors import RecordingError
from palpate.files import STANDARD_INPUT, open_regular, to_disk, write_file
from palpate.recording import sidecar
from palpate.recording.counts import Survey
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.integrity import SOURCE_FAILED, judge
from palpate.recording.opened import Damage, OpenedRecording
from palpate.recording.reading import recorded


@dataclass(frozen=True)
class Verification:
    """The result of `check`.

    Attributes
    ----------
    path : pathlib.Path
    survey : Survey
        Counts over its rows.
    clean : bool or None
        Whether the recorder closed it properly; None: unknown, for a table of another logger.
    running : bool
        Whether it is still being recorded.
    repaired : bool
        Whether an unclean stop was repaired, now or earlier.
    faults : tuple of str
        Why the file may differ from the measured samples.
    findings : tuple of str
        Lost, refused or saturated samples in the measurement itself; and an earlier repair.
    verified : int
        Rows whose checksum is right.
    damaged : tuple of Damage
        Places in the file that are no rows.
    changed : bool
        Whether no row is missing, but the recording is not as it was written.
    timed : bool
        Whether the times of its rows are known.
    understood : str
        Of a table of another program: one line that says which columns and units were used.

    Examples
    --------
    >>> found = check("tests/data/four-specimens.csv")
    >>> found.survey.lost, found.running
    (0, False)
    """

    path: Path
    survey: Survey
    clean: bool | None
    running: bool
    repaired: bool
    faults: tuple[str, ...]
    findings: tuple[str, ...]
    verified: int = 0
    damaged: tuple[Damage, ...] = ()
    changed: bool = False
    timed: bool = True
    understood: str = ""

    @property
    def verdict(self) -> str:
        """What became of the recording, in a few words.

        Examples
        --------
        >>> check("tests/data/four-specimens.csv").verdict
        'complete, clean end'
        """
        if self.running:
            return "still being recorded"
        if self.faults:
            return "changed" if self.changed else "not complete"
        if self.repaired:
            return "repaired"
        if self.clean is None:
            return "readable"
        failed = any(text.startswith(SOURCE_FAILED) for text in self.findings)
        return "complete, until the source failed" if failed else "complete, clean end"

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain values, for JSON."""
        survey = self.survey
        counts = {name: value for name, value in asdict(survey).items() if isinstance(value, int)}
        flags = ("clean", "running", "repaired", "changed", "understood")
        return {
            "file": str(self.path),
            **{name: getattr(self, name) for name in flags},
            "seconds": survey.seconds if self.timed else None,
            **{name: value for name, value in counts.items() if not name.endswith("_ns")},
            "faults": list(self.faults),
            "findings": list(self.findings),
            "verified": self.verified,
            "damaged": [place._asdict() for place in self.damaged],
        }


def check(
    path: str | os.PathLike[str], *, repair: bool = False, remove_damage: bool = False, **table: Any
) -> Verification:
    """Check whether a recording is complete and as it was written, and whether samples are missing or saturated.

    Parameters
    ----------
    path : path-like
    repair : bool
        If the recording was not closed: remove an incomplete last row, and write the end into the sidecar. The files
        before it are kept in NAME.csv.unrepaired and NAME.json.unrepaired. A file that is still being recorded is not
        changed; nor is one with an end, unless it has damaged places.
    remove_damage : bool
        With `repair`: also remove damaged places, which are more than an incomplete last row. The rows of before and
        after are kept, and the missing ones are a gap in `seq`.
    **table
        `columns` and `unit`, as in `palpate.read`.

    Returns
    -------
    Verification

    Raises
    ------
    RecordingError
        Not a recording, or it cannot be repaired: then all files are as they were.

    Examples
    --------
    >>> check("tests/data/four-specimens.csv").survey.lost
    0
    """
    return verified(recorded(path, **table), repair=repair, remove_damage=remove_damage)


def verified(
    recording: OpenedRecording, *, repair: bool = False, remove_damage: bool = False
) -> Verification:
    """Check a recording that is open already, as `check`."""
    recording.skip_damage()
    for _ in recording.blocks():
        pass
    if not repair or not isinstance(recording, RecordingFile):
        return judged(recording)
    refused = why_not(recording, remove_damage=remove_damage)
    if refused is not None:
        return judged(recording, refused)
    repair_files(recording)
    return check(recording.path)


def judged(recording: OpenedRecording, refused: str = "") -> Verification:
    """Return what `check` says of a recording that was read to its end, what was left out, and why it is not repaired."""
    survey = recording.survey
    if not isinstance(recording, RecordingFile):
        found = (*_findings(survey, None), *recording.notes)
        timed, understood = recording.timed, recording.understood
        return Verification(
            recording.path,
            survey,
            None,
            False,
            False,
            (),
            found,
            timed=timed,
            understood=understood,
        )
    known, integrity, damage = recording.known, recording.integrity, recording.damaged
    advice = refused or (_ADVICE if damage else "")
    doubts = list(integrity.doubts)
    if (
        recording.seen.torn and doubts and refused and not damage
    ):  # one sentence on the row that is cut off
        doubts[-1], advice = f"{doubts[-1]}; {refused}", ""
    faults = (*integrity.limits, *doubts, *_faults(survey, damage), *([advice] if advice else []))
    told = [note for note in recording.recorder_notes if not note.startswith(sidecar.BEGUN)]
    pause = [survey.pause_note] if survey.pause_note else []
    repaired = "repaired" in known.end
    clean = bool(known.end.get("clean")) and not faults
    findings = (*integrity.remarks, *told, *pause, *_findings(survey, known.end.get("dropped")))
    changed = (
        bool(integrity.doubts)
        and not (integrity.limits or repaired)
        and known.sealed("rows") == survey.rows
    )
    state = recording.path, survey, clean, known.running, repaired, faults, findings
    return Verification(*state, integrity.verified, tuple(damage), changed)


_SHOWN = 3  # damaged places
_ADVICE = (
    "a damaged recording is not read; --repair takes out what is no row, and keeps it in a file"
)


def _faults(survey: Survey, damage: list[Damage]) -> Iterator[str]:
    for place in damage[:_SHOWN]:
        last = place.line + max(place.lines, 1) - 1
        where = f"line {place.line}" if last == place.line else f"lines {place.line} to {last}"
        around = f"{place.rows_before} rows before, {survey.rows - place.rows_before} after"
        yield f"damaged: {where}, {place.bytes} bytes ({place.reason}); {around}"
    if more := damage[_SHOWN:]:
        yield f"damaged: {len(more)} more places, {sum(place.bytes for place in more)} bytes"
    counts = {
        f"{survey.disordered} rows out of order: their seq does not rise": survey.disordered,
        f"time goes back at {survey.backward} rows": survey.backward,
        f"{survey.miscoded} rows have codes above {survey.largest_code}, the largest of the converter": survey.miscoded,
    }
    yield from (text for text, count in counts.items() if count)


def _findings(survey: Survey, dropped: Any) -> Iterator[str]:
    counts = {
        f"{survey.lost} samples lost {survey.in_gaps}": survey.lost,
        f"{dropped!s:.20} samples were read, but are not in the file": dropped,
        f"{survey.refused} rows without a usable value": survey.refused,
        f"{survey.excitation} of them with the excitation shorted or overloaded": survey.excitation,
        f"saturated: {survey.hard_saturated} rows in the hard channel": survey.hard_saturated,
        f"saturated: {survey.soft_saturated} rows in the soft channel": survey.soft_saturated,
        "no rows": survey.rows == 0,
    }
    yield from (text for text, count in counts.items() if count)


_PACKED = (
    "not repaired: it is standard input, or a packed or converted file: unpack it, and repair that"
)


def why_not(recording: RecordingFile, *, remove_damage: bool) -> str | None:
    """Return why a recording is not to be repaired: "" if there is nothing to repair; None if it is to be."""
    known, rows, damage = recording.known, recording.survey.rows, recording.damaged
    if known.running:
        return "not repaired: it is still being recorded"
    if damage and not remove_damage:
        size = sum(place.bytes for place in damage)
        return f"not repaired: {size:,} damaged bytes would be taken out, and kept in a file: not confirmed"
    if damage or (known.document and not known.end):
        path = (
            recording.path
        )  # a packed file of another name is no text that can be repaired: it is left as it is
        is_packed = (
            recording.data is not None or path == STANDARD_INPUT or path.suffix.lower() == ".gz"
        )
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
        lines, which = (
            "only the sidecar was changed",
            "what it said before cannot be known: take it from a copy",
        )
    else:
        which = "which ones are not as they were written cannot be known"
    return f"not repaired: {lines}, and {which}"


def repair_files(recording: RecordingFile) -> None:
    """Take out what `blocks()` has left out, and write the end; after a RecordingError all files are as they were."""
    path, beside = recording.path.resolve(), sidecar.sidecar_path(recording.path).resolve()
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
    ends = [0, *(place.offset + place.bytes for place in recording.damaged)]
    begins = [*(place.offset for place in recording.damaged), len(data) - recording.seen.torn]
    header = b"" if recording.headed else (",".join(recording.columns) + "\n").encode()
    return header + b"".join(data[end:begin] for end, begin in zip(ends, begins, strict=True))


def _free_suffix(*paths: Path) -> str:
    """Return what to add to the names of the files as they were: no file has these names."""
    suffixes = (f".unrepaired{f'-{number}' if number > 1 else ''}" for number in count(1))
    return next(
        suffix
        for suffix in suffixes
        if not any(os.path.lexists(f"{path}{suffix}") for path in paths)
    )


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


def _document(recording: RecordingFile, done: str, data: bytes) -> dict[str, Any]:
    """Return the sidecar after the repair: its end counts the rows that are left, not the rows that were measured."""
    known, again = recording.known, RecordingFile(recording.path, recording.known, data)
    for _ in again.blocks():
        pass
    rows, found = again.survey.rows, again.integrity
    if (
        found.doubts
    ):  # what is left is not as it was written: it may have been so with what is taken out
        found = judge(known, replace(recording.seen, torn=0))
    if not known.document or known.end:
        found = found._replace(doubts=(*found.doubts, *found.limits))
    unknown = {**recording.describe(), "full_scale_pF": recording.full_scale_pF}
    document = dict(known.document or sidecar.made(unknown, 0, b""))
    document.pop("checkpoint", None)
    end = {
        "dropped": 0,
        **known.end,
        "rows": rows,
        "bytes": len(data),
        "crc32": again.seen.crc32,
        "clean": False,
    }
    end |= {
        "verified": found.verified,
        "repaired": f"{done}; {found.verified:,} of {rows:,} rows are verified",
    }
    if doubts := found.doubts_before("repair", known.end):
        end["doubts"] = doubts
    return {**document, "schema": sidecar.SCHEMA, "end": end}


def _report(recording: RecordingFile, kept: str) -> str:
    """Return what was taken out."""
    parts, torn, removed = (
        [place for place in recording.damaged if place.bytes],
        recording.seen.torn,
        list[str](),
    )
    if parts:
        places = "1 damaged place" if len(parts) == 1 else f"{len(parts)} damaged places"
        removed.append(
            f"{sum(place.bytes for place in parts)} bytes of {places}, from line {parts[0].line} on"
        )
    if torn:
        removed.append(f"{torn} bytes of an incomplete row")
    done = [f"removed {' and '.join(removed)} (the file before: {kept})"] if removed else []
    done += [] if recording.headed else ["wrote the missing header"]
    return ", ".join(done) or "wrote the missing end"
