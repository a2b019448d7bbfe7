"""Read files that anyone may have made, also packed ones, and replace a file as a whole."""

import errno
import gzip
import io
import os
import re
import shutil
import stat
import sys
import time
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import IO, Any, BinaryIO, TextIO

from palpate.errors import RecordingError
from palpate.file_locks import try_lock, unlock

Json = dict[str, Any]
"""The contents of a JSON or TOML file, or an entry of it."""
LARGEST_TOML = 200_000  # characters
DEEPEST_TOML = 32
"""Most levels of a TOML file: dots in keys and open brackets. Python's parser needs quadratic time for
dots, and a level of its stack for each bracket."""
LONGEST_TOML_WORD = 100
"""Most characters of a number, or of a name without quotes: an integer then fits into a float."""
LARGEST_TABLE = 500_000_000
"""Largest table, bytes, also after decompression or from standard input: it is read as a whole."""
REPLACE_S = 2.0
"""How long palpate tries to replace a file that another program has open, s."""
STANDARD_INPUT = Path("-")
"""This name is standard input in every command and in `palpate.read`; ./folder/- is a file."""
EXISTS = "already exists: choose another name"
_AGAIN_S = 0.02
_PART = 1 << 22  # bytes
_GZIP = b"\x1f\x8b"
_LEFT = re.compile(r"\..{1,40}\.palpate-[0-9a-f]{16}", re.DOTALL)
"""Name of a file that is being written."""
_DEVICE = re.compile(
    r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[1-9¹²³])\s*(\.|$)", re.IGNORECASE
)
_TOML_MARKS = re.compile(
    r'''
    """(?:\\.|[^\\])*?"{3,5}          # text of several lines; two quotes more may end it
    | \'{3}.*?\'{3,5}
    | "(?:\\.|[^"\\\n])*"              # text
    | '[^'\n]*'
    | ["'].*                           # text without an end: the parser stops there
    | \#[^\n]*
    | (?P<word>[\w+-]+)
    | [][{}.,\n]
    ''',
    re.DOTALL | re.VERBOSE,
)
_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def open_regular(path: Path) -> BinaryIO:
    """Open a file to read bytes, and never wait, for example for a pipe that nobody writes.

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
    _require_regular(path, path.stat().st_mode)  # a device may act already when it is opened
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


def open_unpacked(path: Path) -> BinaryIO:
    """Open a file, a .gz file or standard input, to read the unpacked bytes.

    Raises
    ------
    OSError
        As `open_regular`; or a .gz file is damaged or too large.
    """
    if path == STANDARD_INPUT:
        file: BinaryIO = io.BytesIO(_standard_input(sys.stdin))
    else:
        file = open_regular(path)
    begin = file.read(len(_GZIP))
    file.seek(0)
    if begin != _GZIP:
        return file
    try:
        with file, gzip.GzipFile(fileobj=file) as unpacked:
            return io.BytesIO(_read_limited(unpacked))
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        reason = f"damaged, or not complete ({error}): make the .gz file again"
        raise OSError(errno.EIO, reason) from error


def read_unpacked(path: Path) -> bytes:
    """Return the unpacked bytes of a file, a .gz file or standard input.

    Raises
    ------
    RecordingError
        The file cannot be read, or is empty.
    """
    with file_errors(path, "cannot be read"), open_unpacked(path) as file:
        data = _read_limited(file)
    if not data:
        raise RecordingError(path, "is empty")
    return data


@contextmanager
def file_errors(path: Path, failure: str) -> Iterator[None]:
    """Turn OSError into RecordingError: the failure, such as "cannot be read", and its reason."""
    try:
        yield
    except FileExistsError as error:
        raise RecordingError(path, EXISTS) from error
    except OSError as error:
        raise RecordingError(path, f"{failure}: {error.strerror or error}") from error


def unpacked_name(path: Path) -> str:
    """Return the name of a file without .gz."""
    return path.stem if path.suffix.lower() == ".gz" else path.name


def _read_limited(file: IO[bytes] | gzip.GzipFile) -> bytes:
    parts = []
    size = 0
    while part := file.read(_PART):  # read(n) first allocates n bytes
        parts.append(part)
        size += len(part)
        if size > LARGEST_TABLE:
            reason = f"larger than {LARGEST_TABLE:,} bytes, the most that such a file may have"
            raise OSError(errno.EFBIG, reason)
    return b"".join(parts)


@lru_cache(maxsize=1)
def _standard_input(stream: TextIO) -> bytes:
    """Return all bytes of a stream; it can be read only once, but a recording is read again."""
    if stream.isatty():
        reason = "standard input is a terminal: send a file to it, as in palpate check - < run.csv"
        raise OSError(errno.EINVAL, reason)
    return _read_limited(stream.buffer)


def read_toml(path: Path) -> Json:
    """Return the contents of a TOML file.

    Raises
    ------
    OSError
        As `read_bytes`.
    ValueError
        As `parse_toml`; or the file is not UTF-8.
    """
    return parse_toml(read_bytes(path, LARGEST_TOML).decode())


def parse_toml(text: str) -> Json:
    """Return the contents of a text in TOML.

    Raises
    ------
    ValueError
        The text is not TOML, is too large, has too many levels, or too long words.

    Examples
    --------
    >>> parse_toml("a.b = 1")
    {'a': {'b': 1}}
    """
    import tomllib

    if len(text) > LARGEST_TOML:
        raise ValueError(
            f"got {len(text):,} characters, allowed: {LARGEST_TOML:,}: make it smaller"
        )
    _require_plain(text)
    return tomllib.loads(text)


def _require_plain(text: str) -> None:
    """Refuse a text in TOML with more than `DEEPEST_TOML` levels, or too long words or numbers."""
    line = 1
    level = 0
    outer_levels = [0]  # of each open bracket, the level at which a key or value in it begins
    for match in _TOML_MARKS.finditer(text):
        mark = match[0]
        if match["word"] and len(mark) > LONGEST_TOML_WORD:
            size = f"a number or name of {len(mark):,} characters"
            raise ValueError(
                f"line {line}: got {size}, allowed: {LONGEST_TOML_WORD}: use a shorter one"
            )
        if mark == ".":
            level += 1
        elif mark in ("[", "{"):
            level += 1
            outer_levels.append(level)
        elif mark in ("]", "}") and len(outer_levels) > 1:
            outer_levels.pop()
            level = outer_levels[-1]
        elif mark in (",", "\n"):
            level = outer_levels[-1]
        line += mark.count("\n")
        if level > DEEPEST_TOML:
            levels = f"more than {DEEPEST_TOML} levels of dots and brackets"
            raise ValueError(f"line {line}: got {levels}, allowed: {DEEPEST_TOML}: use fewer")


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Write a file that replaces another one when it is complete: readers see the old or the new.

    It is written under a random name in the same folder, and no file that exists is opened. After
    an error it is removed; after a kill, by the next program that writes in this folder. It gets
    the permissions of the file that it replaces, else those of the umask. A link is replaced, and
    the file that it points to stays as it is.

    Raises
    ------
    OSError
        The file cannot be written, or its name belongs to a pipe, a device or a folder. On
        Windows: another program keeps it open, or the name cannot be that of a file.
    """
    require_file_name(path)
    _remove_left(path.absolute().parent)
    mode = _mode_of(path)
    beside, file = _create_beside(path)
    try:
        with file:
            yield file
            file.flush()
            to_disk(file.fileno())
            unlock(file)
        if mode is not None:
            beside.chmod(mode)
        replace(beside, path)
    except BaseException as error:
        beside.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno:
            if error.filename in (None, str(beside)):  # the error of a write has no name
                raise OSError(error.errno, error.strerror, str(path)) from error
        raise
    sync(path)  # FAT writes the entry of a name only with the file, not with the folder
    sync(path.parent)


