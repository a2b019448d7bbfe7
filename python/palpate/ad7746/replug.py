"""The wait for an unplugged board: it is opened again as soon as that succeeds."""

from collections.abc import Callable, Generator

from palpate.ad7746.bus import Clock
from palpate.errors import DeviceNotFound, DeviceRefused, SourceError
from palpate.source_events import SourceEvent, TroubleBegan, TroubleKind

POLL_S = 0.1
# Tries until a board that cannot be opened is reported: permissions and firmware take up to 2 s.
_SETTLING = 20
_LEFT_S = (10, 30, 60, 90)  # the rest of the wait that is reported
_GONE = "The board is gone: plug it in again."


class ReplugWait:
    """The wait for an unplugged board.

    Parameters
    ----------
    clock : Clock
    limit_s : float
        Longest time to wait, s.
    notify : callable
        Called with a message when the wait or its reason has changed much.
    """

    def __init__(self, clock: Clock, limit_s: float, notify: Callable[[str], None]) -> None:
        self._clock = clock
        self._deadline_ns = clock.now_ns() + limit_s * 1e9
        self._notify = notify
        self._why = _GONE
        self._failed = 0  # tries in a row that found a board and could not open it

    def until_open(self, reopen: Callable[[], str]) -> Generator[SourceEvent, None, str]:
        """Open the board as soon as possible; return as `reopen`, or raise its last error.

        Yields
        ------
        TroubleBegan
            At the beginning, and whenever its text changes.
        """
        shown = self._trouble()
        yield shown
        reported = self._stage
        while True:
            try:
                return reopen()
            except SourceError as error:
                if self._left_s < 0:
                    raise
                self._failed_with(error)
            trouble = self._trouble()
            if self._stage != reported:
                reported = self._stage
                self._notify(trouble.text)
            if trouble != shown:
                shown = trouble
                yield trouble
            self._clock.sleep(POLL_S)

    def _failed_with(self, error: SourceError) -> None:
        gone = isinstance(error, DeviceNotFound) and not isinstance(error, DeviceRefused)
        if gone:
            self._failed = 0
            self._why = _GONE
            return
        self._failed += 1
        if self._failed == _SETTLING:
            self._why = f"{error}."

    def _trouble(self) -> TroubleBegan:
        """Return why the driver waits, and the rest of the wait."""
        left_s = max(self._left_s, 0)
        text = f"{self._why} Waiting for it: {left_s:.0f} s left."
        return TroubleBegan(TroubleKind.UNPLUGGED, text)

    @property
    def _left_s(self) -> float:
        return (self._deadline_ns - self._clock.now_ns()) / 1e9

    @property
    def _stage(self) -> tuple[bool, int]:
        """Whether the board cannot be opened, and how many of the reported rests are passed."""
        passed = sum(self._left_s <= mark_s for mark_s in _LEFT_S)
        return self._failed >= _SETTLING, passed
