"""The buttons Tare and Tare anyway."""

from collections.abc import Callable

from palpate.live.protocol import Command, Refused
from palpate.live.session import Session
from palpate.stream import Stream
from palpate.stream.estimate import Batch

_MOST = 200


class Tare:
    """Measures the baseline again.

    Parameters
    ----------
    session : Session

    Attributes
    ----------
    orders : dict
        Name of a command -> function.
    """

    def __init__(self, session: Session) -> None:
        self.orders: dict[str, Callable[[Command], str]] = {
            "tare": lambda _: self._do_tare(force=False),
            "tare anyway": lambda _: self._do_tare(force=True),
        }
        self._session = session
        self._asked: tuple[int, bool] | None = None  # measurement, and whether also in contact
        self._done: tuple[int, tuple[float, ...]] = (0, ())  # measurement, and when
        session.followers.append(self._follow)

    @property
    def times(self) -> tuple[float, ...]:
        """When the baseline was measured again in this measurement, s: time of the sample before."""
        number, times = self._done
        return times if number == self._session.number else ()

    def _do_tare(self, *, force: bool) -> str:
        self._session.require_running("tare")
        if not force and self._session.moment.state in ("contact", "adapting", "done"):
            raise Refused("tare: the probe is in contact; lift it first. If nothing is touched, press Tare anyway")
        self._asked = (self._session.number, force)
        return "Measuring the baseline: do not touch anything."

    def _follow(self, _: Batch, stream: Stream) -> None:
        """Tare in the thread of the measurement, which is the only one that may."""
        asked, self._asked = self._asked, None
        if asked is None or asked[0] != self._session.number:
            return
        try:
            stream.tare(force=asked[1])
        except RuntimeError as refusal:  # pressed after the command
            self._session.say(str(refusal))
            return
        self._done = (asked[0], (*self.times, self._session.last_s)[-_MOST:])
        if self._session.outlets:
            self._session.outlets.mark("tare")