@contextmanager
def replacing_both(path: Path, other: Path) -> Iterator[tuple[BinaryIO, BinaryIO]]:
    """As `replacing` for two files: both are replaced, or after an error none.

    After a kill between two renames the first one may be there without the other.
    """
    kept, copy = None, None
    with ExitStack() as undo:
        if path.exists():
            kept, copy = _create_beside(path)
            undo.callback(kept.replace, path)
            undo.enter_context(copy)  # open until then: its lock says that it is in use
            with path.open("rb") as present:
                shutil.copyfileobj(present, copy)
            copy.flush()
        else:
            undo.callback(path.unlink, missing_ok=True)
        with replacing(other) as second, replacing(path) as first:
            yield first, second
        undo.pop_all()
    if kept and copy:
        copy.close()
        kept.unlink(missing_ok=True)


def _create_beside(path: Path) -> tuple[Path, BinaryIO]:
    """Create a locked file in the folder of another one: the lock ends with this process."""
    while True:
        beside = path.with_name(f".{path.name[:40]}.palpate-{os.urandom(8).hex()}")
        try:
            file = beside.open("xb")  # follows no link, and opens no file that exists
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from error
        try:
            is_own = try_lock(file) is not False and beside.exists()
            file.seek(0)  # on Windows a lock moves the position
        except BaseException:
            file.close()
            beside.unlink(missing_ok=True)
            raise
        if is_own:
            return beside, file
        file.close()  # another program has taken it for left, and removes it


@lru_cache(maxsize=256)
def _remove_left(folder: Path) -> None:
    """Remove the incomplete files of killed programs in a folder; once for each folder.

    Theirs have a name of palpate, and no lock. Where there are no locks, all stay.
    """
    with suppress(OSError):
        for path in folder.glob(".*.palpate-*"):
            if _LEFT.fullmatch(path.name) and path.is_file() and not path.is_symlink():
                with suppress(OSError), path.open("r+b") as file:
                    if try_lock(file):
                        path.unlink()


def write_file(path: Path, data: bytes) -> None:
    """Write a file as a whole, with the errors of `replacing`."""
    with replacing(path) as file:
        file.write(data)


def _mode_of(path: Path) -> int | None:
    """Return the permissions of a file to replace; None if there is none, or it is a link."""
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
    """Write an open file from the memory of the system to the disk."""
    if sys.platform == "darwin":
        import fcntl

        with suppress(OSError):  # a file system without it
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    sync = getattr(os, "fdatasync", os.fsync) if data_only else os.fsync
    sync(descriptor)


def replace(path: Path, target: Path, system: str = sys.platform) -> None:
    """Rename a file to the name of another one, which it replaces in one step."""
    until = time.monotonic() + REPLACE_S
    while True:
        try:
            path.replace(target)
        except PermissionError as error:
            if system != "win32":
                raise
            if time.monotonic() > until:
                reason = "another program has it open, or it is read-only"
                advice = "close it there, or choose another name"
                raise PermissionError(errno.EACCES, f"{reason}: {advice}", str(target)) from error
            time.sleep(_AGAIN_S)
        else:
            return


def require_file_name(path: Path, system: str = sys.platform) -> None:
    """Refuse a name that is no file on Windows: data written there is lost, or not found again."""
    if system != "win32":
        return
    reason = ""
    if _DEVICE.match(path.name):
        reason = "is the name of a device on Windows"
    elif ":" in path.name:
        reason = "has a colon, which names a hidden part of a file on Windows"
    elif path.name.endswith((".", " ")):
        reason = "ends in a dot or a blank, which Windows leaves out"
    if reason:
        raise OSError(errno.EINVAL, f"{reason}: choose another name", str(path))
