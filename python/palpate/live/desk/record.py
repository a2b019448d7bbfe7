"""The button Record, which is always there: begins and ends recordings."""

from collections.abc import Callable
from typing import Any

from palpate.errors import PalpateError
from palpate.live.protocol import Command, Refused
from palpate.live.session import Session
from palpate.recording.recorder import Recorder
from palpate.stream import Stream
from palpate.stream.estimate import Batch

Document = dict[str, Any]
MOST = 200
"""Recordings of one run."""


class Record:
    """Begins and ends recordings while the measurement goes on.

    Parameters
    ----------
    session : Session

    Attributes
    ----------
    orders : dict
        Name of a command -> function; they wait for the disk.
    """

    def __init__(self, session: Session) -> None:
        self.orders: dict[str, Callable[[Command], str]] = {
            "record": self._do_record,
            "stop": lambda _: self._do_stop(),
        }
        self._session = session
        session.followers.append(self._follow)

    def document(self) -> Document:
        """Return what the state tells of recordings: the one that runs, the name of the next one, and all files."""
        session = self._session
        recorder, recordings = session.recorder, session.recordings
        return {
            "recording": self._now(recorder) if recorder else None,
            "proposed": recordings.proposed,
            "files": recordings.files,
        }

    def _now(self, recorder: Recorder) -> Document:
        first_s = recorder.first_s
        seconds = None if first_s is None else max(self._session.last_s - first_s, 0.0)
        return {"name": recorder.path.name, "rows": recorder.rows, "seconds": seconds}

    def _do_record(self, command: Command) -> str:
        session = self._session
        session.require_running("record")
        if session.stream.recorder:
            raise Refused("record: a recording is already running; stop it first")
        if len(session.recordings.names) >= MOST:
            raise Refused(f"record: got {MOST} recordings, allowed: no more; start palpate live again")
        path = session.recordings.next(command.given.get("name"))
        try:
            recorder = session.stream.start_recording(path, earlier=True)
        except BaseException:
            session.recordings.forget(path)
            raise
        session.records = True
        session.tell_begun(recorder)
        return f"Recording to {path.name}{_begins(recorder, session.last_s)}"

    def _do_stop(self) -> str:
        session = self._session
        recorder = session.recorder
        if recorder is None:
            raise Refused("stop: no recording is running")
        try:
            session.stream.stop_recording()
        except PalpateError as error:
            session.lost(recorder, error)
            raise
        session.records = False
        return session.tell_closed(recorder)

    def _follow(self, _: Batch, stream: Stream) -> None:
        """Close a recording that failed; in the thread of the measurement, which goes on."""
        recorder = stream.recorder
        if recorder and recorder.error:
            try:
                stream.stop_recording()
            except PalpateError as error:
                self._session.lost(recorder, error)


def _begins(recorder: Recorder, now_s: float) -> str:
    """Return from where a recording has begun."""
    earlier = 0.0 if recorder.first_s is None else now_s - recorder.first_s
    return f"; it begins {earlier:.0f} s ago" if earlier >= 1 else ""
