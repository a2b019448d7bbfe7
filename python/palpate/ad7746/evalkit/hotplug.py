"""Boards that are plugged in and unplugged, noticed by a thread that opens none of them.

pyusb has no notice of its own, and without udev a context of libusb never sees a change. On Linux the names in sysfs are
compared, which costs 0.02 ms; on other systems the boards are searched for with a context of its own.
"""

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread, current_thread

from palpate.ad7746.evalkit.find import PRODUCT, VENDOR, Board, boards, fresh, system_backend
from palpate.errors import PalpateError

SYSFS = Path("/sys/bus/usb/devices")
POLL_S = 0.5
_END_S = 1.0
_KIT = f"{VENDOR:04x}", f"{PRODUCT:04x}"

Look = Callable[[], set[Board]]


class Hotplug:
    """Tells which boards come and go, from its begin to `close`.

    Parameters
    ----------
    changed : callable
        Called with the boards before and after a change, from a thread. An error that it raises is ignored.
    look : callable, optional
        Returns the connected boards. Default: `looking`, for this system.
    poll_s : float
        Time between two looks, s.

    Examples
    --------
    >>> import time
    >>> came, there = [], {Board(1, 2, (1,))}
    >>> watch = Hotplug(lambda before, now: came.extend(now - before), lambda: set(there), poll_s=0.001)
    >>> there.add(Board(1, 3, (2,)))
    >>> while not came:
    ...     time.sleep(0.001)
    >>> watch.close()
    >>> [str(board) for board in came]
    ['1/3']
    """

    def __init__(
        self, changed: Callable[[set[Board], set[Board]], object], look: Look | None = None, poll_s: float = POLL_S
    ) -> None:
        self._changed = changed
        self._look = look or looking()
        self._poll_s = poll_s
        self._closing = Event()
        self._known = self._look()
        self._thread = Thread(target=self._run, name="palpate-hotplug", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread; may be called twice, and from `changed`."""
        self._closing.set()
        if self._thread is not current_thread():
            self._thread.join(_END_S)

    def _run(self) -> None:
        while not self._closing.wait(self._poll_s):
            with suppress(OSError, PalpateError):  # the next look may succeed
                self._compare(self._look())

    def _compare(self, now: set[Board]) -> None:
        before, self._known = self._known, now
        if now != before:
            with suppress(Exception):  # the measurement goes on
                self._changed(before, now)


def looking(sysfs: Path = SYSFS) -> Look:
    """Return the cheapest way to look for boards on this system."""
    if sys.platform == "linux":
        return _Sysfs(sysfs).look
    context = fresh(system_backend())
    return lambda: set(boards(context))


class _Sysfs:
    """Looks through the devices in sysfs, and reads their files only if there is another device than before."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: set[tuple[str, int]] = set()
        self._boards: set[Board] = set()

    def look(self) -> set[Board]:
        if not self._folder.is_dir():  # a kernel without USB
            return set()
        with os.scandir(self._folder) as entries:
            names = {(entry.name, entry.inode()) for entry in entries}  # plugged in again: another inode
        if names != self._names:
            self._boards = {board for name, _ in names if (board := self._board(name))}
            self._names = names
        return self._boards

    def _board(self, name: str) -> Board | None:
        bus, dash, ports = name.partition("-")
        if not dash or ":" in ports:  # a hub's root, or an interface
            return None
        try:
            vendor, product, bus, address = (
                (self._folder / name / file).read_text(encoding="utf-8").strip()
                for file in ("idVendor", "idProduct", "busnum", "devnum")
            )
        except OSError:  # it has gone meanwhile
            return None
        if (vendor, product) != _KIT:
            return None
        return Board(int(bus), int(address), tuple(int(port) for port in ports.split(".")))
