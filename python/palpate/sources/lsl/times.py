"""From the stamps of a stream to the times of the samples."""

import socket
import time
from typing import Any

from palpate.errors import ProtocolError
from palpate.sources.lsl.library import ahead_ns, library

_AGREE_S = 1e-3
"""LSL's estimate is better than 0.2 ms. Clocks of two machines count from their starts: they agree to 1 ms by chance alone."""
_REFRESH_S = 1.0
_FOREIGN_S = 10.0
_STEP_NS = 1_000_000
"""A new estimate of the clocks' difference may be this much below the last one."""


class Times:
    """The clock of a stream beside that of this computer.

    Parameters
    ----------
    zero_ns : int
        `time.monotonic_ns()` at t = 0.

    Attributes
    ----------
    remark : str
        What is to be said of the stamps; empty: nothing.
    """

    def __init__(self, zero_ns: int) -> None:
        self.remark: str = ""
        self._to_t_ns = -ahead_ns(library()) - zero_ns
        self._correction_s = 0.0
        self._fixed = False
        self._next_s = 0.0
        self._shift_ns: int | None = None
        self._last_ns: int | None = None

    @property
    def clock(self) -> str:
        """Whose clock the stamps are of."""
        return "that of this computer" if self._fixed else "that of the sender, with LSL's time correction"

    def begin(self, correction_s: float | None, host: str) -> None:
        """Take the difference of the clocks: at the begin, and after each reconnection.

        Parameters
        ----------
        correction_s : float, optional
            First estimate of LSL; None: the clock of the sender does not answer.
        host : str
            Computer of the sender.
        """
        self._shift_ns = None
        self._fixed = correction_s is None or (host == socket.gethostname() and abs(correction_s) < _AGREE_S)
        self._correction_s = 0.0 if correction_s is None or self._fixed else correction_s
        if correction_s is None:
            self.remark = (
                "its clock does not answer: its stamps are taken as of this computer's clock (is UDP blocked?)"
            )

    def t_ns(self, stamp_s: float, inlet: Any) -> int | None:
        """Return the time of a stamp, ns; None: it lies before the last one.

        Raises
        ------
        ProtocolError
            The stamp is not a number of seconds.
        """
        self._refresh(inlet)
        if not abs(stamp_s) < 1e9:
            raise ProtocolError(f"lsl: got the time stamp {stamp_s:g}, allowed: seconds, below 1e9")
        t_ns = round((stamp_s + self._correction_s) * 1e9) + self._to_t_ns
        if self._shift_ns is None:
            self._shift_ns = self._shift(t_ns)
        t_ns += self._shift_ns
        if self._last_ns is not None and t_ns < self._last_ns:
            if t_ns < self._last_ns - _STEP_NS:
                return None
            t_ns = self._last_ns
        self._last_ns = t_ns
        return t_ns

    def _shift(self, first_ns: int) -> int:
        """Return what brings stamps of another clock than that of LSL to the arrival of the first one; else 0."""
        now_ns = time.monotonic_ns() + ahead_ns(library()) + self._to_t_ns
        if abs(now_ns - first_ns) < _FOREIGN_S * 1e9:
            return 0
        self.remark = f"its stamps are {abs(now_ns - first_ns) / 1e9:.0f} s from LSL's clock: the first one is taken as its arrival"
        return now_ns - first_ns

    def _refresh(self, inlet: Any) -> None:
        """Take the newest difference: LSL measures it every 5 s."""
        if self._fixed or (now_s := time.monotonic()) < self._next_s:
            return
        self._next_s = now_s + _REFRESH_S
        try:
            self._correction_s = inlet.time_correction(0.0)
        except library().util.TimeoutError:
            return
