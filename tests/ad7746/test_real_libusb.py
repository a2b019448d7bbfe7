"""The tests of the kit once more, over the real libusb: in a child process under umockdev's preload library."""

import ctypes.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from project import ROOT, need
from tally import Tally

LIMIT_S = 300
FILES = [f"tests/ad7746/{name}.py" for name in ("test_evalkit", "test_evalkit_board", "test_hotplug")]


def attempt(cache: Path, *more: str) -> subprocess.CompletedProcess[str]:
    with tempfile.TemporaryDirectory(prefix="kit.", dir="/tmp") as root:  # a Unix socket's path ends at 108 bytes
        environment = os.environ | {
            "PALPATE_CARRIER": "usbfs",
            "UMOCKDEV_DIR": root,
            "SYSTEMD_DEVICE_VERIFY_SYSFS": "0",
            "LD_PRELOAD": "libumockdev-preload.so.0",
        }
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-o", f"cache_dir={cache}", *more, *FILES]
        return subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=LIMIT_S, check=False
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
