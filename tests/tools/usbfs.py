"""USB devices for a process with the preload library of umockdev: folders /sys and /dev, and usbdevfs of Linux.

libusb finds the devices in the folders. The library sends each ioctl on a device node to a Unix socket, and the server
can read and write the memory of the caller meanwhile. Its format is that of libumockdev-preload.c, "struct
ioctl_request": three 64-bit numbers.
"""

import errno
import fcntl
import math
import os
import select
import shutil
import socketserver
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.ad7746.bus import Clock, RealClock
from palpate.ad7746.evalkit.discovery import PRODUCT, VENDOR, new_context, system_backend
from palpate.ad7746.simulator.evalboard import Reply, SimulatedBoard

_IOCTL = 1
_RESULT = 3
_READ = 5
_WRITE = 6
_URB = struct.Struct("<BBxxiIxxxxQiiiiiIQ")  # struct usbdevfs_urb
_CONTROL_URB = 2
_STATUS_AT = 4
_LENGTH_AT = 28
# ZERO_PACKET, BULK_CONTINUATION, NO_PACKET_SIZE_LIM, BULK_SCATTER_GATHER, REAP_AFTER_DISCONNECT
_CAPABILITIES = 0x1F
Result = tuple[int, int]
_DONE: Result = (0, 0)
# Device and configuration descriptors of a root hub; of the board, which has no strings, and one interface.
_HUB = bytes.fromhex(
    "12010002090001406b1d020000010302010109021900010100e0000904000001090000000705810304000c"
)
_BOARD = struct.pack(
    "<BBHBBBBHHHBBBB", 18, 1, 0x0200, 0xFF, 0xFF, 0xFF, 64, VENDOR, PRODUCT, 0, 0, 0, 0, 1
)
_BOARD += struct.pack("<BBHBBBBB", 9, 2, 18, 1, 1, 0, 0x80, 50) + struct.pack(
    "<9B", 9, 4, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0
)


class Node(socketserver.ThreadingUnixStreamServer):
    """A device node: a socket, and a FIFO that is kept full, so that POLLOUT for libusb means the end of a transfer."""

    daemon_threads = True

    def __init__(self, root: Path, address: int, kit: SimulatedBoard) -> None:
        self.address = address
        self.kit = kit
        self.path = root / f"dev/bus/usb/001/{address:03d}"
        self.attached = True
        self.lock = threading.RLock()
        self.claimed_by: object = None
        self._awake = False
        os.mkfifo(self.path)
        self.path.chmod(0o666)
        self._fifo = os.open(self.path, os.O_RDWR | os.O_NONBLOCK)
        fcntl.fcntl(self._fifo, fcntl.F_SETPIPE_SZ, 4096)
        os.write(self._fifo, b"x")
        where = root / f"ioctl/dev/bus/usb/001/{address:03d}"
        super().__init__(str(where), _Caller)
        where.chmod(0o777)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def wake(self, on: bool = True) -> None:
        """Switch POLLOUT on or off."""
        with self.lock:
            if on and not self._awake:
                os.read(self._fifo, 1)
            elif self._awake and not on:
                os.write(self._fifo, b"x")
            self._awake = on

    def unplug(self) -> None:
        """Unplug the device; running transfers end."""
        with self.lock:
            self.path.unlink()
            self.attached = False
            self.wake()


@dataclass
class _Flying:
    """A transfer that was submitted and not yet reaped."""

    due: float
    urb: int
    buffer: int
    to_host: bool
    reply: Reply

    def end(self, error: int) -> None:
        self.due, self.reply = 0.0, Reply(error=error)


class _Caller(socketserver.StreamRequestHandler):
    """One file descriptor of the process under test."""

    server: Node

    def handle(self) -> None:
        self._flying: list[_Flying] = []
        self._answers: dict[int, Callable[[int], Result]] = {
            0x8038550A: self._submit,
            0x4008550D: self._reap,
            0x550B: self._discard,
            0x8004550F: self._claim,
            0x80045510: self._release,
            0x8004551A: lambda argument: self._poke(argument, struct.pack("<I", _CAPABILITIES)),
        }
        try:
            while len(request := self._next()) == 24:
                what, number, argument = struct.unpack("<QQQ", request)
                result = self._answer(number, argument) if what == _IOCTL else (-1, errno.EINVAL)
                self.wfile.write(struct.pack("<Qqq", _RESULT, *result))
        except OSError:
            pass
        self._release(0)

    def _next(self) -> bytes:
        """Wait for the next request; wake the caller at the end of a transfer that it waits for."""
        due = min((flying.due for flying in self._flying), default=math.inf)
        if (
            due < math.inf
            and not select.select([self.request], [], [], max(due - time.monotonic(), 0))[0]
        ):
            self.server.wake()
        return self.rfile.read(24)

    def _answer(self, number: int, argument: int) -> Result:
        with self.server.lock:
            answer = self._answers.get(number)
            if answer is None:
                return -1, errno.ENOTTY
            if not self.server.attached and answer not in (self._reap, self._discard):
                return -1, errno.ENODEV
            return answer(argument)

    def _peek(self, address: int, count: int) -> bytes:
        self.wfile.write(struct.pack("<QQQ", _READ, address, count))
        return self.rfile.read(count)

    def _poke(self, address: int, data: bytes) -> Result:
        if data:
            self.wfile.write(struct.pack("<QQQ", _WRITE, address, len(data)) + data)
        return _DONE

    def _claim(self, _: int) -> Result:
        if self.server.claimed_by not in (None, self):
            return -1, errno.EBUSY
        self.server.claimed_by = self
        return _DONE

    def _release(self, _: int) -> Result:
        if self.server.claimed_by is self:
            self.server.claimed_by = None
        return _DONE

    def _submit(self, argument: int) -> Result:
        transfer, _, _, _, buffer, length, *_ = _URB.unpack(self._peek(argument, _URB.size))
        if transfer != _CONTROL_URB:
            return -1, errno.EINVAL
        raw = self._peek(buffer, length)
        kind, request, value, index, count = struct.unpack("<BBHHH", raw[:8])
        to_host = bool(kind & 0x80)
        began = time.monotonic()
        reply = self.server.kit.control(
            kind, request, value, index, count, b"" if to_host else raw[8:]
        )
        self._flying.append(
            _Flying(began + reply.lasting_ns / 1e9, argument, buffer, to_host, reply)
        )
        return _DONE

    def _reap(self, argument: int) -> Result:
        for flying in self._flying:
            if not self.server.attached:
                flying.end(flying.reply.error or errno.ESHUTDOWN)
            if flying.due <= time.monotonic():
                self._flying.remove(flying)
                return self._give(flying, argument)
        if not self.server.attached:
            return -1, errno.ENODEV
        self.server.wake(False)
        return -1, errno.EAGAIN

    def _give(self, flying: _Flying, argument: int) -> Result:
        reply = flying.reply
        data = reply.data if flying.to_host and not reply.error else b""
        count = len(data) if flying.to_host else reply.taken
        self._poke(flying.buffer + 8, data)
        self._poke(flying.urb + _STATUS_AT, struct.pack("<i", -reply.error))
        self._poke(flying.urb + _LENGTH_AT, struct.pack("<i", 0 if reply.error else count))
        return self._poke(argument, struct.pack("<Q", flying.urb))

    def _discard(self, argument: int) -> Result:
        for flying in self._flying:
            if flying.urb == argument:
                flying.end(errno.ENOENT)
                self.server.wake()
                return _DONE
        return -1, errno.EINVAL


