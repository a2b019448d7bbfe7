"""Simulated boards on a real Linux kernel: vhci_hcd, over a socket pair with the USB/IP protocol.

Needs root and the modules usbip-core and vhci-hcd; `usb_guest/run` starts a guest that has both.
"""

import contextlib
import errno
import math
import os
import select
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.ad7746.clock import Clock, RealClock
from palpate.ad7746.evalkit.find import boards, fresh, system_backend
from palpate.ad7746.twin.kit import KitTwin, Reply
from usb_carriers import NOBODY

_VHCI = Path("/sys/devices/platform/vhci_hcd.0")
_HEADER = struct.Struct(">IIIII")  # command, sequence number, device, direction, endpoint
_HEADER_BYTES = 48
_SUBMIT, _UNLINK, _SUBMITTED, _UNLINKED = 1, 2, 3, 4
_HIGH_SPEED = 3
_FREE = "004"
_LIMIT_S = 30.0


@dataclass
class _Pending:
    due: float
    to_host: bool
    reply: Reply


class _Cable:
    """A board that is plugged in: a thread that answers the kernel."""

    def __init__(self, kit: KitTwin, port: int) -> None:
        self.kit = kit
        self.port = port
        self._pending: dict[int, _Pending] = {}
        self._socket, kernels = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        threading.Thread(target=self._serve, daemon=True).start()
        (_VHCI / "attach").write_text(f"{port} {kernels.fileno()} {0x10001 + port} {_HIGH_SPEED}")
        kernels.close()

    def pull(self) -> None:
        """Unplug the board."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def _serve(self) -> None:
        with contextlib.suppress(EOFError, OSError), self._socket:
            while True:
                due = min((pending.due for pending in self._pending.values()), default=math.inf)
                wait = None if due == math.inf else max(due - time.monotonic(), 0)
                readable, _, _ = select.select([self._socket], [], [], wait)
                if readable:
                    self._take()
                self._give()

    def _take(self) -> None:
        header = self._receive(_HEADER_BYTES)
        command, number, _, to_host, endpoint = _HEADER.unpack(header[:20])
        if command == _UNLINK:
            (target,) = struct.unpack(">I", header[20:24])
            known = self._pending.pop(target, None)
            self._send(_UNLINKED, number, struct.pack(">i24x", -errno.ECONNRESET if known else 0))
            return
        (count,) = struct.unpack(">i", header[24:28])
        data = self._receive(count) if not to_host else b""
        reply = Reply(lasting_ns=None) if endpoint else self._control(header[40:], data)
        due = math.inf if reply.lasting_ns is None else time.monotonic() + reply.lasting_ns / 1e9
        self._pending[number] = _Pending(due, bool(to_host), reply)

    def _control(self, setup: bytes, data: bytes) -> Reply:
        kind, request, value, index, length = struct.unpack("<BBHHH", setup)
        if kind & 0x60:
            return self.kit.control(kind, request, value, index, length, data)
        return _standard(self.kit, request, value, length)

    def _give(self) -> None:
        now = time.monotonic()
        for number in [number for number, pending in self._pending.items() if pending.due <= now]:
            pending = self._pending.pop(number)
            data = pending.reply.data if pending.to_host and not pending.reply.error else b""
            count = len(data) if pending.to_host else pending.reply.taken
            body = struct.pack(">iiiii8x", -pending.reply.error, 0 if pending.reply.error else count, 0, 0, 0)
            self._send(_SUBMITTED, number, body + data)

    def _send(self, command: int, number: int, body: bytes) -> None:
        self._socket.sendall(_HEADER.pack(command, number, 0, 0, 0) + body)

    def _receive(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            piece = self._socket.recv(count - len(data))
            if not piece:
                raise EOFError
            data += piece
        return data


def _standard(kit: KitTwin, request: int, value: int, length: int) -> Reply:
    """Answer a standard request, as every USB device."""
    get_status, get_descriptor, get_configuration = 0, 6, 8
    descriptors = {1: kit.device_descriptor, 2: kit.configuration_descriptor}
    if request == get_descriptor:
        describe = descriptors.get(value >> 8)
        return Reply(describe()[:length]) if describe else Reply(error=errno.EPIPE)
    return Reply({get_status: b"\0\0", get_configuration: b"\1"}.get(request, b"")[:length])


class VhciCarrier:
    """Carrier with a real kernel and the real libusb, in real time, on an emulated processor."""

    real = True
    timely = False

    def __init__(self) -> None:
        self.clock: Clock = RealClock()
        self._cables: dict[KitTwin, _Cable] = {}

    def plug(self, kit: KitTwin, number: int = 1) -> None:
        self._plug(kit, number)
        _wait_until(lambda: len(boards(self.backend())) == len(self._cables))

    def _plug(self, kit: KitTwin, number: int) -> None:
        kit.on_unplug = lambda back_after_s: self.unplug(kit, back_after_s)
        kit.plugged()
        _wait_until(lambda: _is_free(number - 1))
        self._cables[kit] = _Cable(kit, number - 1)

    def unplug(self, kit: KitTwin, back_after_s: float = math.inf) -> None:
        cable = self._cables.pop(kit, None)
        if cable is None:
            return
        cable.pull()
        if math.isfinite(back_after_s):
            threading.Timer(back_after_s, self._plug, (kit, cable.port + 1)).start()

    def backend(self) -> Any:
        return fresh(system_backend())

    @contextmanager
    def denied(self, kit: KitTwin) -> Iterator[None]:
        [board] = boards(self.backend())
        node = Path(f"/dev/bus/usb/{board.bus:03d}/{board.address:03d}")
        node.chmod(0)
        os.seteuid(NOBODY)
        yield
        os.seteuid(0)
        node.chmod(0o666)

    def close(self) -> None:
        for kit in list(self._cables):
            self.unplug(kit)
        _wait_until(lambda: not boards(self.backend()))


def _is_free(port: int) -> bool:
    """Return whether the kernel has released a port. Each line: "hub port sta spd dev sockfd local_busid"."""
    for line in (_VHCI / "status").read_text().splitlines()[1:]:
        hub, number, state, *_ = line.split()
        if hub == "hs" and int(number) == port:
            return state == _FREE
    raise LookupError(port)


def _wait_until(condition: Any) -> None:
    deadline = time.monotonic() + _LIMIT_S
    while not condition():
        assert time.monotonic() < deadline, "the kernel did not follow"
        time.sleep(0.01)
