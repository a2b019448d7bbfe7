"""What a board on USB needs: a firmware file, a library, a permission; and the words for what is missing. And the real libusb: the tests of the kit once more."""

import ctypes.util
import errno
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
import usb.core
from effort import Tally
from hypothesis import given
from hypothesis import strategies as st
from palpate.ad7746.bus import NotReady
from palpate.ad7746.evalkit.discovery import system_backend, translated
from palpate.ad7746.evalkit.usb_bus import CPUCS, RAM_BYTES, parse_hex, read_hex, transfer
from palpate.errors import DeviceNotFound, DeviceRefused, MissingExtra, ProtocolError, SourceError
from project import ROOT, need

END = ":00000001FF"
START = ":03000000020100FA"


def record(address: int, data: bytes, kind: int = 0) -> str:
    raw = bytes([len(data), *address.to_bytes(2, "big"), kind]) + data
    return ":" + (raw + bytes([-sum(raw) & 0xFF])).hex().upper()


@given(st.binary(min_size=1, max_size=4000), st.integers(1, 255))
def test_any_image_comes_back(image: bytes, chunk: int) -> None:
    lines = [record(start, image[start : start + chunk]) for start in range(0, len(image), chunk)]
    assert b"".join(parse_hex("\n".join([*lines, END])).values()) == image


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ([START], "no end record"),
        ([END], "no data at address 0"),
        ([START, END, END], "line 2: got ':00000001FF', allowed: a data record"),
        ([START[:-2] + "FB", END], "line 1: checksum: got 0xFB, allowed: 0xFA"),
        ([START[:-2], END], "as long as it says"),
        ([START, record(0, b"\0\0", 4), END], "line 2: got"),
        ([START, record(RAM_BYTES - 1, b"ab"), END], "allowed: all data below 0x4000"),
        (["\xff", END], "codec can't decode"),
    ],
)
def test_a_firmware_file_that_is_refused(lines: list[str], text: str, tmp_path: Path) -> None:
    path = tmp_path / "image.hex"
    with pytest.raises(ProtocolError, match="No such file or directory: check the path"):
        read_hex(path)
    path.write_text("\n".join(lines), "latin-1")
    with pytest.raises(ProtocolError, match=text):
        read_hex(path)


def test_a_firmware_that_is_not_written_as_it_is_does_not_start() -> None:
    written: list[tuple[int, bytes]] = []
    with pytest.raises(ProtocolError, match="verification failed at 0x0000"):
        transfer({0: b"ab"}, lambda *part: written.append(part), lambda address, count: b"aB")
    assert written == [(CPUCS, b"\1"), (0, b"ab")]


@pytest.mark.parametrize(
    ("error", "kind", "text"),
    [
        (NotImplementedError(), DeviceRefused, "install libusb-1.0"),
        (
            usb.core.USBError("Access denied", -3, errno.EACCES),
            NotReady,
            "`palpate doctor --install-udev`",
        ),
        (usb.core.USBError("Entity not found", -5, errno.ENOENT), DeviceNotFound, "was unplugged"),
        (usb.core.USBError("odd", -99, 12345), ProtocolError, "odd"),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="the words depend on the system")
def test_an_error_of_usb_says_what_to_do(
    error: Exception, kind: type[SourceError], text: str
) -> None:
    with (
        pytest.raises(kind, match=f"^the board at 1/2: .*{text}") as raised,
        translated("the board at 1/2"),
    ):
        raise error
    assert raised.value.__cause__ is error


def test_a_library_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    monkeypatch.setitem(sys.modules, "libusb_package", None)
    with pytest.raises(
        MissingExtra, match=r"pip install 'palpate\[usb\]', or apt install libusb-1.0-0"
    ):
        system_backend()


LIMIT_S = 300
FILE = "tests/ad7746/test_evalkit.py"


def attempt(cache: Path, *more: str) -> subprocess.CompletedProcess[str]:
    # a Unix socket's path ends at 108 bytes
    with tempfile.TemporaryDirectory(prefix="kit.", dir="/tmp") as root:
        environment = os.environ | {
            "PALPATE_CARRIER": "usbfs",
            "UMOCKDEV_DIR": root,
            "SYSTEMD_DEVICE_VERIFY_SYSFS": "0",
            "LD_PRELOAD": "libumockdev-preload.so.0",
        }
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-n",
            "0",
            "-o",
            f"cache_dir={cache}",
            *more,
            FILE,
        ]
        return subprocess.run(
            command,
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="usbfs is Linux's")
def test_the_kit_over_the_real_libusb(tmp_path: Path, tally: Tally) -> None:
    """In real time, so that a busy machine may be late: what failed is tried again, twice."""
    need("umockdev-run")
    assert ctypes.util.find_library("usb-1.0"), "apt install libusb-1.0-0"
    done = attempt(tmp_path)
    for _ in range(2):
        if done.returncode:
            done = attempt(tmp_path, "--last-failed")
    assert done.returncode == 0, done.stdout + done.stderr
    summary = done.stdout.splitlines()
    assert "skipped" not in summary[-1]
    for line in summary:
        if any(word in line for word in ("pairs:", "noticed", "passed")):
            tally.say(f"real libusb: {line}")
