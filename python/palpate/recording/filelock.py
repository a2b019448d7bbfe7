"""Marks a recording in progress by a lock on its file; the lock ends with the process, also if that is killed."""

from pathlib import Path
from typing import IO, Any

from palpate.files import open_regular
from palpate.tables.packed import STANDARD_INPUT

try:
    import fcntl
except ImportError:  # pragma: no cover: not on Windows: there a recording in progress looks complete or torn
    fcntl = None  # type: ignore[assignment]


def lock(file: IO[Any]) -> None:
    """Lock an open file: it is being written."""
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_locked(path: Path) -> bool:
    """Return whether a process is writing the file; False where the system has no locks."""
    if fcntl is None or path == STANDARD_INPUT:
        return False
    with open_regular(path) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:  # a file system without locks
            return False
    return False
