"""One recording that was sent through the estimator again: as a table, and as a JSON document."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate import __version__
from palpate.cli import afterwards
from palpate.cli import touches as cli_touches
from palpate.cli.moduli import Moduli

if TYPE_CHECKING:
    from palpate import OfflineTouch, Touch
    from palpate.recording.foreign import AnyRecording
    from palpate.recording.session import Entry


@dataclass(frozen=True)
class How:
    """How recordings are replayed: the options of the command.

    Attributes
    ----------
    asked : dict
        Keywords of `palpate.read`.
    scene : str or None
        None: that of the recording.
    settings : dict
        Those of the tracker; they replace those of the recording.
    offline : bool
        Estimate each touch afterwards, too.
    """

    asked: dict[str, Any]
    scene: str | None
    settings: dict[str, Any]
    offline: bool

    def of(self, recording: "AnyRecording") -> dict[str, Any]:
        """Return scene and settings for a recording."""
        return ({"scene": self.scene} if self.scene else {"scene": "handheld"} | recording.settings) | self.settings


@dataclass(frozen=True)
class Replayed:
    """The result for one recording: all that is said of it, without its samples."""

    file: Path
    how: dict[str, Any]
    rows: int
    understood: str
    notes: list[str]
    touches: "list[Touch]"
    again: "list[OfflineTouch] | None"
    fault: str
    """Why there is no touch; "": there are some."""
    doubtful: bool
    cut: int
    """How many of the last touches ran when the recording ended."""
    entries: "list[Entry | None] | None" = None
    """What the sidecar says of each touch; None: of none."""

    @property
    def reliable(self) -> bool:
        """Whether there is a touch, and the recording is as it was written."""
        return bool(self.touches) and not self.doubtful

    def table(self, moduli: Moduli | None) -> str:
        """Return a header, a line for each touch, and what is said of them; empty without touches."""
        if self.again is not None:
            return afterwards.table(self.again)
        table = cli_touches.table(self.touches)
        if self.entries:
            table = cli_touches.with_specimens(table, self.entries)
        advised = cli_touches.advised(self.touches, cut=self.cut)
        return (moduli.table(table, self.touches) if moduli and self.touches else table) + advised

    def document(self, moduli: Moduli | None) -> dict[str, Any]:
        """Return the result for JSON."""
        settings = {name: value for name, value in self.how.items() if name != "scene"}
        document: dict[str, Any] = {
            "file": str(self.file),
            "scene": self.how["scene"],
            "settings": {
                name: str(value) if value in (math.inf, -math.inf) else value for name, value in settings.items()
            },
            "palpate": __version__,
            "rows": self.rows,
            "notes": self.notes,
            "touches": cli_touches.records(self.touches, cut=self.cut),
        }
        for record, entry in zip(document["touches"], self.entries or [], strict=False):
            record |= {"specimen": entry and entry.specimen, "left_out": entry.left_out if entry else ""}
        if moduli:
            moduli.add(document, self.touches)
        if self.again:
            afterwards.add(document, self.again)
        return document


def replayed(file: Path, how: How, begin: Callable[[Path, Any], None]) -> Replayed:
    """Send a recording through the estimator; `begin` gets the recording before its samples are read.

    Raises
    ------
    RecordingError, ValueError, TypeError
        As from `palpate.touches`.
    """
    from palpate.recording.foreign import recorded
    from palpate.recording.session import plan_of
    from palpate.touch import tracked

    recording = recorded(file, **how.asked)
    begin(file, recording)
    tracking = how.of(recording)
    again = _afterwards(recording, tracking) if how.offline else None
    found, retaken, cut = tracked(recording, **tracking)
    plan = plan_of(recording.document or {})
    return Replayed(
        file,
        tracking,
        recording.survey.rows,
        recording.understood,
        [*recording.notes, *cli_touches.notes(retaken)],
        found,
        again,
        "" if found else f"no touch found: {_why_not(recording)}",
        bool(recording.doubts),
        cut,
        plan.matched(found, recording.survey.period_s) if plan.touches else None,
    )


def _afterwards(recording: "AnyRecording", tracking: dict[str, Any]) -> "list[OfflineTouch]":
    from palpate import offline

    return offline(recording, **tracking)


def _why_not(recording: "AnyRecording") -> str:
    spans = [f"{name} {high - low:.3g} pF" for name, (low, high) in recording.survey.spans_pF.items()]
    if len(spans) < 2:
        return "a channel has no values"
    return f"no change was above the idle noise for long enough. The channels span {', '.join(spans)}; check --unit"
