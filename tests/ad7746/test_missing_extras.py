"""What is said where something optional is not installed."""

import ctypes.util
import sys

import pytest
from palpate import PalpateError
from palpate.errors import MissingExtra
from palpate.kit.usbboards import boards, system_backend


@pytest.mark.parametrize(
    ("module", "package", "line"),
    [("evalkit", "usb", r"pip install 'palpate\[usb\]'"), ("kit.i2cdev", "smbus2", r"pip install 'palpate\[i2c\]'")],
)
def test_a_package_that_is_missing(module: str, package: str, line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(sys.modules):
        if name.split(".")[0] == package or name in (
            f"palpate.{module}",
            "palpate.kit.usbboards",
            "palpate.kit.usberrors",
        ):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=line) as raised:
        __import__(f"palpate.{module}")
    assert isinstance(raised.value, PalpateError)


def test_a_library_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    monkeypatch.setitem(sys.modules, "libusb_package", None)
    with pytest.raises(MissingExtra, match=r"pip install 'palpate\[usb\]', or apt install libusb-1.0-0"):
        system_backend()
    with pytest.raises(MissingExtra):
        boards()
