"""Opens and parses files that anyone may have made, and replaces a file as a whole, as each system allows it."""

import errno
import os
import re
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

MOST_TOML = 200_000  # characters
REPLACE_S = 2.0
"""How long a file that another program has open is tried to be replaced, s."""
_AGAIN_S = 0.02
_DEVICE = re.compile(
    r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[1-9¹²³])\s*(\.|$)", re.IGNORECASE
)
_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def open_regular(path: Path) -> BinaryIO:
    """Open a file to read bytes; never waits, as for a pipe that nobody writes.

    Raises
    ------
    OSError
        The file cannot be opened, or is not a regular file: a pipe, a device, a folder.

    Examples
    --------
    >>> open_regular(Path("/dev/zero"))  # doctest: +SKIP
    Traceback (most recent call last):
    OSError: [Errno 22] a device, not a file: use a file in place of it: '/dev/zero'
    """
    _require_regular(
        path, path.stat().st_mode
    )  # before it is opened, which a device may already act on
    return path.open("rb")


def _require_regular(path: Path, mode: int) -> None:
    if stat.S_ISDIR(mode):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        kind = _KINDS.get(stat.S_IFMT(mode), "not a regular file")
        raise OSError(errno.EINVAL, f"{kind}, not a file: use a file in place of it", str(path))


def read_bytes(path: Path, most: int) -> bytes:
    """Return the contents of a regular file.

    Parameters
    ----------
    path : pathlib.Path
    most : int
        Largest size, bytes.

    Raises
    ------
    OSError
        As `open_regular`; or the file is larger.
    """
    with open_regular(path) as file:
        if os.fstat(file.fileno()).st_size > most:
            raise OSError(
                errno.EFBIG,
                f"larger than {most:,} bytes, the most that such a file may have",
                str(path),
            )
        return file.read()


def read_toml(path: Path) -> dict[str, Any]:
    """Return the contents of a TOML file; errors as of `read_bytes` and `parse_toml`, or ValueError if it is not UTF-8."""
    return parse_toml(read_bytes(path, MOST_TOML).decode())


def parse_toml(text: str) -> dict[str, Any]:
    """Return the contents of a text in TOML; ValueError: not TOML, or too large.

    Examples
    --------
    >>> parse_toml("a.b = 1")
    {'a': {'b': 1}}
    """
    import tomllib

    if len(text) > MOST_TOML:
        raise ValueError(f"got {len(text):,} characters, allowed: {MOST_TOML:,}")
    return tomllib.loads(text)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Write a file that takes the place of another one when it is complete: a reader sees the old one or the new one.

    It is written under a random name in the same folder; no file that exists is opened. After an error it is removed.
    It has the permissions of the file it replaces, else those of the umask. A link is replaced; the file that it points
    to stays as it is.

    Raises
    ------
    OSError
        The file cannot be written, or there is something else of this name: a pipe, a device, a folder. On Windows: it
        stays open in another program, or the name does not belong to a file.
    """
    require_file_name(path)
    mode = _mode_of(path)
    beside = path.with_name(f".{path.name[:40]}.{os.urandom(8).hex()}")
    try:
        with beside.open("xb") as file:  # follows no link, and opens no file that exists
            yield file
            file.flush()
            to_disk(file.fileno())
        if mode is not None:
            beside.chmod(mode)
        replace(beside, path)
    except BaseException as error:
        beside.unlink(missing_ok=True)
        if (
            isinstance(error, OSError) and error.errno and error.filename in (None, str(beside))
        ):  # a write knows no name
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise
    for each in (
        path,
        path.parent,
    ):  # FAT writes what a name stands for only with the file, not with the folder
        sync(each)


def write(path: Path, data: bytes) -> None:
    """Write a file as a whole; errors as of `replacing`."""
    with replacing(path) as file:
        file.write(data)


def _mode_of(path: Path) -> int | None:
    """Return the permissions of a file that is replaced; None: there is none, or it is a link."""
    with suppress(FileNotFoundError):
        _require_regular(path, path.stat().st_mode)
        mode = path.lstat().st_mode
        return None if stat.S_ISLNK(mode) else mode & 0o777
    return None


def sync(path: Path) -> None:
    """Sync a file, or the names in a folder, to the disk, if the system can."""
    with suppress(OSError):
        opened = os.open(path, os.O_RDONLY)
        try:
            to_disk(opened)
        finally:
            os.close(opened)


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
