"""What is said of a recording in progress beside its samples: notes, marks, and what is touched."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.session import Plan
from palpate.recording.sidecar_file import SidecarFile
from palpate.recording.writer import Writer, unwritable
from palpate.samples import Sample


class Remarks:
    """The remarks on a recording in progress; from any thread.

    Parameters
    ----------
    writer : Writer

    Attributes
    ----------
    first_s : float or None
        Time of the first sample of the recording, s; None: there is none yet.
    """

    def __init__(self, writer: Writer) -> None:
        self.first_s: float | None = None
        self._writer = writer
        self._closing = False

    @property
    def path(self) -> Path:
        """NAME.csv, absolute; after a rescue the other recording."""
        return self._writer.path

    def note(self, text: str) -> None:
        """Add a note to the sidecar.

        Raises
        ------
        ValueError
            There is no room for more notes in this recording; it goes on.
        RecordingError
            The sidecar cannot be written.
        """
        self._add("notes", text)

    def mark(self, text: str, sample: Sample | None, **more: Any) -> int:
        """Add a mark at a sample to the sidecar; return its number, from 1. Errors as in `note`."""
        return self._add("marks", marked(text, sample, **more))

    def mark_at(self, t_s: float, text: str) -> int:
        """Add a mark at a time, s, as `mark`.

        Raises
        ------
        ValueError
            The recording began later.
        """
        if self.first_s is None or not t_s >= self.first_s:
            begins = "it has no row yet" if self.first_s is None else f"from {self.first_s:.3f} s on, where it begins"
            raise ValueError(f"mark: got {t_s:.3f} s, allowed: a time that is in the recording: {begins}")
        return self._add("marks", {"t_s": t_s, "text": text})

    def rename_mark(self, number: int, text: str) -> None:
        """Give a mark another text, until the recording is closed.

        Raises
        ------
        ValueError
            There is no mark with this number, it is a tare or a gap, or the recording is closed.
        RecordingError
            The sidecar cannot be written.
        """
        self._change(lambda file: file.rename(number, text))

    def session(self, plan: Plan) -> None:
        """Store what is touched; it goes to the sidecar with the next checkpoint, and at the end.

        Raises
        ------
        ValueError
            There is no room for it, or the recording is closed.
        """
        self._change(lambda file: file.set("session", plan.as_dict()))

    def _add(self, where: str, what: Any) -> int:
        added: list[int] = []
        self._change(lambda file: added.append(file.add(where, what)))
        return added[0]

    def _change(self, change: Callable[[SidecarFile], None]) -> None:
        if self._closing:
            raise ValueError(f"{self.path.name}: got a change of a closed recording, allowed: until it is closed")
        try:
            change(self._writer.sidecar)
        except OSError as error:
            raise unwritable(self.path, error) from error


def amend(path: Path, plan: Plan) -> None:
    """Replace what was touched in the sidecar of a recording that has ended.

    Raises
    ------
    RecordingError
        The sidecar is gone, is no longer one, or cannot be written.
    """
    document = sidecar.load(path)
    if document is None:
        raise RecordingError(sidecar.sidecar_path(path), "is gone: the change of the session is in no file")
    try:
        sidecar.save(sidecar.sidecar_path(path), {**document, "session": plan.as_dict()})
    except OSError as error:
        raise unwritable(path, error) from error


def marked(text: str, sample: Sample | None, **more: Any) -> dict[str, Any]:
    """Return a mark at a sample, as it is in the sidecar."""
    where = {} if sample is None else {"seq": sample.seq, "t_s": sample.t_hard_ns / 1e9}
    return {**where, "text": text, **more}
