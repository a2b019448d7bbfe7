"""All parts of the workbench together: the measurement, and what stands around it."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from palpate.calibration import Calibration
from palpate.live.desk.measuring import Desk
from palpate.live.desk.noise import Noise
from palpate.live.desk.recorded import Recorded
from palpate.live.protocol import Command, Refused
from palpate.live.review import Review
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
    session : Session or Review
        A started session; the workbench does not close it.
    source : str
        Name of the source, as given by the user.
    calibration : Calibration, optional
        To show moduli, and for the scatter from touch to touch.
    scatter : float
        Relative scatter from touch to touch without a calibration, for the question whether touches agree.
    calibration_file : pathlib.Path, optional
        Where the calibration is stored, for a report.

    Attributes
    ----------
    orders : dict
        Name of a command -> function that obeys it and returns a message, or the values of the answer.
    told : dict
        Kind of a message -> function that returns it; a page gets it when it has changed.
    noise : Noise
        For the pages that ask for it.
    """

    def __init__(
        self,
        session: Session | Review,
        source: str,
        calibration: Calibration | None = None,
        scatter: float = TOUCH_SCATTER,
        calibration_file: Path | None = None,
    ) -> None:
        self.session = session
        self._source = source
        self._summary = Summary(session, calibration, scatter)
        if isinstance(session, Review):
            self._desk: Desk | Recorded = Recorded(session, self._summary, calibration_file)
        else:
            self._desk = Desk(session, self._summary, source, calibration_file)
        self._summary.known = self._desk.rows
        self.noise: Noise = Noise(lambda: session.levels.newest_rows())
        self.orders: dict[str, Callable[[Command], str | Document]] = {**session.orders, **self._desk.orders}
        self.told: dict[str, Callable[[], Document]] = {
            "hello": self.hello,
            "touches": self._summary.touches,
            **self._desk.told,
        }

    def hello(self) -> Document:
        """Return the values that do not change during a measurement."""
        return self._summary.instrument(self._source)

    def state(self) -> Document:
        """Return the values that change during a measurement."""
        return {**self._summary.now(), **self._desk.state()}

    def is_news(self) -> bool:
        """Return whether the word or the line has changed since the last state."""
        return self._desk.is_news()

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
            is_file = self.session.kind == "file"
            why = "this is a recording, nothing is measured" if is_file else "not possible with this source"
            raise Refused(f"{command.do}: {why}")
        with nullcontext() if command.do in _APART else self.session.commands:
            answer = self.orders[command.do](command)
        return answer if isinstance(answer, dict) else {"message": answer}
