"""Marks, whose text may come later, and what else is marked on the axis of time: tares, gaps, and flags."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from palpate._core import Touch
from palpate.errors import PalpateError
from palpate.live.desk.holes import Holes
from palpate.live.desk.places import Places
from palpate.live.desk.tare import Tare
from palpate.live.protocol import Command, Refused
from palpate.live.session import Session
from palpate.recording.recorder import Recorder
from palpate.samples import Sample
from palpate.sentences import advice
from palpate.stream import Stream
from palpate.stream.estimate import Batch

Document = dict[str, Any]
MOST = 500
"""Marks of a measurement that the page shows; older ones are in the recording only."""
_FLAGGED = 200  # touches


@dataclass
class Mark:
    """A mark: its number, the sample at which it was stamped, its text, and its number in a recording."""

    id: int
    sample: Sample
    text: str = ""
    within: tuple[Recorder, int] | None = None

    @property
    def t_s(self) -> float:
        """Time, s."""
        return self.sample.t_hard_ns / 1e9


class Marks:
    """What is marked on the axis of time.

    Parameters
    ----------
    session : Session
    tare : Tare

    Attributes
    ----------
    orders : dict
        Name of a command -> function.
    """

    def __init__(self, session: Session, tare: Tare) -> None:
        self.orders: dict[str, Callable[[Command], str | Document]] = {
            "mark": lambda _: self._do_mark(),
            "mark text": self._do_text,
        }
        self._session, self._tare = session, tare
        self._marks: deque[Mark] = deque(maxlen=MOST)
        self._holes, self._places = Holes(session.stream.source), Places()
        self._flags: list[Document] = []
        self._number, self._measurement = 0, session.number
        session.followers.append(self._follow)
        session.begun.append(self._begun)

    def document(self) -> Document:
        """Return the message `events`."""
        self._begin_again()
        return {
            "marks": [{"id": mark.id, "t_s": mark.t_s, "text": mark.text} for mark in self._marks.copy()],
            "tares": list(self._tare.times),
            "gaps": [hole._asdict() for hole in self._holes.found],
            "flags": self._flags,
        }

    def _do_mark(self) -> Document:
        """Stamp a mark now, with the last sample that the page could show."""
        session = self._session
        session.require_running("mark")
        self._begin_again()
        if session.last is None:
            raise Refused("mark: no sample has come yet; wait a moment")
        self._number += 1
        mark = Mark(self._number, session.last)
        recorder = session.recorder
        if recorder:
            self._put(mark, recorder)
        if session.outlets:
            session.outlets.mark("mark", "")
        self._marks.append(mark)
        return {"id": mark.id, "message": "Marked." if recorder else "Marked; nothing is recorded yet."}

    def _do_text(self, command: Command) -> Document:
        self._begin_again()
        mark = next((mark for mark in self._marks if mark.id == command["id"]), None)
        if mark is None:
            raise Refused(f"id: got {command['id']}, allowed: one of the newest {MOST} marks of this measurement")
        mark.text = command["text"]
        told = f"Marked: {mark.text}" if mark.text else "Marked."
        if mark.within and mark.within[0] is self._session.recorder:
            mark.within[0].rename_mark(mark.within[1], mark.text)
        elif mark.within:
            told += " Its recording is closed, and keeps the text it had."
        return {"id": mark.id, "message": told}

    def _begun(self, recorder: Recorder) -> None:
        """Put the marks that are within a recording, since it begins earlier, into it."""
        self._begin_again()
        first_s = recorder.first_s
        for mark in self._marks.copy():
            if first_s is not None and mark.t_s >= first_s:
                self._put(mark, recorder)

    def _put(self, mark: Mark, recorder: Recorder) -> None:
        try:
            mark.within = (recorder, recorder.mark(mark.text, mark.sample))
        except (ValueError, PalpateError) as error:  # a recording with 10,000 marks, or one that fails
            self._session.say(str(error))

    def _begin_again(self) -> None:
        if self._measurement != self._session.number:
            self._measurement = self._session.number
            self._marks.clear()

    def _follow(self, batch: Batch, stream: Stream) -> None:
        """Find holes and flags, in the thread of the measurement."""
        if stream.source is not self._holes.source:
            self._holes, self._places, self._flags = Holes(stream.source), Places(), []
        self._holes.follow(batch.samples)
        self._places.follow(batch)
        if batch.touches or batch.revised:
            self._flags = self._flags_of(self._session.touches)

    def _flags_of(self, touches: Sequence[Touch]) -> list[Document]:
        first = max(len(touches) - _FLAGGED, 0)
        return [
            {"t_s": self._places.of(number, flag, touch.start_s), "touch": number, "name": flag, "text": sentence}
            for number, touch in enumerate(touches[first:], first + 1)
            if touch.flags
            for flag, sentence in zip(touch.flags, advice(touch), strict=False)
        ]
