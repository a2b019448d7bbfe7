"""Errors of pyusb, translated to palpate's: what happened, and what to do."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager

from palpate.errors import DeviceNotFound, DeviceRefused, MissingExtra, ProtocolError, SourceError, SourceTimeout

try:
    import usb.core
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("the evaluation kit needs pyusb: pip install 'palpate[usb]'") from _missing

UDEV_RULE = 'SUBSYSTEM=="usb", ATTR{idVendor}=="0456", ATTR{idProduct}=="b481", MODE="0666"'
"""Line for a file in /etc/udev/rules.d: lets every user open the board on Linux."""


class NotAllowed(DeviceRefused):
    """No permission, or not yet: after plugging in it may take a moment."""


class NoFirmware(DeviceRefused):
    """The board has no firmware, or not yet: another program may load it after plugging in."""


@contextmanager
def translated(what: str) -> Iterator[None]:
    """Translate errors of pyusb to palpate's.

    Parameters
    ----------
    what : str
        The access, for the message.

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
        raise _translated(what, error) from error
    except NotImplementedError as error:
        raise DeviceRefused(
            f"{what}: the USB library of this system does not support it; install libusb-1.0"
        ) from error


def _translated(what: str, error: usb.core.USBError) -> SourceError:
    # On systems other than Linux libusb reports an unplugged device as ENOENT.
    match error.errno:
        case errno.ENODEV | errno.ENOENT:
            return DeviceNotFound(f"{what}: the board was unplugged: plug it in again.")
        case errno.EACCES | errno.EPERM:
            return NotAllowed(
                f"{what}: no permission to open it. On Linux put this line into /etc/udev/rules.d/70-palpate.rules, "
                f"then plug the board in again: {UDEV_RULE}"
            )
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
