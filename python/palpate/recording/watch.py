"""Notices that another program has removed, renamed, replaced, cut or extended a file that is being written."""

import os
from contextlib import suppress
from io import FileIO
from pathlib import Path

from palpate.errors import RecordingError


class Watch:
    """Compares an open file with its path.

    Parameters
    ----------
    file : FileIO
        Just created, open.
    path : pathlib.Path
        Its absolute path.
    """

    def __init__(self, file: FileIO, path: Path) -> None:
        self._file, self._path = file, path
        held = os.fstat(file.fileno())
        self._identified = os.path.samestat(held, path.stat())  # some network file systems number a file anew
        self._linked = held.st_nlink > 0

    def look(self, size: int) -> None:
        """Compare the open file with the path.

        Parameters
        ----------
        size : int
            Bytes that were written.

        Raises
        ------
        RecordingError
            The path does not lead to the open file any more, or the file has another size.
        OSError
            The disk does not answer.
        """
        if what := self._change(size):
            raise RecordingError(self._path, f"{what} while it was recorded")

    def _change(self, size: int) -> str | None:
        held = os.fstat(self._file.fileno())
        try:
            named = self._path.stat()
        except (FileNotFoundError, NotADirectoryError):
            return self._gone(held)
        if self._identified and not os.path.samestat(held, named):
            return "was replaced by another file"
        if held.st_size < size:
            return f"was cut by another program, from {size} bytes to {held.st_size},"
        return f"was extended by another program, from {size} bytes to {held.st_size}," if held.st_size > size else None

    def _gone(self, held: os.stat_result) -> str:
        if self._linked and held.st_nlink == 0:
            return "was removed"
        with suppress(OSError):  # Linux knows its new name
            name = Path(f"/proc/self/fd/{self._file.fileno()}").readlink()
            if os.path.samestat(held, name.stat()):
                return f"was renamed to {name}"
        return "was removed, renamed or moved"
