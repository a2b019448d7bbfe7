"""What to do about an error of USB depends on the system."""

import errno

import pytest
import usb.core
from palpate.ad7746.evalkit.usberrors import NotAllowed, translated
from palpate.errors import DeviceNotFound, DeviceRefused, SourceError

WINUSB = "On Windows the board needs the driver WinUSB: install it for 0456:b481 with Zadig"


@pytest.mark.parametrize(
    ("system", "error", "kind", "text"),
    [
        ("win32", NotImplementedError(), DeviceRefused, f"the driver of the board is not WinUSB. {WINUSB}"),
        ("win32", usb.core.USBError("Access denied", -3, errno.EACCES), NotAllowed, f"Close other programs.*{WINUSB}"),
        ("win32", usb.core.USBError("Entity not found", -5, errno.ENOENT), DeviceNotFound, "was unplugged"),
        ("darwin", NotImplementedError(), DeviceRefused, "brew install libusb"),
        (
            "darwin",
            usb.core.USBError("Access denied", -3, errno.EACCES),
            NotAllowed,
            "On macOS another program or a dr",
        ),
        ("linux", NotImplementedError(), DeviceRefused, "install libusb-1.0"),
        ("linux", usb.core.USBError("Access denied", -3, errno.EACCES), NotAllowed, "`palpate doctor --install-udev`"),
        ("freebsd14", usb.core.USBError("Access denied", -3, errno.EACCES), NotAllowed, "no permission to open it"),
    ],
)
def test_the_system_decides_what_to_do(system: str, error: Exception, kind: type[SourceError], text: str) -> None:
    with pytest.raises(kind, match=f"^the board at 1/2: .*{text}") as raised, translated("the board at 1/2", system):
        raise error
    assert raised.value.__cause__ is error
    assert ("Zadig" in str(raised.value)) == (WINUSB in text or "Zadig" in text)
