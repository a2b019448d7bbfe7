"""What the page is told over time: a line does not flicker, and a screen reader hears only what has settled."""

import math
from typing import Any, NamedTuple

from palpate.live.desk.facts import Result
from palpate.live.desk.words import Line, Now

HOLD_S = 3.0
"""A line whose cause may come and go stays for this time after it."""
SETTLED_S = 1.0
"""What stays for this time is announced; a fault, and the end of a touch, at once."""
_SETTLED_S = {"done": 0.0, "left out": 0.0, "after": 3.0}
_COMES_AND_GOES = {"slow", "silent", "wiring", "constant", "unwired", "range"}


class _Heard(NamedTuple):
    """What a screen reader has to know: the word, the line, and the last result."""

    word: str = ""
    what: str = ""
    result: str = ""


class Teller:
    """Keeps the line and the announcement of one measurement."""

    def __init__(self) -> None:
        self._line: Line | None = None
        self._began_s = self._caused_s = 0.0
        self._heard, self._pending = _Heard(), _Heard()
        self._since_s = -math.inf
        self._announce = ""

    def tell(self, now: Now, line: Line, result: Result | None, at_s: float) -> dict[str, Any]:
        """Return the part of the message `state`: now, line, announce.

        Parameters
        ----------
        now : Now
        line : Line
        result : Result or None
        at_s : float
            Time, s, that only rises.
        """
        line = self._steady(line, at_s)
        self._listen(now, line, result, at_s)
        since_s = None if line.level == "quiet" else round(at_s - self._began_s, 1)
        shown = {"what": line.what, "level": line.level, "title": line.title, "text": line.text, "since_s": since_s}
        return {"now": now._asdict(), "line": shown, "announce": self._announce}

    def _steady(self, line: Line, at_s: float) -> Line:
        """Return this line, or the one before if it has to stay."""
        held = self._line
        if held and held.what == line.what:
            self._caused_s = at_s
        elif held and self._stays(held, line, at_s):
            return held
        else:
            self._began_s = self._caused_s = at_s
        self._line = line
        return line

    def _stays(self, held: Line, line: Line, at_s: float) -> bool:
        calm = line.level in ("quiet", "note")
        return held.what in _COMES_AND_GOES and calm and at_s - self._caused_s < HOLD_S

    def _listen(self, now: Now, line: Line, result: Result | None, at_s: float) -> None:
        """Announce what has settled and is new."""
        heard = _Heard(now.word, line.what, f"{result.number}: {result.text}" if result and not result.why else "")
        if heard != self._pending:
            self._pending, self._since_s = heard, at_s
        least_s = 0.0 if line.level == "fault" else _SETTLED_S.get(line.what, SETTLED_S)
        settled = at_s - self._since_s >= least_s
        if heard == self._heard or not settled:
            return
        told = []
        if result and heard.result not in ("", self._heard.result):
            told.append(f"Touch {result.number}{', revised' if result.revised else ''}: {result.text}.")
        if heard.word != self._heard.word:
            told.append(f"{now.word}.")
        if heard.what != self._heard.what:
            told.append(f"{line.title} {line.said or line.text}")
        self._announce = " ".join(" ".join(told).split()) or self._announce
        self._heard = heard
