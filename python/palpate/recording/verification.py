"""What is wrong with a recording: whether it is whole, and what its samples lack."""

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
        Of its rows.
    clean : bool or None
        Whether the recorder ended it properly; None where nobody can know: another logger's table.
    running : bool
        It is still being recorded.
    repaired : bool
        An unclean stop was repaired, now or before.
    faults : tuple of str
        Why it cannot be trusted to be what was recorded.
    findings : tuple of str
        What is missing or clipped in it, truly recorded.
    """

    path: Path
    survey: Survey
    clean: bool | None
    running: bool
    repaired: bool
    faults: tuple[str, ...]
    findings: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
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
    """Read a recording to its end and say what is wrong with it.

    Parameters
    ----------
    path : path-like
    repair : bool
        Where an unclean stop left it without its end: cut off what is not a whole row, and write the
        end. Nothing else is changed, and nothing while it is still being recorded.
    **table
        `columns` and `unit`, as in `palpate.read`.

    Returns
    -------
    Verification

    Raises
    ------
    RecordingError
        Not a recording, or a line in it that is not a row.
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
        yield "no sidecar beside it, or none of a recording: the device and the end are not known"
    elif not end:
        yield "no end in the sidecar: an unclean stop, or it is still being recorded; --repair writes an end"
    else:
        yield from _wrong_end(recording, end)
    survey = recording.survey
    counts = {
        f"{recording.torn_bytes} bytes after the last whole row": recording.torn_bytes,
        f"{survey.disordered} rows out of order: their numbers do not rise": survey.disordered,
        f"time goes back at {survey.backward} rows": survey.backward,
        f"{survey.miscoded} rows have codes of more than 24 bits": survey.miscoded,
    }
    yield from (text for text, holds in counts.items() if holds)


def _wrong_end(recording: Recorded, end: dict[str, Any]) -> Iterator[str]:
    rows = recording.survey.rows
    if end.get("rows") != rows:
        yield f"{rows} rows, {end.get('rows')} were written"
    elif end.get("crc32", recording.checksum) != recording.checksum:
        yield "not what was written: the rows were changed, or the sidecar is of another recording"
    if not end.get("clean") and "repaired" not in end:
        yield f"the recorder gave up: {end.get('error')}"


def _findings(survey: Survey, end: dict[str, Any] | None = None) -> Iterator[str]:
    end = end or {}
    if "repaired" in end:
        yield f"its end was written later: {end['repaired']}"
    elif end.get("error"):
        yield f"the source ended with an error: {end['error']}"
    counts = {
        f"{survey.lost} samples lost {survey.in_gaps}": survey.lost,
        f"{end.get('dropped')} samples read but not written": end.get("dropped"),
        f"{survey.refused} rows without a usable value": survey.refused,
        f"{survey.excitation} of them with the excitation shorted or overloaded": survey.excitation,
        f"clipped: {survey.hard_saturated} rows in the hard channel": survey.hard_saturated,
        f"clipped: {survey.soft_saturated} rows in the soft channel": survey.soft_saturated,
        "no rows": survey.rows == 0,
    }
    yield from (text for text, holds in counts.items() if holds)


def _repair(recording: Recorded) -> None:
    """Make an unclean stop's file whole: what was never a row goes, the sidecar gets its end."""
    try:
        if recording.torn_bytes:
            size = recording.path.stat().st_size - recording.torn_bytes
            os.truncate(recording.path, size)
        survey = recording.survey
        what = f"{recording.torn_bytes} bytes of a torn row cut off"
        end = {"rows": survey.rows, "dropped": 0, "clean": False, "repaired": what, "crc32": recording.checksum}
        sidecar.save(sidecar.sidecar_path(recording.path), {**(recording.document or {}), "end": end})
    except OSError as error:
        raise RecordingError(recording.path, f"cannot be repaired: {error.strerror}") from error
