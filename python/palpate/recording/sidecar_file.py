"""The sidecar of a recording in progress: a document in memory that is saved, and saved again if that fails."""

from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import Any

from palpate.files import Json, read_bytes, replacing, to_disk
from palpate.recording import sidecar
from palpate.recording.retry_state import RetryState, reason_of

_MOST_BYTES = sidecar.LARGEST - 20_000  # the rest is for checkpoint and end
_CHANGED = "was changed by another program while it was recorded; it is left as it is"


class SidecarFile:
    """The sidecar of a recording in progress; its methods may be called from any thread.

    A change is in memory at once. `save` writes all changes; what it cannot write waits for the
    next `save`, so a sidecar that cannot be written never ends a recording.

    Attributes
    ----------
    retry : RetryState
        Whether the last `save` has failed.
    is_foreign : bool
        Whether another program has changed the file; palpate does not replace it then.
    """

    def __init__(self, path: Path, document: Json) -> None:
        self.path = path
        self.retry: RetryState = RetryState()
        self.is_foreign = False
        self._changing = Lock()
        self._saving = Lock()  # held while the disk writes, which may take long
        self._document = document  # replaced at each change
        self._with("notes", document["notes"])
        path.open("xb").close()  # the process that creates it owns the name
        self._saved = self._tried = b""
        try:
            self._write(document)
        except OSError:
            path.unlink()
            raise

    @property
    def is_saved(self) -> bool:
        """Whether all changes are on the disk."""
        return self._document is self._saved_document

    def add(self, name: str, entry: str | Json) -> int:
        """Add a note or a mark; return their number. ValueError: there is no room for it."""
        with self._changing:
            longer = [*self._document[name], entry]
            self._document = self._with(name, longer)
            return len(longer)

    def rename(self, number: int, text: str) -> None:
        """Give a mark another text; its number, from 1, is as `add` returned it. Errors as in `add`."""
        with self._changing:
            marks = list(self._document["marks"])
            if not 1 <= number <= len(marks):
                raise ValueError(
                    f"mark: got number {number}, allowed: 1 to {len(marks)}, as it was returned"
                )
            if marks[number - 1].get("tare"):
                raise ValueError(
                    f"mark: got number {number}, a tare or gap, allowed: a mark that was made by hand"
                )
            marks[number - 1] = {**marks[number - 1], "text": text}
            self._document = self._with("marks", marks)

    def set(self, name: str, entry: Json) -> None:
        """Set an entry; ValueError: there is no room for it."""
        with self._changing:
            self._document = self._with(name, entry)

    def put(self, *notes: str, **entries: Any) -> None:
        """Add notes, and set entries, for which there is always room; None removes one."""
        with self._changing:
            document = {**self._document, "notes": [*self._document["notes"], *notes], **entries}
            self._document = {name: value for name, value in document.items() if value is not None}

    def save(self) -> bool:
        """Write all changes to the disk; return False if that failed: they wait for the next call."""
        with self._saving:
            document = self._document
            if document is self._saved_document:
                return True
            try:
                self._write(document)
            except Exception as error:  # noqa: BLE001  it is tried again, and shown
                self.retry.failed(_CHANGED if self.is_foreign else reason_of(error))
                return False
            self.retry.succeeded()
            return True

    def _with(self, name: str, entry: object) -> Json:
        """Return the document with an entry; ValueError if it is too long."""
        document = {**self._document, name: entry}
        size = len(sidecar.text_of(document))
        if size > _MOST_BYTES:
            allowed = f"{_MOST_BYTES}; begin another one"
            raise ValueError(f"{name}: got {size} bytes of sidecar with them, allowed: {allowed}")
        return document

    def _write(self, document: Json) -> None:
        text = sidecar.text_of(document).encode()
        with replacing(self.path) as file:
            file.write(text)
            file.flush()
            to_disk(file.fileno())
            self._require_own()
            self._tried = text
        self._saved = text
        self._saved_document = document

    def _require_own(self) -> None:
        """Raise an error if the file is not as it was saved; one that was removed is written again."""
        self.is_foreign = False
        with suppress(FileNotFoundError):
            # A rename may be done though it reports an error: then the file has the text of that try.
            if read_bytes(self.path, sidecar.LARGEST) not in (self._saved, self._tried):
                self.is_foreign = True
                raise OSError(_CHANGED)
