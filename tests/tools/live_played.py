"""What a page is told of a simulated measurement, sample by sample on its own clock: the same at each run."""

import math
from typing import Any

from palpate.live.desk.standing import Standing
from palpate.live.session import Moment
from palpate.stream import Stream


class Played:
    """A measurement in place of a `Session`, without threads of its own; `clock` is the time of its last sample.

    Attributes
    ----------
    told : list of (float, dict)
        Time, and each document that a page gets: five a second, and at once when word or line change.
    """

    def __init__(self, source: str, **settings: Any) -> None:
        self.stream = Stream(source, notify=lambda _: None, capacity=2, **settings)
        self.number, self.error, self.touches = 1, "", list[Any]()
        self.moment = Moment()
        self.followers: list[Any] = []
        self.at_s = 0.0
        self.told: list[tuple[float, dict[str, Any]]] = []
        self.standing = Standing(self, clock=lambda: self.at_s)  # type: ignore[arg-type]

    @property
    def running(self) -> bool:
        return self.moment.state != "ended"

    @property
    def counters(self) -> Any:
        return self.stream.counters

    def play(self, until_s: float = math.inf, at: dict[float, Any] | None = None) -> "Played":
        """Play to a time or the end; `at`: what to do with the stream, by time."""
        waiting, due_s = sorted((at or {}).items()), 0.0
        with self.stream as stream:
            for batch in stream._batches(1):
                tracker = stream.tracker
                for follow in self.followers:
                    follow(batch, stream)
                self.moment = Moment(tracker.state, tracker.ratio, tracker.standard_error, alarm=False)
                self.touches = stream.touches
                self.at_s = float(batch.samples["t_hard_ns"][-1]) / 1e9 if len(batch.samples) else self.at_s
                if self.at_s >= due_s or self.standing.is_news():
                    self.told.append((self.at_s, self.standing.document()))
                    due_s = self.at_s + 0.2
                while waiting and self.at_s >= waiting[0][0]:
                    waiting.pop(0)[1](stream)
                if self.at_s >= until_s:
                    return self
        self.moment = self.moment._replace(state="ended")
        self.told.append((self.at_s, self.standing.document()))
        return self

    @property
    def course(self) -> list[tuple[str, str]]:
        """Word and line, each time that one of them changed."""
        found: list[tuple[str, str]] = []
        for _, document in self.told:
            now = document["now"]["word"], document["line"]["what"]
            if not found or found[-1] != now:
                found.append(now)
        return found

    @property
    def announced(self) -> list[str]:
        """All announcements, in order."""
        found: list[str] = []
        for _, document in self.told:
            if document["announce"] and (not found or found[-1] != document["announce"]):
                found.append(document["announce"])
        return found

    def first(self, what: str) -> tuple[float, dict[str, Any]]:
        """Return when a line was told first, and the document."""
        return next((at_s, document) for at_s, document in self.told if document["line"]["what"] == what)
