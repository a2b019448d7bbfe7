"""Checks whether a recording is complete, and whether samples are missing or saturated."""

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.files import Json
from palpate.recording.counts import Survey
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.integrity import SOURCE_FAILED
from palpate.recording.opened import Damage, OpenedRecording
from palpate.recording.reading import recorded
from palpate.recording.repair import reason_against_repair, repair_files
from palpate.recording.sidecar import BEGUN


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
        rows = "samples lost" if self.survey.lost else "complete"
        failed = any(text.startswith(SOURCE_FAILED) for text in self.findings)
        end = "until the source failed" if failed else "clean end"
        return f"{rows}, {end}"

    def as_dict(self) -> Json:
        """Return the fields as plain values, for JSON."""
        survey = self.survey
        counts = {
            name: value
            for name, value in asdict(survey).items()
            if isinstance(value, int) and not name.endswith("_ns")
        }
        return {
            "file": str(self.path),
            "clean": self.clean,
            "running": self.running,
            "repaired": self.repaired,
            "changed": self.changed,
            "understood": self.understood,
            "seconds": survey.seconds if self.timed else None,
            **counts,
            "faults": list(self.faults),
            "findings": list(self.findings),
            "verified": self.verified,
            "damaged": [place._asdict() for place in self.damaged],
        }


def check(
    path: str | os.PathLike[str], *, repair: bool = False, remove_damage: bool = False, **table: Any
) -> Verification:
    """Check whether a recording is complete, and whether samples are missing or saturated.

    Parameters
    ----------
    path : path-like
    repair : bool
        If the recording was not closed: remove an incomplete last row, and write the end into the
        sidecar. The files before it are kept in NAME.csv.unrepaired and NAME.json.unrepaired. A
        file that is still being recorded is not changed; nor is one with an end, unless it has
        damaged places.
    remove_damage : bool
        With `repair`: also remove damaged places, which are more than an incomplete last row. The
        rows of before and after are kept, and the missing ones are a gap in `seq`.
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
    return check_opened(recorded(path, **table), repair=repair, remove_damage=remove_damage)


def check_opened(
    recording: OpenedRecording, *, repair: bool = False, remove_damage: bool = False
) -> Verification:
    """Check a recording that is open already, as `check`."""
    recording.skip_damage()
    for _ in recording.blocks():
        pass
    if not repair or not isinstance(recording, RecordingFile):
        return verification_of(recording)
    reason = reason_against_repair(recording, remove_damage=remove_damage)
    if reason is not None:
        return verification_of(recording, reason)
    repair_files(recording)
    return check(recording.path)


def verification_of(recording: OpenedRecording, not_repaired: str = "") -> Verification:
    """Return the result of `check` for a recording that was read to its end.

    Parameters
    ----------
    recording : OpenedRecording
    not_repaired : str
        Why it was not repaired; empty: nothing to say.
    """
    if isinstance(recording, RecordingFile):
        return _verification_of_file(recording, not_repaired)
    return Verification(
        recording.path,
        recording.survey,
        clean=None,
        running=False,
        repaired=False,
        faults=(),
        findings=(*_findings(recording.survey, None), *recording.notes),
        timed=recording.timed,
        understood=recording.understood,
    )


def _verification_of_file(recording: RecordingFile, not_repaired: str) -> Verification:
    survey = recording.survey
    integrity = recording.integrity
    damage = recording.damaged
    end = recording.sidecar.end
    doubts = list(integrity.doubts)
    advice = not_repaired
    if damage and not advice:
        advice = _ADVICE
    if recording.seen.torn and doubts and not_repaired and not damage:
        # One sentence on the row that is cut off.
        doubts[-1] += f"; {not_repaired}"
        advice = ""
    faults = [*integrity.limits, *doubts, *_faults(survey, damage)]
    if advice:
        faults.append(advice)
    findings = list(integrity.remarks)
    findings += [note for note in recording.recorder_notes if not note.startswith(BEGUN)]
    if survey.pause_note:
        findings.append(survey.pause_note)
    findings += _findings(survey, end.dropped if end else None)
    repaired = end is not None and end.repaired is not None
    has_all_rows = recording.sidecar.seal.rows == survey.rows
    return Verification(
        recording.path,
        survey,
        clean=end is not None and end.clean and not faults,
        running=recording.known.running,
        repaired=repaired,
        faults=tuple(faults),
        findings=tuple(findings),
        verified=integrity.verified,
        damaged=tuple(damage),
        changed=bool(integrity.doubts) and not integrity.limits and not repaired and has_all_rows,
    )


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
    more = damage[_SHOWN:]
    if more:
        yield f"damaged: {len(more)} more places, {sum(place.bytes for place in more)} bytes"
    if survey.disordered:
        yield f"{survey.disordered} rows out of order: their seq does not rise"
    if survey.backward:
        yield f"time goes back at {survey.backward} rows"
    if survey.miscoded:
        yield (
            f"{survey.miscoded} rows have codes above {survey.largest_code}, "
            "the largest of the converter"
        )


def _findings(survey: Survey, dropped: object) -> Iterator[str]:
    if survey.lost:
        yield f"{survey.lost} samples lost {survey.in_gaps}"
    if dropped:
        yield f"{dropped!s:.20} samples were read, but are not in the file"
    if survey.refused:
        yield f"{survey.refused} rows without a usable value"
    if survey.excitation:
        yield f"{survey.excitation} of them with the excitation shorted or overloaded"
    if survey.hard_saturated:
        yield f"saturated: {survey.hard_saturated} rows in the hard channel"
    if survey.soft_saturated:
        yield f"saturated: {survey.soft_saturated} rows in the soft channel"
    if survey.rows == 0:
        yield "no rows"
