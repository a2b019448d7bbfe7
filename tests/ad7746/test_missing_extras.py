"""What is said where something optional is not installed."""

import ctypes.util
import sys

import pytest
from palpate import PalpateError
from palpate.ad7746.evalkit.find import boards, system_backend
from palpate.errors import MissingExtra


@pytest.mark.parametrize(
    ("module", "package", "line"),
    [
        ("ad7746.evalkit.board", "usb", r"pip install 'palpate\[usb\]'"),
        ("ad7746.i2c", "smbus2", r"pip install 'palpate\[i2c\]'"),
    ],
)
def test_a_package_that_is_missing(module: str, package: str, line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(sys.modules):
        if name.split(".")[0] == package or name in (
            f"palpate.{module}",
            "palpate.ad7746.evalkit.find",
            "palpate.ad7746.evalkit.usberrors",
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
