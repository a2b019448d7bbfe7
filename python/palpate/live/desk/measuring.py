"""The desk of a measurement: all its parts together."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate._core import Touch
from palpate.calibration import Calibration
from palpate.live.desk.calibrating import Calibrating, Files
from palpate.live.desk.device import Device
from palpate.live.desk.marks import Marks
from palpate.live.desk.plan import Plan
from palpate.live.desk.record import Record
from palpate.live.desk.report import Report
from palpate.live.desk.standing import Standing
from palpate.live.desk.tare import Tare
from palpate.live.protocol import Command
from palpate.live.session import Session
from palpate.live.summary import Summary
from palpate.report import write

Document = dict[str, Any]


class Desk:
    """What stands around a measurement.

    Parameters
    ----------
    session : Session
    summary : Summary
        Has the calibration in use.
    source : str
        Name of the source, as given by the user.
    calibration_file : pathlib.Path, optional
        Where the calibration is stored, for a report.

    Attributes
    ----------
    orders : dict
        Name of a command -> function.
    told : dict
        Kind of a message -> function that returns it.
    rows : callable
        Returns what is known of each touch: specimen, deviation, kept, why not.
    """

    def __init__(self, session: Session, summary: Summary, source: str, calibration_file: Path | None = None) -> None:
        self._session, self._summary = session, summary
        self._plan = plan = Plan(session, lambda: summary.accepted)
        self._record, tare = Record(session), Tare(session)
        marks = Marks(session, tare)
        self._standing = Standing(session, lambda: summary.calibration)
        self._standing.why = self._why
        self._standing.next_touch = lambda: plan.document()["next"]
        device = Device(session, self._standing, source)
        files = Files(session.recordings.free, session.recordings.checked, session.recordings.made)
        calibrating = Calibrating(plan.known, files, self._use, session.stream.tracker.scene)
        self._calibration_file = calibration_file
        report = Report(session.recordings, write, lambda: self._calibration_file)
        parts = (tare, self._record, marks, plan, device, calibrating, report)
        self.orders: dict[str, Callable[[Command], str | Document]] = {}
        for part in parts:
            self.orders |= part.orders
        self.told: dict[str, Callable[[], Document]] = {
            "events": marks.document,
            "session": plan.document,
            "device": device.document,
            "calibration": calibrating.document,
        }
        self.rows: Callable[[], list[Document]] = plan.rows

    def state(self) -> Document:
        """Return what the message `state` has beside the measurement: recording and files, word, line."""
        return {**self._record.document(), **self._standing.document()}

    def is_news(self) -> bool:
        """Return whether the word or the line has changed since the last state."""
        return self._standing.is_news()

    def _why(self, index: int, _: Touch) -> str:
        rows = self._plan.rows()
        return str(rows[index]["why"]) if index < len(rows) else ""

    def _use(self, calibration: Calibration, path: Path) -> None:
        self._summary.calibration, self._calibration_file = calibration, path
        self._plan.orders["note"](Command("note", {"text": f"moduli are from {path.name} from here on"}))
