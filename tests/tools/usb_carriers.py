"""Carriers: they connect the simulated board to the driver. The same tests run with each of them.

PALPATE_CARRIER names it: "process" (a pyusb backend, virtual time, the default), "usbfs" (the real libusb under umockdev's
preload library), "vhci" (a real Linux kernel, see tests/tools/usb_guest).
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from palpate.ad7746.clock import Clock, RealClock, VirtualClock
from palpate.ad7746.evalkit.find import fresh, system_backend
from palpate.ad7746.twin.kit import KitTwin
from palpate.ad7746.twin.usb import Port, TwinBackend

NOBODY = 65534


class Carrier(Protocol):
    """USB ports for simulated boards, with a real or virtual clock."""

    real: bool
    timely: bool
    """Whether it is fast enough for the sampling rate of the kit."""
    clock: Clock

    def plug(self, kit: KitTwin, number: int = 1) -> None:
        """Plug a board into a port."""
        ...

    def unplug(self, kit: KitTwin) -> None:
        """Unplug a board."""
        ...

    def backend(self) -> Any:
        """Return a pyusb backend that finds the boards that are plugged in now."""
        ...

    def denied(self, kit: KitTwin) -> Any:
        """Return a context without permission to open a board."""
        ...

    def close(self) -> None:
        """Unplug all boards."""
        ...


class ProcessCarrier:
    """Carrier without libusb, with a virtual clock."""

    real = False
    timely = True

    def __init__(self) -> None:
        self.clock: Clock = VirtualClock()
        self._backend = TwinBackend(self.clock)
        self._ports: dict[KitTwin, Port] = {}

    def plug(self, kit: KitTwin, number: int = 1) -> None:
        self._ports[kit] = self._backend.plug(kit, number)

    def unplug(self, kit: KitTwin) -> None:
        self._backend.unplug(self._ports[kit])

    def backend(self) -> TwinBackend:
        return self._backend

    @contextmanager
    def denied(self, kit: KitTwin) -> Iterator[None]:
        self._ports[kit].allowed = False
        yield
        self._ports[kit].allowed = True

    def close(self) -> None:
        assert self._backend.opened == 0, "a handle was not closed"


class UsbfsCarrier:
    """Carrier with the real libusb, in real time."""

    real = timely = True

    def __init__(self) -> None:
        self.clock: Clock = RealClock()
        self._tree = _tree()

    def plug(self, kit: KitTwin, number: int = 1) -> None:
        self._tree.plug(kit, number)

    def unplug(self, kit: KitTwin) -> None:
        self._tree.unplug(kit)

    def backend(self) -> Any:
        return fresh(system_backend())

    @contextmanager
    def denied(self, kit: KitTwin) -> Iterator[None]:
        self._tree.node_of(kit).chmod(0)
        privileged = os.geteuid() == 0
        if privileged:
            os.seteuid(NOBODY)
        yield
        if privileged:
            os.seteuid(0)
        self._tree.node_of(kit).chmod(0o666)

    def close(self) -> None:
        self._tree.clear()


@cache
def _tree() -> Any:
    from usbfs_tree import Tree

    return Tree(Path(os.environ["UMOCKDEV_DIR"]))


def carrier() -> Carrier:
    """Return the carrier that PALPATE_CARRIER names."""
    name = os.environ.get("PALPATE_CARRIER", "process")
    if name == "process":
        return ProcessCarrier()
    if name == "usbfs":
        return UsbfsCarrier()
    from usb_vhci import VhciCarrier

    return VhciCarrier()
