"""The lock of Linux and macOS, `flock`: of the whole file, and only for those who ask."""

import fcntl
import sys

assert sys.platform != "win32"


class Flock:
    """Locks open files."""

    def take(self, descriptor: int, *, shared: bool) -> bool:
        """Lock; return False where another one has the lock.

        Raises
        ------
        OSError
            The file system has no locks.
        """
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def release(self, descriptor: int) -> None:
        """Unlock, also where a child process has the file open, too."""
        fcntl.flock(descriptor, fcntl.LOCK_UN)
