"""The session on the page: specimens, what each touch was on, what is left out, and notes; also in the recording."""

from collections import deque
from collections.abc import Callable, Collection
from math import inf, isfinite
from threading import RLock
from typing import Any

from palpate._core import Touch
from palpate.errors import PalpateError
from palpate.live.desk import plan_document
from palpate.live.desk.growth import Known
from palpate.live.desk.progress import Done, Progress
from palpate.live.desk.specimens import specimens_of
from palpate.live.protocol import Command, Refused
from palpate.live.session import Session
from palpate.recording import session as stored
from palpate.recording.recorder import Recorder
from palpate.recording.remarks import amend
from palpate.several import objections

Document = dict[str, Any]
MOST_NOTES = 500
"""Notes of a measurement."""


class Plan:
    """What is touched, and what was.

    Parameters
    ----------
    session : Session
    accepted : callable
        Returns the flags that do not exclude a touch, those of the calibration.

    Attributes
    ----------
    orders : dict
        Name of a command -> function.
    """

    def __init__(self, session: Session, accepted: Callable[[], Collection[str]] = frozenset) -> None:
        orders: dict[str, Callable[[Command], str]] = {
            "plan": self._do_plan,
            "specimen": self._do_specimen,
            "assign": self._do_assign,
            "discard": lambda command: self._do_keep(command, keep=False),
            "keep": lambda command: self._do_keep(command, keep=True),
            "more": lambda _: self._do_more(),
            "note": self._do_note,
        }
        self.orders: dict[str, Callable[[Command], str]] = {name: self._kept(order) for name, order in orders.items()}
        self._session, self._accepted = session, accepted
        self._progress = Progress()
        self._lock = RLock()
        self._head: Document = {"title": "", "operator": "", "wanted": 4}
        self._notes: deque[stored.Note] = deque()
        self._seen: tuple[int, list[Touch], Collection[str]] = (session.number, [], frozenset())
        self._document: Document = {}
        self._rows: list[Document] = []
        self._stored_in: Recorder | None = None
        self._latest: Recorder | None = None
        session.followers.append(lambda batch, _: self._catch_up() if batch.touches or batch.revised else None)
        session.begun.append(self._store)
        self._changed()

    def document(self) -> Document:
        """Return the message `session`."""
        with self._lock:
            self._catch_up()
            return self._document

    def rows(self) -> list[Document]:
        """Return what is known of each touch of the measurement: specimen, deviation, kept, and why it is not."""
        with self._lock:
            self._catch_up()
            return self._rows

    def known(self) -> list[Known]:
        """Return the specimens of known modulus, with their touches."""
        with self._lock:
            self._catch_up()
            return plan_document.known(self._progress)

    def _catch_up(self) -> None:
        """Take the touches that have ended, or were revised, since the last call."""
        with self._lock:
            number, touches = self._session.measured()
            accepted = self._accepted()
            before, self._seen = self._seen, (number, touches, accepted)
            if number != before[0]:
                self._progress.begin()
                self._notes.clear()
                self._latest = self._session.recorder
            if number != before[0] or touches is not before[1] or accepted != before[2]:
                self._progress.take(touches)
                self._changed()

    def _changed(self) -> None:
        self._progress.settle(self._session.last_s, self._seen[2])
        self._document = {
            **self._head,
            **plan_document.session(self._progress),
            "notes": [{"t_s": note.t_s, "text": note.text} for note in self._notes],
        }
        self._rows = plan_document.rows(self._progress)
        if recorder := self._session.recorder:
            self._store(recorder)

    def _store(self, recorder: Recorder) -> None:
        """Give a recording the session as it is now: what is within it."""
        with self._lock:
            self._latest = recorder
            plan = self._within(-inf if recorder.first_s is None else recorder.first_s)
            if plan == stored.Plan() and recorder is not self._stored_in:
                return
            try:
                recorder.session(plan)
                self._stored_in = recorder
            except (ValueError, PalpateError) as error:  # no room for it, or closed at this moment
                self._session.say(str(error))

    def _kept(self, order: Callable[[Command], str]) -> Callable[[Command], str]:
        """Return an order after which a recording that has ended, too, tells what the page shows."""

        def obey(command: Command) -> str:
            message = order(command)
            with self._lock:
                closed = None if self._session.recorder else self._latest
                if closed and closed.first_s is not None:
                    amend(closed.path, self._within(closed.first_s))
            return message

        return obey

    def _within(self, first_s: float) -> stored.Plan:
        progress, newest = self._progress, self._progress.present[-stored.MOST_TOUCHES :]
        entries = (
            stored.Entry(done.touch.start_s, done.specimen, progress.why[done.number][: stored.LONGEST_NAME])
            for done in newest
            if isfinite(done.touch.start_s) and done.touch.start_s >= first_s
        )
        return stored.Plan(
            self._head["title"],
            self._head["operator"],
            tuple(progress.specimens),
            tuple(entry for entry in entries if entry.specimen or entry.left_out),
            tuple(note for note in self._notes if note.t_s >= first_s),
        )

    def _do_plan(self, command: Command) -> str:
        specimens, given = specimens_of(command["text"], command["wanted"]), command.given
        with self._lock:
            self._catch_up()
            self._head = {name: given.get(name, before) for name, before in self._head.items()}
            self._progress.replace(specimens)
            self._changed()
        wanted = "1 touch" if command["wanted"] == 1 else f"{command['wanted']} touches"
        return f"{len(specimens)} specimens, {wanted} of each." if specimens else "No specimens."

    def _do_specimen(self, command: Command) -> str:
        with self._lock:
            self._catch_up()
            self._progress.choose(self._in_list(command["name"]), self._session.last_s)
            self._changed()
            return self._following() or "Next: nothing is lacking."

    def _do_assign(self, command: Command) -> str:
        with self._lock:
            done = self._done(command)
            done.specimen = self._in_list(command["name"]) or None
            self._changed()
        return f"Touch {done.number}: {done.specimen or 'no specimen'}."

    def _do_keep(self, command: Command, *, keep: bool) -> str:
        with self._lock:
            done = self._done(command)
            if keep and not isfinite(done.touch.ratio):
                raise Refused(f"keep: touch {done.number} has no ratio; touch again")
            done.wish = None if keep and not objections(done.touch, self._seen[2]) else keep
            self._changed()
            told = "kept" if keep else "left out"
            return f"Touch {done.number} is {told}. {self._following()}".strip()

    def _do_more(self) -> str:
        with self._lock:
            self._catch_up()
            specimen = self._progress.more()
            if specimen is None:
                raise Refused(f"more: allowed: up to {stored.MOST_WANTED} touches of a specimen of the list")
            self._changed()
        return f"{specimen.name}: {specimen.wanted} touches are wanted."

    def _do_note(self, command: Command) -> str:
        with self._lock:
            self._catch_up()
            if len(self._notes) >= MOST_NOTES:
                raise Refused(f"note: got {MOST_NOTES} notes in this measurement, allowed: no more")
            self._notes.append(stored.Note(self._session.last_s, command["text"]))
            self._changed()
        return f"Noted: {command['text']}"

    def _following(self) -> str:
        following = self._progress.next
        return f"Next: {following}." if following else ""

    def _in_list(self, name: str) -> str:
        if name and not self._progress.named(name):
            names = ", ".join(one.name for one in self._progress.specimens[:10]) or "none: write a list first"
            raise Refused(f"name: got {name!r:.60}, allowed: a specimen of the list: {names}")
        return name

    def _done(self, command: Command) -> Done:
        self._catch_up()
        present, number = self._progress.present, int(command["touch"])
        if not 1 <= number <= len(present):
            raise Refused(f"touch: got {number}, allowed: a touch of this measurement, 1 to {len(present)}")
        return present[number - 1]
