"""Errors of pyusb, translated to palpate's: what happened, and what to do."""

import errno
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from palpate.errors import DeviceNotFound, DeviceRefused, MissingExtra, ProtocolError, SourceError, SourceTimeout

try:
    import usb.core
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("the evaluation kit needs pyusb: pip install 'palpate[usb]'") from _missing


class NotAllowed(DeviceRefused):
    """No permission, or not yet: after plugging in it may take a moment."""


class NoFirmware(DeviceRefused):
    """The board has no firmware, or not yet: another program may load it after plugging in."""


_DRIVER = "On Windows the board needs the driver WinUSB: install it for 0456:b481 with Zadig (https://zadig.akeo.ie)"
_PERMISSION = {
    "linux": "Type `palpate doctor --install-udev`; in a container, on the host",
    "win32": f"Close other programs that use the board. {_DRIVER}",
    "darwin": "On macOS another program or a driver holds it: close that program, then plug the board in again",
}
_NOT_SUPPORTED = {
    "win32": f"the driver of the board is not WinUSB. {_DRIVER}",
    "darwin": "libusb cannot open it; `brew install libusb`, for the processor that this Python is for",
}


@contextmanager
def translated(what: str, system: str = sys.platform) -> Iterator[None]:
    """Translate errors of pyusb to palpate's.

    Parameters
    ----------
    what : str
        The access, for the message.
    system : str
        As `sys.platform`: what to do depends on it.

    Raises
    ------
    SourceError
        The translated error.
    """
    try:
        yield
    except usb.core.USBTimeoutError as error:
        raise SourceTimeout(f"{what}: no answer in time; if it happens again, unplug the board for a moment") from error
    except usb.core.USBError as error:
        raise _translated(what, error, system) from error
    except NotImplementedError as error:
        told = _NOT_SUPPORTED.get(system, "the USB library of this system does not support it; install libusb-1.0")
        raise DeviceRefused(f"{what}: {told}") from error


def _translated(what: str, error: usb.core.USBError, system: str) -> SourceError:
    # On systems other than Linux libusb reports an unplugged device as ENOENT.
    match error.errno:
        case errno.ENODEV | errno.ENOENT:
            return DeviceNotFound(f"{what}: the board was unplugged: plug it in again.")
        case errno.EACCES | errno.EPERM:
            return NotAllowed(f"{what}: no permission to open it. {_PERMISSION.get(system, _PERMISSION['linux'])}")
        case errno.EBUSY:
            return DeviceRefused(f"{what}: another program uses the board; close that program first")
        case errno.EPIPE:
            return ProtocolError(
                f"{what}: the board refused the request (stall); check that the kit's own firmware is loaded"
            )
        case errno.EIO:
            return ProtocolError(f"{what}: error on the USB line; try another cable or port, without a hub")
        case errno.EOVERFLOW:
            return ProtocolError(f"{what}: the board sent more bytes than requested; try another cable or port")
        case _:
            return ProtocolError(f"{what}: {error}")
