"""What pyusb raises, in palpate's words: what happened, and what to do."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager

from palpate.errors import DeviceNotFound, DeviceRefused, MissingExtra, ProtocolError, SourceError, SourceTimeout

try:
    import usb.core
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("the evaluation kit needs pyusb: pip install 'palpate[usb]'") from _missing

UDEV_RULE = 'SUBSYSTEM=="usb", ATTR{idVendor}=="0456", ATTR{idProduct}=="b481", MODE="0666"'
"""What a Linux system needs in /etc/udev/rules.d for a user to open the board."""


class NotAllowed(DeviceRefused):
    """No permission, or not yet: right after a plug it may take a moment."""


@contextmanager
def translated(what: str) -> Iterator[None]:
    """Raise palpate's errors for pyusb's.

    Parameters
    ----------
    what : str
        What was being done, for the text.
    """
    try:
        yield
    except usb.core.USBTimeoutError as error:
        raise SourceTimeout(
            f"{what}: no answer within the time allowed; if it happens again, unplug the board for a moment"
        ) from error
    except usb.core.USBError as error:
        raise _translated(what, error) from error
    except NotImplementedError as error:
        raise DeviceRefused(f"{what}: this system's USB library cannot do it; install libusb-1.0") from error


def _translated(what: str, error: usb.core.USBError) -> SourceError:
    # ENOENT is what libusb says of a device that vanished on systems other than Linux.
    match error.errno:
        case errno.ENODEV | errno.ENOENT:
            return DeviceNotFound(f"{what}: the board was unplugged: plug it in again.")
        case errno.EACCES | errno.EPERM:
            return NotAllowed(
                f"{what}: no permission to open it. On Linux put this line into /etc/udev/rules.d/70-palpate.rules, "
                f"then plug the board in again: {UDEV_RULE}"
            )
        case errno.EBUSY:
            return DeviceRefused(f"{what}: another program uses it; close that one first")
        case errno.EPIPE:
            return ProtocolError(f"{what}: the board refused it (stall); is it the kit's own firmware that runs?")
        case errno.EIO:
            return ProtocolError(f"{what}: error on the USB line; try another cable or port, without a hub")
        case errno.EOVERFLOW:
            return ProtocolError(f"{what}: the board sent more than was asked for; try another cable or port")
        case _:
            return ProtocolError(f"{what}: {error}")
