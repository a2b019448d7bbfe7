"""Carriers: they connect the simulated board to the driver. The same tests run with each of them.

PALPATE_CARRIER names it: "process" (a pyusb backend, virtual time, the default), or "usbfs" (the real libusb under umockdev's
preload library).
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from palpate.ad7746.bus import Clock, RealClock, VirtualClock
from palpate.ad7746.evalkit.find import fresh, system_backend
from palpate.ad7746.twin.kit import KitTwin
from palpate.ad7746.twin.usb import Port, TwinBackend

NOBODY = 65534


class ProcessCarrier:
    """Carrier without libusb, with a virtual clock."""

    real = False

    def __init__(self) -> None:
        self.clock: Clock = VirtualClock()
        self._backend = TwinBackend(self.clock)
        self._ports: dict[KitTwin, Port] = {}

    def plug(self, kit: KitTwin, number: int = 1) -> None:
        """Plug a board into a port."""
        self._ports[kit] = self._backend.plug(kit, number)

    def unplug(self, kit: KitTwin) -> None:
        self._backend.unplug(self._ports[kit])

    def backend(self) -> TwinBackend:
        """Return a pyusb backend that finds the boards that are plugged in now."""
        return self._backend

    @contextmanager
    def denied(self, kit: KitTwin) -> Iterator[None]:
        """Return a context without permission to open a board."""
        self._ports[kit].allowed = False
        yield
        self._ports[kit].allowed = True

    def close(self) -> None:
        assert self._backend.opened == 0, "a handle was not closed"


class UsbfsCarrier:
    """Carrier with the real libusb, in real time."""

    real = True

    def __init__(self) -> None:
        self.clock: Clock = RealClock()
        tree = _tree()
        self.plug, self.unplug, self.close, self._node_of = tree.plug, tree.unplug, tree.clear, tree.node_of

    def backend(self) -> Any:
        return fresh(system_backend())

    @contextmanager
    def denied(self, kit: KitTwin) -> Iterator[None]:
        self._node_of(kit).chmod(0)
        privileged = os.geteuid() == 0
        if privileged:
            os.seteuid(NOBODY)
        yield
        if privileged:
            os.seteuid(0)
        self._node_of(kit).chmod(0o666)


@cache
def _tree() -> Any:
    from usbfs import Tree

    return Tree(Path(os.environ["UMOCKDEV_DIR"]))


Carrier = ProcessCarrier | UsbfsCarrier


def carrier() -> Carrier:
    """Return the carrier that PALPATE_CARRIER names."""
    return UsbfsCarrier() if os.environ.get("PALPATE_CARRIER") == "usbfs" else ProcessCarrier()
