"""Folders /sys and /dev with USB devices, for a process with the preload library of umockdev.

libusb finds the devices there; `usbfs_server` answers the requests to the node of a device.
"""

import math
import os
import shutil
import threading
from pathlib import Path

from palpate.ad7746.twin.kit import KitTwin
from usbfs_server import Node

# Device and configuration descriptors of a root hub.
_HUB = bytes.fromhex("12010002090001406b1d020000010302010109021900010100e0000904000001090000000705810304000c")


class Tree:
    """A folder with simulated boards.

    Parameters
    ----------
    root : pathlib.Path
        UMOCKDEV_DIR; a short path, since the path of a Unix socket has at most 108 bytes.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._plugged: dict[KitTwin, tuple[Node, int]] = {}
        self._address = 1
        for folder in ("sys/bus/usb/devices", "sys/class", "dev/bus/usb/001", "dev/.node", "ioctl/dev/bus/usb/001"):
            (root / folder).mkdir(parents=True, exist_ok=True)
        root.chmod(0o1777)  # libusb without privileges binds a socket here
        self._add_device("usb1", "usb1", 1, _HUB)
        (root / "dev/bus/usb/001/001").touch()

    def plug(self, kit: KitTwin, number: int) -> None:
        """Plug a board into a port of the hub."""
        self._address += 1
        node = Node(self._root, self._address, kit)
        self._plugged[kit] = node, number
        kit.on_unplug = lambda back_after_s: self.unplug(kit, back_after_s)
        kit.plugged()
        descriptors = kit.device_descriptor() + kit.configuration_descriptor()
        self._add_device(f"1-{number}", f"usb1/1-{number}", self._address, descriptors)

    def unplug(self, kit: KitTwin, back_after_s: float = math.inf) -> None:
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

    def node_of(self, kit: KitTwin) -> Path:
        """Return the device node of a board."""
        return self._plugged[kit][0].path

    def clear(self) -> None:
        """Unplug all boards."""
        for kit in list(self._plugged):
            self.unplug(kit)

    def _add_device(self, name: str, place: str, address: int, descriptors: bytes) -> None:
        node = f"bus/usb/001/{address:03d}"
        attributes = {
            "busnum": "1",
            "devnum": f"{address}",
            "idVendor": f"{int.from_bytes(descriptors[8:10], 'little'):04x}",
            "idProduct": f"{int.from_bytes(descriptors[10:12], 'little'):04x}",
            "speed": "480",
            "bConfigurationValue": "1",
            "uevent": f"MAJOR=189\nMINOR={address - 1}\nDEVNAME={node}\nDEVTYPE=usb_device\n"
            f"BUSNUM=001\nDEVNUM={address:03d}",
        }
        folder = self._root / "sys/devices" / place
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "descriptors").write_bytes(descriptors)
        for attribute, text in attributes.items():
            (folder / attribute).write_text(text + "\n")
        for link, target in (
            (folder / "subsystem", self._root / "sys/bus/usb"),
            (self._root / "sys/bus/usb/devices" / name, folder),
        ):
            link.unlink(missing_ok=True)
            link.symlink_to(os.path.relpath(target, link.parent))
        number = self._root / "dev/.node" / node.replace("/", "_")
        number.unlink(missing_ok=True)
        number.symlink_to(f"189:{address - 1}")
