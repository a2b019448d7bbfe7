"""A recording for a report: its files and checksums, what `check` says, its sidecar, and its touches."""

import hashlib
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from palpate._core import Touch
from palpate.files import open_regular
from palpate.recording import sidecar
from palpate.recording.foreign import recorded
from palpate.recording.session import Entry, Plan, plan_of
from palpate.recording.verification import Verification, verified
from palpate.tables.packed import unpacked_name
from palpate.touch import tracked


@dataclass(frozen=True)
class Run:
    """A recording, and what a replay finds in it.

    Attributes
    ----------
    path : pathlib.Path
    name : str
        What the report calls it: the name of the file, with folders if another one has the same name.
    sums : dict of str
        SHA-256 of the recording and of its sidecar, by the name of the file.
    checked : Verification
        What `palpate check` says.
    document : dict
        The sidecar; empty without one.
    plan : Plan
        Its session.
    entries : list of Entry or None
        What the session says of each touch.
    tracking : dict
        Scene and settings of the replay.
    notes, doubts : tuple of str
        As in `palpate.Recording`.
    touches : list of Touch
    cut : int
        How many of the last touches ran when the recording ended.
    retaken : int
        How often the baseline was measured again.
    period_s, first_s : float
        Mean time from pair to pair; the first time. nan: unknown.
    """

    path: Path
    name: str
    sums: dict[str, str]
    checked: Verification
    document: dict[str, Any]
    plan: Plan
    entries: list[Entry | None]
    tracking: dict[str, Any]
    notes: tuple[str, ...]
    doubts: tuple[str, ...]
    touches: list[Touch]
    cut: int
    retaken: int
    period_s: float
    first_s: float


def run(path: Path, name: str) -> Run:
    """Read a recording, check it, and send it through the estimator with the settings of its measurement.

    Parameters
    ----------
    path : pathlib.Path
    name : str
        As in `Run`.

    Raises
    ------
    RecordingError, ValueError
        As from `palpate.read` and `palpate.touches`.
    """
    recording = recorded(path)
    checked = verified(recording)
    tracking = {"scene": "handheld"} | recording.settings
    settings: Any = {name: value for name, value in tracking.items() if name != "scene"}
    found = tracked(recording, scene=tracking["scene"], **settings)
    document = recording.document or {}
    plan, survey = plan_of(document), recording.survey
    period_s = survey.period_s if recording.timed else float("nan")
    return Run(
        path=path,
        name=name,
        sums={PurePath(name).with_name(file.name).as_posix(): checksum(file) for file in _files(path)},
        checked=checked,
        document=document,
        plan=plan,
        entries=plan.matched(found.touches, *([period_s] if period_s > 0 else [])),
        tracking=tracking,
        notes=recording.notes,
        doubts=recording.doubts,
        touches=found.touches,
        cut=found.cut,
        retaken=found.retaken,
        period_s=period_s,
        first_s=survey.first_ns / 1e9 if recording.timed else float("nan"),
    )


def _files(path: Path) -> list[Path]:
    """Return the recording, and its sidecar if there is one."""
    own = path.with_name(unpacked_name(path))
    beside = [sidecar.sidecar_path(own)] if own.suffix.lower() == ".csv" else []
    return [path, *(file for file in beside if file.exists())]


def checksum(path: Path) -> str:
    """Return the SHA-256 of a file."""
    opened: Any = open_regular(path)
    with opened as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
