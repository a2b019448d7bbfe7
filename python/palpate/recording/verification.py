"""Checks whether a recording is complete, and whether samples are missing or saturated."""

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.filelock import is_locked
from palpate.recording.foreign import Foreign, recorded
from palpate.recording.own_file import Recorded
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
        Lost, refused or saturated samples in the measurement itself.

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

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain values, for JSON."""
        survey = self.survey
        numbers = {name: value for name, value in asdict(survey).items() if isinstance(value, int)}
        return {
            "file": str(self.path),
            "clean": self.clean,
            "running": self.running,
            "repaired": self.repaired,
            "seconds": survey.seconds,
            **{name: value for name, value in numbers.items() if not name.endswith("_ns")},
            "faults": list(self.faults),
            "findings": list(self.findings),
        }


def check(path: str | os.PathLike[str], *, repair: bool = False, **table: Any) -> Verification:
    """Check whether a recording is complete, and whether samples are missing or saturated.

    Parameters
    ----------
    path : path-like
    repair : bool
        If the recording was not closed: remove an incomplete last row, and write the end into the sidecar. A file that
        is still being recorded is not changed.
    **table
        `columns` and `unit`, as in `palpate.read`.

    Returns
    -------
    Verification

    Raises
    ------
    RecordingError
        Not a recording, or a line is not a row.

    Examples
    --------
    >>> check("tests/data/four-specimens.csv").survey.lost
    0
    """
    recording = recorded(path, **table)
    for _ in recording.blocks():
        pass
    if isinstance(recording, Foreign):
        findings = (*_findings(recording.survey), *recording.notes)
        return Verification(recording.path, recording.survey, None, False, False, (), findings)
    running = is_locked(recording.path)
    if repair and not running and recording.document is not None and "end" not in recording.document:
        _repair(recording)
        return check(path)
    end = (recording.document or {}).get("end", {})
    faults, findings = tuple(_faults(recording, end)), tuple(_findings(recording.survey, end))
    clean = bool(end.get("clean")) and not faults
    return Verification(recording.path, recording.survey, clean, running, "repaired" in end, faults, findings)


def _faults(recording: Recorded, end: dict[str, Any]) -> Iterator[str]:
    if recording.document is None:
        yield "no valid sidecar: device and end of the recording are unknown"
    elif not end:
        yield "no end in the sidecar: the recording was not closed, or is still running; --repair writes an end"
    else:
        yield from _wrong_end(recording, end)
    survey = recording.survey
    counts = {
        f"{recording.torn_bytes} bytes after the last complete row": recording.torn_bytes,
        f"{survey.disordered} rows out of order: their seq does not rise": survey.disordered,
        f"time goes back at {survey.backward} rows": survey.backward,
        f"{survey.miscoded} rows have codes of more than 24 bits": survey.miscoded,
    }
    yield from (text for text, holds in counts.items() if holds)


def _wrong_end(recording: Recorded, end: dict[str, Any]) -> Iterator[str]:
    rows = recording.survey.rows
    if end.get("rows") != rows:
        yield f"{rows} rows in the file, but {end.get('rows')} were written"
    elif end.get("crc32", recording.checksum) != recording.checksum:
        yield "checksum differs: the rows were changed, or the sidecar belongs to another recording"
    if not end.get("clean") and "repaired" not in end:
        yield f"the recorder stopped with an error: {end.get('error')}"


def _findings(survey: Survey, end: dict[str, Any] | None = None) -> Iterator[str]:
    end = end or {}
    if "repaired" in end:
        yield f"repaired: {end['repaired']}"
    elif end.get("error"):
        yield f"the source ended with an error: {end['error']}"
    counts = {
        f"{survey.lost} samples lost {survey.in_gaps}": survey.lost,
        f"{end.get('dropped')} samples read but not written": end.get("dropped"),
        f"{survey.refused} rows without a usable value": survey.refused,
        f"{survey.excitation} of them with the excitation shorted or overloaded": survey.excitation,
        f"saturated: {survey.hard_saturated} rows in the hard channel": survey.hard_saturated,
        f"saturated: {survey.soft_saturated} rows in the soft channel": survey.soft_saturated,
        "no rows": survey.rows == 0,
    }
    yield from (text for text, holds in counts.items() if holds)


def _repair(recording: Recorded) -> None:
    """Repair a recording that was not closed: remove the incomplete row, write the end into the sidecar."""
    try:
        if recording.torn_bytes:
            size = recording.path.stat().st_size - recording.torn_bytes
            os.truncate(recording.path, size)
        survey = recording.survey
        what = f"removed {recording.torn_bytes} bytes of an incomplete row"
        end = {"rows": survey.rows, "dropped": 0, "clean": False, "repaired": what, "crc32": recording.checksum}
        sidecar.save(sidecar.sidecar_path(recording.path), {**(recording.document or {}), "end": end})
    except OSError as error:
        raise RecordingError(recording.path, f"cannot be repaired: {error.strerror}") from error
