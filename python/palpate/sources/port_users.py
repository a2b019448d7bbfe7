"""Other programs that have a device open: of two that read a port each gets a part of the lines."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from palpate.errors import DeviceRefused, ProtocolError
from palpate.source_events import (
    Gap,
    GapCause,
    SourceEvent,
    TroubleBegan,
    TroubleEnded,
    TroubleKind,
)

_LOOK_NS = 5 * 10**9  # to look for other programs takes some ms
_PROC = Path("/proc")
_PTY = "/dev/pts/"
_ACCESS_BITS = 0o3  # of the flags of an open file
_PTY_MASTER = "/ptmx"


class PortUser(NamedTuple):
    """A program that has a device open.

    Attributes
    ----------
    pid : int
    name : str
        Name of the program.
    """

    pid: int
    name: str

    def __str__(self) -> str:
        """Return name and number, for a message."""
        return f"{self.name}, process {self.pid}"


def joined(users: list[PortUser]) -> str:
    """Return programs for a message."""
    return " and ".join(map(str, users))


def port_readers(port: str, proc: Path = _PROC) -> list[PortUser]:
    """Return the other programs of this user that can read a device; Linux only, else none.

    A program that began this one is left out: it may hold the port for it.

    Parameters
    ----------
    port : str
        Name of the device, or a link to it.
    proc : pathlib.Path
        The folder of the processes.
    """
    if sys.platform != "linux":
        return []
    device = os.path.realpath(port)
    own = set(_family(os.getpid(), proc))
    users = []
    for folder in sorted(proc.glob("[0-9]*")):
        pid = int(folder.name)
        if pid not in own and _reads(folder, device):
            users.append(PortUser(pid, _name(folder)))
    return users


def _family(pid: int, proc: Path) -> Iterator[int]:
    """Yield a process, and those that began it."""
    while pid > 0:
        yield pid
        try:
            stat = (proc / str(pid) / "stat").read_text(errors="replace")
            pid = int(stat.rpartition(")")[2].split()[1])  # the name may have any character
        except (OSError, ValueError, IndexError):
            return


def _reads(folder: Path, device: str) -> bool:
    """Return whether a process has a device open, and not for writing only."""
    is_reader = False
    with suppress(OSError):  # of another user, or it has ended
        for descriptor in os.listdir(folder / "fd"):  # noqa: PTH208  names, not paths
            with suppress(OSError, ValueError):
                opened = os.readlink(folder / "fd" / descriptor)  # noqa: PTH115  as it is
                if device.startswith(_PTY) and opened.endswith(_PTY_MASTER):
                    return False  # it is the device: it has the other end of a pseudo-terminal
                if opened == device:
                    is_reader |= _access(folder / "fdinfo" / descriptor) != os.O_WRONLY
    return is_reader


def _access(info: Path) -> int:
    """Return how a file is open: os.O_RDONLY, O_WRONLY or O_RDWR."""
    for line in info.read_text().splitlines():
        name, _, value = line.partition(":")
        if name == "flags":
            return int(value, 8) & _ACCESS_BITS
    return os.O_RDONLY


def _name(folder: Path) -> str:
    with suppress(OSError):
        return (folder / "comm").read_text(errors="replace").strip()
    return "a program"


def refused_as_shared(port: str) -> DeviceRefused:
    """Return the error for a port that another program reads."""
    users = port_readers(port)
    who = f" ({joined(users)})" if users else ""
    return DeviceRefused(
        f"{port}: another program reads it{who}, and each would get a part of the lines: close that "
        "program"
    )


def require_no_reader(port: str) -> None:
    """Raise DeviceRefused if another program reads a port."""
    if port_readers(port):
        raise refused_as_shared(port)


class Sharing:
    """Another program that reads the port, too; it is looked for when something is wrong."""

    def __init__(self, port: str) -> None:
        self.is_due = False  # something is wrong
        self._port = port
        self._look_ns = 0
        self._users: list[PortUser] = []
        self._ever: list[PortUser] = []
        self._is_reported = False

    def is_found(self) -> bool:
        """Look for other programs now; return whether there is one."""
        self._users = port_readers(self._port)
        self._ever = self._users or self._ever
        return bool(self._users)

    def changes(self, notify: Callable[[str], None], now_ns: int) -> Iterator[SourceEvent]:
        """Yield trouble and gap if another program has begun to read, and the end of the trouble."""
        if now_ns >= self._look_ns and (self.is_due or self._is_reported):
            self.is_due = False
            self._look_ns = now_ns + _LOOK_NS
            self.is_found()
        if bool(self._users) == self._is_reported:
            return
        self._is_reported = bool(self._users)
        if not self._users:
            yield TroubleEnded(TroubleKind.SHARED)
            yield Gap(GapCause.SHARED, f"no other program reads {self._port} any more")
            return
        text = (
            f"another program reads {self._port} ({joined(self._users)}): lines are lost, and "
            "values may be wrong"
        )
        notify(f"{text}: close that program")
        yield TroubleBegan(TroubleKind.SHARED, f"{text}: close that program")
        yield Gap(GapCause.SHARED, text)

    def require_none(self, errors: int) -> None:
        """Raise ProtocolError if another program has read the port; `errors`: lines not read."""
        if self._ever:
            raise ProtocolError(
                f"{self._port}: another program read it, too ({joined(self._ever)}): {errors:,} lines "
                "were not read, more may be lost, and values may be wrong: close that program, and "
                "measure again"
            )
