"""Lines that are not read, one after the other: when there are too many, an error that says what to do."""

import time
from collections import deque

from palpate.errors import ProtocolError, shortened
from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import decoded
from palpate.sources.serial.suggesting import pattern_for

MOST_LINES = 20
_FEW_S, _LONG_S = 3.0, 10.0
"""Before the first line that is read: so many lines in the shorter time, s, or one line in the longer time."""
_SHOWN = 100  # characters of a line in a message


class Strange:
    """The lines since the last one that was read.

    Parameters
    ----------
    port : str
        Name of the port, for the messages.
    baud : int
    """

    def __init__(self, port: str, baud: int) -> None:
        self._port, self._baud = port, baud
        self.clear()

    def clear(self) -> None:
        """Forget them: a line was read."""
        self._count = self._garbled = 0
        self._since_s = 0.0
        self._first = ""
        self._recent: deque[str] = deque(maxlen=MOST_LINES)
        self._best: tuple[str, Refused] | None = None

    def add(self, text: str, refused: Refused) -> None:
        """Take a line, and why it is not read."""
        if not self._count:
            self._first, self._since_s = text, time.monotonic()
        self._count += 1
        self._recent.append(text)
        self._garbled += not decoded(text).isprintable()
        if not self._best or refused.option or not self._best[1].option:
            self._best = text, refused

    def require_patience(self, settled_s: float | None) -> None:
        """Check that there are not too many.

        Parameters
        ----------
        settled_s : float, optional
            Longest time, s, for a port whose lines were read before; None: none was read.

        Raises
        ------
        ProtocolError
            There are too many.
        """
        age_s = time.monotonic() - self._since_s
        if settled_s is None:
            end = self._count and (age_s >= _LONG_S or (age_s >= _FEW_S and self._count >= MOST_LINES))
        else:
            end = age_s >= max(settled_s, _LONG_S) and self._count >= MOST_LINES
        if end and self._best:
            raise ProtocolError(self._message(*self._best))

    def _message(self, text: str, refused: Refused) -> str:
        lines = "1 line was" if self._count == 1 else f"{self._count} lines in a row were"
        said = f"{self._port}: {lines} not read. The first: {quoted_line(self._first)}."
        if 3 * self._garbled > self._count:
            return f"{said} Most of it is not text: check the baud rate, {self._baud}: serial:{self._port}?baud=9600"
        if text != self._first:
            said += f" Another: {quoted_line(text)}."
        said += f" Reason: {refused}{'' if str(refused).endswith('?') else '.'}"
        option = refused.option or pattern_for(self._recent)
        return f"{said} What helps, for example: 'serial:{self._port}?{option}'" if option else said


def quoted_line(text: str) -> str:
    """Return a line as a message shows it."""
    return shortened(repr(decoded(text)), _SHOWN)
