"""A recording for a report: its files and checksums, what `check` says, its sidecar, and its touches with their traces."""

import hashlib
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate._core import Touch
from palpate.files import open_regular
from palpate.recording import sidecar
from palpate.recording.foreign import AnyRecording, recorded
from palpate.recording.session import Entry, Plan, plan_of
from palpate.recording.verification import Verification, verified
from palpate.tables.packed import unpacked_name
from palpate.touch import feed_recording, timed, tracker_of

Array = NDArray[np.float64]


class Trace(NamedTuple):
    """The estimate during a touch.

    Attributes
    ----------
    t_s : numpy.ndarray, shape (n,)
        Since its first row, s; without times the number of the row.
    ratio, error : numpy.ndarray, shape (n,)
        The ratio and its standard error, nan while it is not known.
    """

    t_s: Array
    ratio: Array
    error: Array


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
    traces : list of Trace
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
    traces: list[Trace]
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
    tracker = tracker_of(recording, tracking["scene"], settings)
    found = _traces(recording, tracker)
    ended = tracker.touch_count
    tracker.finish()
    touches = tracker.touches if timed(recording) else [touch._untimed() for touch in tracker.touches]
    traces = [found.get(number, Trace(*(np.zeros(0),) * 3)) for number in range(1, len(touches) + 1)]
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
        entries=plan.matched(touches, *([period_s] if period_s > 0 else [])),
        tracking=tracking,
        notes=recording.notes,
        doubts=recording.doubts,
        touches=touches,
        traces=traces,
        cut=tracker.touch_count - ended,
        retaken=tracker.retaken,
        period_s=period_s,
        first_s=survey.first_ns / 1e9 if recording.timed else float("nan"),
    )


def _traces(recording: AnyRecording, tracker: Any) -> dict[int, Trace]:
    """Replay a recording; return the trace of each touch by its number."""
    parts: dict[int, list[Any]] = {}
    for t_hard, _, _, _, taken, _ in feed_recording(tracker, recording):
        for number in np.unique(taken["touch"][taken["touch"] > 0]).tolist():
            of_it = taken["touch"] == number
            parts.setdefault(number, []).append((t_hard[of_it], taken["ratio"][of_it], taken["standard_error"][of_it]))
    return {number: _trace(*map(np.concatenate, zip(*each, strict=True))) for number, each in parts.items()}


def _trace(t_s: Array, ratio: Array, error: Array) -> Trace:
    return Trace(t_s - t_s[0] if np.isfinite(t_s).all() else np.arange(len(t_s), dtype=float), ratio, error)


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
