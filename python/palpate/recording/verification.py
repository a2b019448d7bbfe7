"""Checks whether a recording is complete, and whether samples are missing or saturated."""

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.recording.foreign import AnyRecording, recorded
from palpate.recording.integrity import SOURCE_FAILED
from palpate.recording.own_file import Damage, Recorded
from palpate.recording.repair import repair as mend
from palpate.recording.repair import why_not
from palpate.recording.sidecar import BEGUN
from palpate.recording.survey import Survey


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
        numbers = {name: value for name, value in asdict(survey).items() if isinstance(value, int)}
        flags = ("clean", "running", "repaired", "changed", "understood")
        return {
            "file": str(self.path),
            **{name: getattr(self, name) for name in flags},
            "seconds": survey.seconds if self.timed else None,
            **{name: value for name, value in numbers.items() if not name.endswith("_ns")},
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


def verified(recording: AnyRecording, *, repair: bool = False, remove_damage: bool = False) -> Verification:
    """Check a recording that is open already, as `check`."""
    damage: list[Damage] = []
    for _ in recording.blocks(damage):
        pass
    if not repair or not isinstance(recording, Recorded):
        return judged(recording, damage)
    refused = why_not(recording, damage, remove_damage=remove_damage)
    if refused is not None:
        return judged(recording, damage, refused)
    mend(recording, damage)
    return check(recording.path)


def judged(recording: AnyRecording, damage: list[Damage], refused: str = "") -> Verification:
    """Return what `check` says of a recording that was read to its end, what was left out, and why it is not repaired."""
    survey = recording.survey
    if not isinstance(recording, Recorded):
        found = (*_findings(survey, None), *recording.notes)
        timed, understood = recording.timed, recording.understood
        return Verification(recording.path, survey, None, False, False, (), found, timed=timed, understood=understood)
    known, integrity = recording.known, recording.integrity
    advice = refused or (_ADVICE if damage else "")
    doubts = list(integrity.doubts)
    if recording.seen.torn and doubts and refused and not damage:  # one sentence on the row that is cut off
        doubts[-1], advice = f"{doubts[-1]}; {refused}", ""
    faults = (*integrity.limits, *doubts, *_faults(survey, damage), *([advice] if advice else []))
    told = [note for note in recording.told if not note.startswith(BEGUN)]
    pause = [survey.told_pause] if survey.told_pause else []
    repaired = "repaired" in known.end
    clean = bool(known.end.get("clean")) and not faults
    findings = (*integrity.remarks, *told, *pause, *_findings(survey, known.end.get("dropped")))
    changed = bool(integrity.doubts) and not (integrity.limits or repaired) and known.sealed("rows") == survey.rows
    state = recording.path, survey, clean, known.running, repaired, faults, findings
    return Verification(*state, integrity.verified, tuple(damage), changed)


_SHOWN = 3  # damaged places
_ADVICE = "a damaged recording is not read; --repair takes out what is no row, and keeps it in a file"


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
