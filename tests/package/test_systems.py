"""What palpate does on Windows and macOS, as far as it can be seen on this system."""

import errno
import math
import os
import socket
import subprocess
import sys
import time
from pathlib import Path, PureWindowsPath
from typing import Any

import pytest
from palpate import systems
from palpate.cli import terminal
from palpate.files import replacing
from palpate.recording.sidecar import sidecar_path
from palpate.sources.options import split
from palpate.systems import REPLACE_S, on_monotonic, replace, require_file_name, to_disk

NO_FILES = [
    "nul.csv",
    "NUL",
    "aux.csv",
    "con .csv",
    "Com1.csv",
    "lpt9.run.csv",
    "com¹.csv",
    "conin$",
    "a:b.csv",
    "run.",
    "run.csv ",
]
FILES = [
    "null.csv",
    "console.csv",
    "com.csv",
    "com0.csv",
    "com10.csv",
    "auxiliary.csv",
    "run.con.csv",
    "größe ω.csv",
    ".csv",
]


@pytest.mark.parametrize("name", NO_FILES)
def test_a_name_that_is_no_file_on_windows_is_refused_there(name: str) -> None:
    require_file_name(Path(name), "linux")
    with pytest.raises(OSError, match=r"on Windows|Windows leaves out") as refused:
        require_file_name(Path("folder") / name, "win32")
    assert "choose another name" in str(refused.value)
    assert name in str(refused.value)


@pytest.mark.parametrize("name", FILES)
def test_other_names_are_not(name: str) -> None:
    require_file_name(Path("aux") / name, "win32")


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="is_reserved warns")
@pytest.mark.parametrize("name", [*NO_FILES, *FILES])
def test_python_knows_the_same_devices(name: str) -> None:
    assert bool(systems._DEVICE.match(name)) == PureWindowsPath(name).is_reserved()


