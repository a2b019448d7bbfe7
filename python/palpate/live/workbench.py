"""All parts of the workbench together: the measurement, and what stands around it."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from palpate.calibration import Calibration
from palpate.live.desk.marks import Marks
from palpate.live.desk.plan import Plan
from palpate.live.desk.record import Record
from palpate.live.desk.report import Report, Writing
from palpate.live.desk.tare import Tare
from palpate.live.protocol import Command, Refused
from palpate.live.session import Session
from palpate.live.summary import Summary
from palpate.several import TOUCH_SCATTER

Document = dict[str, Any]
_APART = ("report",)
"""Take seconds, and change nothing that another command needs."""


class Workbench:
    """What a page shows and may order.

    Parameters
    ----------
    session : Session
        A started session; the workbench does not close it.
    source : str
        Name of the source, as given by the user.
    calibration : Calibration, optional
        To show moduli, and for the scatter from touch to touch.
    scatter : float
        Relative scatter from touch to touch without a calibration, for the question whether touches agree.
    report : callable, optional
        Writes a report, as `desk.report.Report` needs it. Without it a page can order none.

    Attributes
    ----------
    orders : dict
        Name of a command -> function that obeys it and returns a message, or the values of the answer.
    told : dict
        Kind of a message -> function that returns it; a page gets it when it has changed.
    plan : Plan
    calibration_file : pathlib.Path or None
        Where the calibration in use is stored, for a report.
    """

    def __init__(
        self,
        session: Session,
        source: str,
        calibration: Calibration | None = None,
        scatter: float = TOUCH_SCATTER,
        report: Writing | None = None,
    ) -> None:
        self.session = session
        self._source = source
        self._summary = summary = Summary(session, calibration, scatter)
        self.plan: Plan = Plan(session, lambda: summary.accepted)
        summary.known = self.plan.rows
        self.calibration_file: Path | None = None
        self._record, tare = Record(session), Tare(session)
        marks = Marks(session, tare)
        self.orders: dict[str, Callable[[Command], str | Document]] = {
            **session.orders,
            **tare.orders,
            **self._record.orders,
            **marks.orders,
            **self.plan.orders,
        }
        if report:
            self.orders |= Report(session.recordings, report, lambda: self.calibration_file).orders
        self.told: dict[str, Callable[[], Document]] = {
            "touches": summary.touches,
            "events": marks.document,
            "session": self.plan.document,
        }

    def hello(self) -> Document:
        """Return the values that do not change during a measurement."""
        return self._summary.instrument(self._source)

    def state(self) -> Document:
        """Return the values that change during a measurement."""
        return {**self._summary.now(), **self._record.document()}

    def do(self, command: Command) -> Document:
        """Obey a command of a page; return the answer. May wait for the disk.

        Raises
        ------
        Refused
            Not possible now, or not here; the text says why.
        ValueError, PalpateError
            As `Stream` does.
        """
        if command.do not in self.orders:
            raise Refused(f"{command.do}: not possible with this source")
        with nullcontext() if command.do in _APART else self.session.commands:
            answer = self.orders[command.do](command)
        return answer if isinstance(answer, dict) else {"message": answer}
