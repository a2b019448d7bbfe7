"""The mark of a recording that is still being made: a lock on its file, which ends with the process, however that ends."""

from pathlib import Path
from typing import IO, Any

try:
    import fcntl
except ImportError:  # pragma: no cover: Windows has none, and a recording there looks finished or torn
    fcntl = None  # type: ignore[assignment]


def lock(file: IO[Any]) -> None:
    """Mark an open file as being written."""
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_locked(path: Path) -> bool:
    """Tell whether someone has marked a file."""
    if fcntl is None:
        return False
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:  # a file system without locks
            return False
    return False
