"""Server for the preload library of umockdev: usbdevfs of Linux for one device node, with a simulated board.

The library sends each ioctl on the node to a Unix socket, and the server can read and write the memory of the caller
meanwhile. Its format is that of libumockdev-preload.c, "struct ioctl_request": three 64-bit numbers.
"""

import contextlib
import errno
import fcntl
import os
import select
import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from palpate.ad7746.twin.kit import KitTwin, Reply

_IOCTL, _RESULT, _READ, _WRITE = 1, 3, 5, 6
_URB = struct.Struct("<BBxxiIxxxxQiiiiiIQ")  # struct usbdevfs_urb
_CONTROL_URB = 2
_STATUS_AT, _LENGTH_AT = 4, 28
# ZERO_PACKET, BULK_CONTINUATION, NO_PACKET_SIZE_LIM, BULK_SCATTER_GATHER, REAP_AFTER_DISCONNECT
_CAPABILITIES = 0x1F
_SET_PIPE_SIZE = 1031  # F_SETPIPE_SZ
Result = tuple[int, int]
_DONE: Result = (0, 0)


class Node:
    """A device node: a socket, and a FIFO that is kept full, so that POLLOUT for libusb means the end of a transfer.

    Parameters
    ----------
    root : pathlib.Path
        UMOCKDEV_DIR.
    address : int
    kit : KitTwin
    """

    def __init__(self, root: Path, address: int, kit: KitTwin) -> None:
        self.address = address
        self.path = root / f"dev/bus/usb/001/{address:03d}"
        self.kit = kit
        self.attached = True
        self.lock = threading.RLock()
        self.claims: dict[int, object] = {}
        self._awake = False
        os.mkfifo(self.path)
        self.path.chmod(0o666)
        self._fifo = os.open(self.path, os.O_RDWR | os.O_NONBLOCK)
        fcntl.fcntl(self._fifo, _SET_PIPE_SIZE, 4096)
        os.write(self._fifo, b"x")
        where = root / f"ioctl/dev/bus/usb/001/{address:03d}"
        self._listening = socket.socket(socket.AF_UNIX)
        self._listening.bind(str(where))
        where.chmod(0o777)
        self._listening.listen()
        threading.Thread(target=self._accept, daemon=True).start()

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

    def _accept(self) -> None:
        while True:
            caller, _ = self._listening.accept()
            threading.Thread(target=_Caller(self, caller).run, daemon=True).start()


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


class _Caller:
    """One file descriptor of the process under test."""

    def __init__(self, node: Node, connection: socket.socket) -> None:
        self._node = node
        self._socket = connection
        self._flying: list[_Flying] = []
        self._answers: dict[int, Callable[[int], Result]] = {
            0x8038550A: self._submit,
            0x4008550D: self._reap,
            0x550B: self._discard,
            0x8004550F: self._claim,
            0x80045510: self._release,
            0x8004551A: self._capabilities,
        }

    def run(self) -> None:
        with contextlib.suppress(EOFError, OSError):
            while True:
                self._wake_in_time()
                what, request, argument = struct.unpack("<QQQ", self._receive(24))
                result = self._answer(request, argument) if what == _IOCTL else (-1, errno.EINVAL)
                self._socket.sendall(struct.pack("<Qqq", _RESULT, *result))
        self._socket.close()
        with self._node.lock:
            self._node.claims = {k: v for k, v in self._node.claims.items() if v is not self}

    def _wake_in_time(self) -> None:
        """Wait for the next request, or for the end of a transfer that the caller waits for."""
        due = min((flying.due for flying in self._flying), default=float("inf"))
        if due == float("inf"):
            return
        readable, _, _ = select.select([self._socket], [], [], max(due - time.monotonic(), 0))
        if not readable:
            self._node.wake()

    def _answer(self, request: int, argument: int) -> Result:
        with self._node.lock:
            answer = self._answers.get(request)
            if answer is None:
                return -1, errno.ENOTTY
            if not self._node.attached and answer not in (self._reap, self._discard):
                return -1, errno.ENODEV
            return answer(argument)

    def _receive(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            piece = self._socket.recv(count - len(data))
            if not piece:
                raise EOFError
            data += piece
        return data

    def _peek(self, address: int, count: int) -> bytes:
        self._socket.sendall(struct.pack("<QQQ", _READ, address, count))
        return self._receive(count)

    def _poke(self, address: int, data: bytes) -> Result:
        if data:
            self._socket.sendall(struct.pack("<QQQ", _WRITE, address, len(data)) + data)
        return _DONE

    def _capabilities(self, argument: int) -> Result:
        return self._poke(argument, struct.pack("<I", _CAPABILITIES))

    def _claim(self, argument: int) -> Result:
        number = int.from_bytes(self._peek(argument, 4), "little")
        return _DONE if self._node.claims.setdefault(number, self) is self else (-1, errno.EBUSY)

    def _release(self, argument: int) -> Result:
        number = int.from_bytes(self._peek(argument, 4), "little")
        if self._node.claims.get(number) is not self:
            return -1, errno.EINVAL
        del self._node.claims[number]
        return _DONE

    def _submit(self, argument: int) -> Result:
        transfer, _, _, _, buffer, length, *_ = _URB.unpack(self._peek(argument, _URB.size))
        if transfer != _CONTROL_URB:
            return -1, errno.EINVAL
        raw = self._peek(buffer, length)
        kind, request, value, index, count = struct.unpack("<BBHHH", raw[:8])
        to_host = bool(kind & 0x80)
        began = time.monotonic()
        reply = self._node.kit.control(kind, request, value, index, count, b"" if to_host else raw[8:])
        due = float("inf") if reply.lasting_ns is None else began + reply.lasting_ns / 1e9
        self._flying.append(_Flying(due, argument, buffer, to_host, reply))
        return _DONE

    def _reap(self, argument: int) -> Result:
        if not self._node.attached:
            for flying in self._flying:
                flying.end(flying.reply.error or errno.ESHUTDOWN)
        for flying in self._flying:
            if flying.due <= time.monotonic():
                self._flying.remove(flying)
                return self._give(flying, argument)
        if not self._node.attached:
            return -1, errno.ENODEV
        self._node.wake(False)
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
                self._node.wake()
                return _DONE
        return -1, errno.EINVAL