def test_recordings_and_written_files_ask_for_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a device takes what is written, everything is lost without a word."""
    monkeypatch.setattr(require_file_name, "__defaults__", ("win32",))
    with pytest.raises(ValueError, match=r"record: got 'nul.csv': it is the name of a device on Windows"):
        sidecar_path(tmp_path / "nul.csv")
    with pytest.raises(OSError, match="name of a device"), replacing(tmp_path / "aux.html"):
        pass
    assert list(tmp_path.iterdir()) == []


def held(monkeypatch: pytest.MonkeyPatch, tries: float) -> list[Path]:
    """Let a file be open in another program while so many tries are made: on Windows it cannot be replaced meanwhile."""
    tried, really = list[Path](), Path.replace

    def replaced(self: Path, target: Path) -> Path:
        tried.append(target)
        if len(tried) <= tries:
            raise PermissionError(errno.EACCES, "Access is denied", str(self), 5, str(target))
        return really(self, target)

    monkeypatch.setattr(Path, "replace", replaced)
    return tried


def test_on_windows_a_file_that_is_open_is_replaced_when_it_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replace, "__defaults__", ("win32",))
    tried = held(monkeypatch, 3)
    path = tmp_path / "run.json"
    path.write_text("old", encoding="utf-8")
    with replacing(path) as file:
        file.write(b"new")
    assert path.read_text(encoding="utf-8") == "new"
    assert len(tried) == 4
    assert list(tmp_path.iterdir()) == [path]


def test_one_that_stays_open_is_left_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replace, "__defaults__", ("win32",))
    monkeypatch.setattr(systems, "REPLACE_S", 0.1)
    assert REPLACE_S < 5, "a recorder waits for it"
    held(monkeypatch, math.inf)
    path = tmp_path / "run.json"
    path.write_text("old", encoding="utf-8")
    with pytest.raises(PermissionError, match="another program has it open") as refused, replacing(path) as file:
        file.write(b"new")
    assert refused.value.filename == str(path)
    assert (path.read_text(encoding="utf-8"), list(tmp_path.iterdir())) == ("old", [path])


def test_elsewhere_it_is_not_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tried = held(monkeypatch, math.inf)
    with pytest.raises(PermissionError, match="Access is denied"):
        replace(tmp_path / "a", tmp_path / "b", "linux")
    assert len(tried) == 1


def test_macos_writes_to_the_disk_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import fcntl

    asked: list[Any] = []

    def control(descriptor: int, command: int) -> int:
        asked.append(command)
        if len(asked) > 1:
            raise OSError(errno.ENOTSUP, "not supported")
        return 0

    monkeypatch.setattr(fcntl, "F_FULLFSYNC", 51, raising=False)
    monkeypatch.setattr(fcntl, "fcntl", control)
    monkeypatch.setattr(os, "fsync", lambda _: asked.append("fsync"))
    monkeypatch.setattr(sys, "platform", "darwin")
    with (tmp_path / "x").open("wb") as file:
        to_disk(file.fileno())
        to_disk(file.fileno())
    assert asked == [51, 51, "fsync"]


def test_a_fine_clock_is_put_on_the_one_of_python(monkeypatch: pytest.MonkeyPatch) -> None:
    assert on_monotonic(7) == 7
    monkeypatch.setattr(systems, "fine_ns", lambda: time.monotonic_ns() - 10**15)
    assert on_monotonic(7) == pytest.approx(10**15, abs=10**9)


@pytest.mark.parametrize(
    ("uri", "parts"),
    [
        (r"C:\x y\run.csv?speed=1", ("", r"C:\x y\run.csv", {"speed": "1"})),
        (r"c:\run.csv", ("", r"c:\run.csv", {})),
        (r"c:run.csv", ("", "c:run.csv", {})),
        (r"\\host\share\größe ω.csv?rate=38.4", ("", r"\\host\share\größe ω.csv", {"rate": "38.4"})),
        (r"\\?\C:\long\run.csv", ("", r"\\?\C:\long\run.csv", {})),
        (r"\\?\C:\long\run.csv?rate=38.4&unit=fF", ("", r"\\?\C:\long\run.csv", {"rate": "38.4", "unit": "fF"})),
        ("serial:COM3?baud=9600", ("serial", "COM3", {"baud": "9600"})),
        (r"serial:\\.\COM12", ("serial", r"\\.\COM12", {})),
        ("serial:/dev/cu.usbmodem14101", ("serial", "/dev/cu.usbmodem14101", {})),
    ],
)
def test_names_of_windows_and_macos(uri: str, parts: tuple[str, str, dict[str, str]]) -> None:
    assert split(uri) == parts


@pytest.mark.parametrize(
    ("text", "system", "words"),
    [
        ("could not open port 'COM3': PermissionError(13, 'Access is denied.', None, 5)", "win32", "another program"),
        (
            "could not open port 'COM3': FileNotFoundError(2, 'The system cannot find', None, 2)",
            "win32",
            "no such port",
        ),
        ("could not open port 'COM3': OSError(22, 'The semaphore timeout', None, 121)", "win32", "semaphore"),
        ("[Errno 16] could not open port /dev/cu.x: [Errno 16] Resource busy", "darwin", "another program"),
        ("[Errno 13] could not open port /dev/ttyACM0: [Errno 13] Permission denied", "linux", "dialout"),
    ],
)
def test_errors_of_a_port_say_what_to_do_there(text: str, system: str, words: str) -> None:
    from palpate.sources.serial.port import _error

    assert words in str(_error("COM3", Exception(text), system))


def test_ctrl_break_ends_a_measurement_like_sigterm(monkeypatch: pytest.MonkeyPatch) -> None:
    """SIGUSR1 in its place."""
    import signal

    monkeypatch.setattr(signal, "SIGBREAK", signal.SIGUSR1, raising=False)
    before, came = signal.getsignal(signal.SIGUSR1), list[int]()
    with terminal.signals(lambda number, _: came.append(number), signal.SIGINT, signal.SIGTERM):
        signal.raise_signal(signal.SIGUSR1)
    assert came == [signal.SIGUSR1]
    assert signal.getsignal(signal.SIGUSR1) == before


def test_a_port_is_not_shared_on_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """There SO_REUSEADDR lets a second server take connections of the first; SO_EXCLUSIVEADDRUSE is asked for instead."""
    from palpate.live.serve import listen

    asked: list[int] = []

    class Socket(socket.socket):
        def setsockopt(self, *arguments: Any) -> None:
            asked.append(arguments[1])

    monkeypatch.setattr(socket, "socket", Socket)
    monkeypatch.setattr(socket, "SO_EXCLUSIVEADDRUSE", -5, raising=False)
    listen("127.0.0.1", 0).close()
    monkeypatch.delattr(socket, "SO_EXCLUSIVEADDRUSE")
    listen("127.0.0.1", 0).close()
    assert asked == [-5, socket.SO_REUSEADDR]


@pytest.mark.parametrize("encoding", ["cp1252"])
def test_any_name_and_note_can_be_printed(tmp_path: Path, encoding: str) -> None:
    """Where the encoding has no code for a character, it is printed as an escape."""
    palpate = [sys.executable, "-m", "palpate"]
    env = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    name = "größe 70 ω.csv"

    def told(*command: str) -> str:
        done = subprocess.run([*palpate, *command], cwd=tmp_path, env=env, capture_output=True, check=True, timeout=60)
        return (done.stdout + done.stderr).decode(encoding)

    simulated = "sim:stiff-steady?seed=1"
    assert "rows; file closed" in told("record", simulated, "-o", name, "--note", "ω ≥ 3")
    shown = name.encode(encoding, "backslashreplace").decode(encoding)
    assert shown in told("check", name)
    assert shown.replace(".csv", ".parquet") in told("convert", name, "-o", name.replace(".csv", ".parquet"))
