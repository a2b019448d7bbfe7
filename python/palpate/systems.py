"""What the systems do in different ways: the fine clock, the way to the disk, names that a file cannot have."""

import errno
import os
import re
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

fine_ns: Callable[[], int] = (
    time.perf_counter_ns if sys.platform == "win32" and sys.version_info < (3, 13) else time.monotonic_ns
)
"""The clock for times of samples, ns: `time.monotonic_ns`, but where that steps by 15.6 ms (Windows before Python 3.13)."""

REPLACE_S = 2.0
"""How long a file that another program has open is tried to be replaced, s."""
_AGAIN_S = 0.02
_DEVICE = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[1-9¹²³])\s*(\.|$)", re.IGNORECASE)


def on_monotonic(ns: int) -> int:
    """Return a time of `fine_ns` on the clock of `time.monotonic_ns()`, which programs compare; the same on most systems."""
    return ns if fine_ns is time.monotonic_ns else ns + time.monotonic_ns() - fine_ns()


def to_disk(descriptor: int, *, data_only: bool = False) -> None:
    """Write what the system has of an open file to the disk itself."""
    if sys.platform == "darwin":
        import fcntl

        with suppress(OSError):  # a file system without it
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    sync = getattr(os, "fdatasync", os.fsync) if data_only else os.fsync
    sync(descriptor)


def replace(path: Path, target: Path, system: str = sys.platform) -> None:
    """Give a file the name of another one, which is gone then; a reader has the old one or the new one."""
    until = time.monotonic() + REPLACE_S
    while True:
        try:
            path.replace(target)
        except PermissionError as error:
            if system != "win32":
                raise
            if time.monotonic() > until:
                said = "another program has it open, or it is read-only: close it there, or choose another name"
                raise PermissionError(errno.EACCES, said, str(target)) from error
            time.sleep(_AGAIN_S)
        else:
            return


def require_file_name(path: Path, system: str = sys.platform) -> None:
    """Refuse a name that is no file on Windows: what is written there is lost, or is not found again."""
    if system != "win32":
        return
    what = ""
    if _DEVICE.match(path.name):
        what = "is the name of a device on Windows"
    elif ":" in path.name:
        what = "has a colon, which names a hidden part of a file on Windows"
    elif path.name.endswith((".", " ")):
        what = "ends in a dot or a blank, which Windows leaves out"
    if what:
        raise OSError(errno.EINVAL, f"{what}: choose another name", str(path))
