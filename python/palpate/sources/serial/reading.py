"""Lines that are read, and those that are not."""

from collections import deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

from palpate.sources.serial.cells import Refused
from palpate.sources.serial.formats import Format, Given, Values, shown
from palpate.sources.serial.names import Column
from palpate.sources.serial.port import LONGEST, Line, Port
from palpate.sources.serial.settling import MOST, Settling
from palpate.sources.serial.strange import Strange, quoted_line

_COMMENTS = 20


class Reading(NamedTuple):
    """A line that is read.

    Attributes
    ----------
    text : str
    values : dict
    arrived_ns : int
    away_s : float
        How long the port was away before it, s.
    why : str
        Why the baseline before does not hold; empty: it does.
    """

    text: str
    values: Values
    arrived_ns: int
    away_s: float = 0.0
    why: str = ""


class Reader:
    """Reads the lines of a port.

    Parameters
    ----------
    given : Given
    port : Port
        Once the format is settled, it ends after the port's `replug_s` without a line that is read.
    tell : callable
        Called with messages.

    Attributes
    ----------
    errors : int
        Lines that are not read, without those before the first one that is.
    """

    def __init__(self, given: Given, port: Port, tell: Callable[[str], None]) -> None:
        self.errors: int = 0
        self._port, self._tell = port, tell
        self._settling = Settling(given)
        self._recent: deque[Line] = deque(maxlen=MOST)
        self._strange = Strange(port.name, port.baud)
        self._comments: set[str] = set()
        self._away_s, self._why = 0.0, ""
        self._noise = True  # until a line is read, also after a reconnect
        self._shown: set[str] = set()  # roles of the first lines

    @property
    def format(self) -> Format | None:
        """The settled format; None: it is not settled."""
        return self._settling.format

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the settled format."""
        return self._settling.format.columns if self._settling.format else ()

    def readings(self) -> Iterator[Reading | None]:
        """Return each line that is read, and None from time to time.

        Raises
        ------
        ProtocolError
            Too many lines were not read.
        """
        for line in self._port.lines():
            yield from self._take(line) if line else [None]
            self._strange.require_patience(self._port.replug_s if self.format else None)

    def refuse(self, text: str, refused: Refused) -> None:
        """Take a line that is not read: it is counted, and shown at the 10th, the 100th and so on."""
        self._strange.add(text, refused)
        if not self._noise:
            self.errors += 1
            if self.errors > 1 and str(self.errors).strip("0") == "1":
                self._tell(f"{self.errors:,} lines were not read; the last: {quoted_line(text)}: {refused}")

    def _take(self, line: Line) -> list[Reading]:
        """Return what can be read now."""
        if line.away_s:
            self._away_s, self._noise = self._away_s + line.away_s, True
        if not line.whole:
            self._settling.names(line.text)
        elif line.text.startswith("#"):
            self._comment(line.text)
        elif self.format and line.text and line.text == self._settling.header:
            self._why = "the board restarted: it sent the names of the columns again"
        else:
            try:
                return self._read(line)
            except Refused as refused:
                self.refuse(line.text, refused)
        return []

    def _read(self, line: Line) -> list[Reading]:
        if not line.text:
            raise Refused(f"more than {LONGEST} bytes without a line end")
        self._recent.append(line)
        count = 1 if self.format else self._settling.offer(line.text)
        settled, lines = self.format, list(self._recent)[-count:]
        if not settled or not count:
            return []
        found = [Reading(one.text, settled.read(one.text), one.arrived_ns) for one in lines]
        self._settling.sizes.require(settled, found[-1].values)
        found[0] = found[0]._replace(away_s=self._away_s, why=self._why)
        self._away_s, self._why, self._noise = 0.0, "", False
        self._strange.clear()
        self._show(found[0])
        return found

    def _show(self, reading: Reading) -> None:
        """Say how the first lines were read, until both channels were there."""
        new = set(reading.values) - self._shown
        if new:
            self._shown |= new
            guess = "; hard is the first: columns=soft,hard if it is not" if self._settling.guessed else ""
            self._tell(f"{quoted_line(reading.text)} -> {shown(reading.values)}{guess}")

    def _comment(self, text: str) -> None:
        """Say a comment of the board once; of many the first ones."""
        if len(self._comments) < _COMMENTS and text not in self._comments:
            self._comments.add(text)
            self._tell(f"{self._port.name}: {quoted_line(text)}")