class UsbfsCarrier:
    """Carrier with the real libusb, in real time: boards in UMOCKDEV_DIR, a short path, since a socket's has at most 108 bytes."""

    real = True

    def __init__(self) -> None:
        self.clock: Clock = RealClock()
        self._root = root = Path(os.environ["UMOCKDEV_DIR"])
        self._plugged: dict[SimulatedBoard, tuple[Node, int]] = {}
        self._address = 1
        for folder in (
            "sys/bus/usb/devices",
            "sys/class",
            "dev/bus/usb/001",
            "dev/.node",
            "ioctl/dev/bus/usb/001",
        ):
            (root / folder).mkdir(parents=True, exist_ok=True)
        root.chmod(0o1777)  # libusb without privileges binds a socket here
        self._add_device("usb1", "usb1", 1, _HUB)
        (root / "dev/bus/usb/001/001").touch()

    def backend(self) -> Any:
        """Return a pyusb backend that finds the boards that are plugged in now."""
        return new_context(system_backend())

    def plug(self, kit: SimulatedBoard, number: int = 1) -> None:
        """Plug a board into a port of the hub."""
        self._address += 1
        self._plugged[kit] = Node(self._root, self._address, kit), number
        kit.plugged(lambda back_after_s: self.unplug(kit, back_after_s))
        self._add_device(f"1-{number}", f"usb1/1-{number}", self._address, _BOARD)

    def unplug(self, kit: SimulatedBoard, back_after_s: float = math.inf) -> None:
        """Unplug a board, and plug it in again later."""
        if kit not in self._plugged:
            return
        node, number = self._plugged.pop(kit)
        (self._root / f"sys/bus/usb/devices/1-{number}").unlink()
        shutil.rmtree(self._root / f"sys/devices/usb1/1-{number}")
        (self._root / f"dev/.node/bus_usb_001_{node.address:03d}").unlink()
        node.unplug()
        if math.isfinite(back_after_s):
            threading.Timer(back_after_s, self.plug, (kit, number)).start()

    @contextmanager
    def denied(self, kit: SimulatedBoard) -> Iterator[None]:
        """Return a context without permission to open a board."""
        node = self._plugged[kit][0].path
        privileged = os.geteuid() == 0
        node.chmod(0)
        if privileged:
            os.seteuid(65534)  # nobody
        yield
        if privileged:
            os.seteuid(0)
        node.chmod(0o666)

    def close(self) -> None:
        """Unplug all boards."""
        for kit in list(self._plugged):
            self.unplug(kit)

    def _add_device(self, name: str, place: str, address: int, descriptors: bytes) -> None:
        node = f"bus/usb/001/{address:03d}"
        vendor, product = struct.unpack("<HH", descriptors[8:12])
        attributes = {
            "busnum": "1",
            "devnum": f"{address}",
            "speed": "480",
            "bConfigurationValue": "1",
        }
        attributes |= {"idVendor": f"{vendor:04x}", "idProduct": f"{product:04x}"}
        attributes["uevent"] = (
            f"MAJOR=189\nMINOR={address - 1}\nDEVNAME={node}\nDEVTYPE=usb_device\n"
        )
        attributes["uevent"] += f"BUSNUM=001\nDEVNUM={address:03d}"
        folder = self._root / "sys/devices" / place
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "descriptors").write_bytes(descriptors)
        for attribute, text in attributes.items():
            (folder / attribute).write_text(text + "\n")
        for link, target in (
            (folder / "subsystem", os.path.relpath(self._root / "sys/bus/usb", folder)),
            (self._root / "sys/bus/usb/devices" / name, f"../../../devices/{place}"),
            (self._root / "dev/.node" / node.replace("/", "_"), f"189:{address - 1}"),
        ):
            link.unlink(missing_ok=True)
            link.symlink_to(target)
