"""The sidecar of a recording in progress: saved at each change, never over the file of another program."""

import errno
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO

from palpate.errors import RecordingError
from palpate.files import read_bytes, replacing
from palpate.recording import sidecar
from palpate.systems import to_disk

_MOST_BYTES = sidecar.LARGEST - 20_000  # the rest is for checkpoint and end
_MOST = {"notes": sidecar.MOST_MARKS - 10, "marks": sidecar.MOST_MARKS}  # the rest is for notes of the recorder
_NO_TEXT = (errno.EFBIG, errno.EINVAL, errno.EISDIR)  # of `read_bytes`: larger, or not a regular file


class SidecarFile:
    """The sidecar of a recording in progress; may be changed from any thread.

    Parameters
    ----------
    path : pathlib.Path
        Absolute path of a file that does not exist.
    document : dict
        As from `sidecar.fresh`.

    Attributes
    ----------
    path : pathlib.Path
    unsaved : bool
        Whether an entry was set that is not yet in the file.

    Raises
    ------
    FileExistsError, OSError
        The file exists, or cannot be written.
    ValueError
        Too many notes, or too long ones.
    """

    def __init__(self, path: Path, document: dict[str, Any]) -> None:
        self.unsaved: bool = False
        self._lock = Lock()
        self._document = document
        _require_few(document, "notes")
        self._begin(path, _small_text(document, "notes"))

    def add(self, name: str, what: Any) -> int:
        """Add a note or a mark; return how many there are with it.

        Raises
        ------
        ValueError
            There is no room for more; nothing is changed.
        RecordingError
            As `put`.
        """
        with self._lock:
            longer = {**self._document, name: [*self._document[name], what]}
            _require_few(longer, name)
            self._save(longer, lambda document: _small_text(document, name))
            return len(longer[name])

    def rename(self, number: int, text: str) -> None:
        """Give a mark another text.

        Parameters
        ----------
        number : int
            From 1, as `add` returns it.
        text : str

        Raises
        ------
        ValueError
            There is no such mark, it is one of the recorder, or there is no room for the text; nothing is changed.
        RecordingError
            As `put`.
        """
        with self._lock:
            marks = list(self._document["marks"])
            if not 1 <= number <= len(marks):
                raise ValueError(f"mark: got number {number}, allowed: 1 to {len(marks)}, as it was returned")
            if marks[number - 1].get("tare"):
                raise ValueError(f"mark: got number {number}, a tare or gap, allowed: a mark that was made by hand")
            marks[number - 1] = {**marks[number - 1], "text": text}
            self._save({**self._document, "marks": marks}, lambda document: _small_text(document, "marks"))

    def set(self, name: str, what: dict[str, Any]) -> None:
        """Set an entry; it is saved with the next `put`.

        Raises
        ------
        ValueError
            There is no room for it; nothing is changed.
        """
        with self._lock:
            other = {**self._document, name: what}
            _small_text(other, name)
            self._document, self.unsaved = other, True

    def put(self, *notes: str, **entries: Any) -> None:
        """Add notes of the recorder, set entries, and save; None removes one.

        Raises
        ------
        RecordingError
            Another program has changed or replaced the sidecar: it is left as it is.
        OSError
            The sidecar cannot be written; it is as it was before.
        """
        with self._lock:
            self._save(_with(_noted(self._document, *notes), entries), _text)

    def move(self, path: Path, note: str, end: dict[str, Any]) -> None:
        """Go on in another file, with a note; the file until now gets this end, if it is still there.

        Raises
        ------
        FileExistsError, OSError
            The other file exists, or cannot be written; nothing is changed.
        """
        with self._lock:
            before, old = self._document, self.path
            ours = self._is_ours()
            after = _with(_noted(before, note), {"checkpoint": None})
            self._begin(path, _text(after))
            self._document = after
            if ours:
                with suppress(OSError):
                    sidecar.save(old, {**before, "end": end})

    def discard(self) -> None:
        """Remove the sidecar: there is no recording."""
        self.path.unlink()

    def _begin(self, path: Path, text: bytes) -> None:
        path.open("xb").close()  # the process that creates it owns the name
        try:
            with replacing(path) as file:
                file.write(text)
        except OSError:
            path.unlink()
            raise
        self.path, self._saved = path, text

    def _save(self, document: dict[str, Any], text_of: Callable[[dict[str, Any]], bytes]) -> None:
        text = text_of(document)
        self._require_ours()
        with replacing(self.path) as file:
            _write(file, text)
            removed = self._require_ours()  # as late as can be: another program may write at any time
        self._document, self._saved = document, text
        self.unsaved = False
        if removed:
            self._save(_noted(document, sidecar.AGAIN), _text)

    def _require_ours(self) -> bool:
        """Raise RecordingError if another program has changed the sidecar; return whether it was removed."""
        try:
            if self._is_changed():
                raise RecordingError(self.path, "was changed by another program while it was recorded")
        except FileNotFoundError:
            return True
        return False

    def _is_ours(self) -> bool:
        try:
            return not self._is_changed()
        except OSError:
            return False

    def _is_changed(self) -> bool:
        try:
            return read_bytes(self.path, len(self._saved)) != self._saved
        except OSError as error:
            if error.errno in _NO_TEXT:
                return True
            raise


def _require_few(document: dict[str, Any], name: str) -> None:
    if len(document[name]) > _MOST[name]:
        raise ValueError(
            f"{name}: got {len(document[name])}, allowed: {_MOST[name]} in one recording; begin another one"
        )


def _small_text(document: dict[str, Any], name: str) -> bytes:
    text = _text(document)
    if len(text) > _MOST_BYTES:
        raise ValueError(
            f"{name}: got {len(text)} bytes of sidecar with them, allowed: {_MOST_BYTES}; begin another one"
        )
    return text


def _noted(document: dict[str, Any], *notes: str) -> dict[str, Any]:
    """Return a sidecar with more notes, each of them once."""
    known = document["notes"]
    return {**document, "notes": [*known, *(note for note in notes if note not in known)]}


def _text(document: dict[str, Any]) -> bytes:
    return sidecar.text_of(document).encode()


def _with(document: dict[str, Any], entries: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in {**document, **entries}.items() if value is not None}


def _write(file: BinaryIO, text: bytes) -> None:
    file.write(text)
    file.flush()
    to_disk(file.fileno())
