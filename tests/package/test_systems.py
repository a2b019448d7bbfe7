"""What palpate does on Windows and macOS, as far as it can be seen on this system."""

import errno
import math
import os
import re
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from palpate import files
from palpate.cli import exit_codes
from palpate.files import REPLACE_S, replace, replacing, require_file_name, to_disk
from palpate.recording.sidecar import sidecar_path
from palpate.sources.options import split


@pytest.mark.parametrize(
    "name",
    [
        "nul.csv",
        "NUL",
        "con .csv",
        "Com1.csv",
        "com¹.csv",
        "lpt9.run.csv",
        "conin$",
        "a:b.csv",
        "run.",
        "run.csv ",
    ],
)
def test_a_name_that_is_no_file_on_windows_is_refused_there(name: str) -> None:
    require_file_name(Path(name), "linux")
    with pytest.raises(
        OSError, match=r"(on Windows|Windows leaves out): choose another name: .*" + re.escape(name)
    ):
        require_file_name(Path("folder") / name, "win32")


@pytest.mark.parametrize(
    "name", ["null.csv", "com.csv", "com0.csv", "com10.csv", "run.con.csv", "größe ω.csv", ".csv"]
)
def test_other_names_are_not(name: str) -> None:
    require_file_name(Path("aux") / name, "win32")


def test_recordings_and_written_files_ask_for_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a device takes what is written, everything is lost without a word."""
    monkeypatch.setattr(require_file_name, "__defaults__", ("win32",))
    with pytest.raises(
        ValueError, match=r"record: got 'nul.csv': it is the name of a device on Windows"
    ):
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


def test_on_windows_a_file_that_is_open_is_replaced_when_it_is_closed_or_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.json"

    def write(data: bytes) -> None:
        with replacing(path) as file:
            file.write(data)

    write(b"old")
    monkeypatch.setattr(replace, "__defaults__", ("win32",))
    tried = held(monkeypatch, 3)
    write(b"new")
    assert (path.read_bytes(), len(tried), list(tmp_path.iterdir())) == (b"new", 4, [path])
    assert REPLACE_S < 5, "a recorder waits for it"
    monkeypatch.setattr(files, "REPLACE_S", 0.1)
    held(monkeypatch, math.inf)
    with pytest.raises(PermissionError, match="another program has it open") as refused:
        write(b"newer")
    assert (refused.value.filename, path.read_bytes(), list(tmp_path.iterdir())) == (
        str(path),
        b"new",
        [path],
    )


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


@pytest.mark.parametrize(
    ("uri", "parts"),
    [
        (r"C:\x y\run.csv?speed=1", ("", r"C:\x y\run.csv", {"speed": "1"})),
        (
            r"\\host\share\größe ω.csv?rate=38.4",
            ("", r"\\host\share\größe ω.csv", {"rate": "38.4"}),
        ),
        (
            r"\\?\C:\long\run.csv?rate=38.4&unit=fF",
            ("", r"\\?\C:\long\run.csv", {"rate": "38.4", "unit": "fF"}),
        ),
        (r"serial:\\.\COM12", ("serial", r"\\.\COM12", {})),
    ],
)
def test_names_of_windows_and_macos(uri: str, parts: tuple[str, str, dict[str, str]]) -> None:
    assert split(uri) == parts


@pytest.mark.parametrize(
    ("text", "system", "words"),
    [
        (
            "could not open port 'COM3': PermissionError(13, 'Access is denied.', None, 5)",
            "win32",
            "another program",
        ),
        (
            "could not open port 'COM3': FileNotFoundError(2, 'The system', None, 2)",
            "win32",
            "palpate devices",
        ),
        (
            "could not open port 'COM3': OSError(22, 'The semaphore timeout', None, 121)",
            "win32",
            "semaphore",
        ),
        (
            "[Errno 16] could not open port /dev/cu.x: [Errno 16] Resource busy",
            "darwin",
            "another program",
        ),
        (
            "[Errno 13] could not open port COM3: [Errno 13] Permission denied",
            "linux",
            "usermod -aG dialout",
        ),
    ],
)
def test_errors_of_a_port_say_what_to_do_there(text: str, system: str, words: str) -> None:
    from palpate.sources.serial import port_error

    assert words in str(port_error("COM3", Exception(text), system))


def test_ctrl_break_ends_a_measurement_like_sigterm(monkeypatch: pytest.MonkeyPatch) -> None:
    """SIGUSR1 in its place."""
    import signal

    monkeypatch.setattr(signal, "SIGBREAK", signal.SIGUSR1, raising=False)
    before, came = signal.getsignal(signal.SIGUSR1), list[int]()
    with exit_codes.handle_signals(
        lambda number, _: came.append(number), signal.SIGINT, signal.SIGTERM
    ):
        signal.raise_signal(signal.SIGUSR1)
    assert came == [signal.SIGUSR1]
    assert signal.getsignal(signal.SIGUSR1) == before


def test_a_port_is_not_shared_on_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """There SO_REUSEADDR lets a second server take connections of the first; SO_EXCLUSIVEADDRUSE is asked for instead."""
    from palpate.live.server import listen

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


def test_any_name_can_be_printed(tmp_path: Path) -> None:
    """Where the encoding has no code for a character, it is printed as an escape."""
    env = {**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"}
    command = [sys.executable, "-m", "palpate", "check", "größe ω.csv"]
    done = subprocess.run(
        command, cwd=tmp_path, env=env, capture_output=True, check=False, timeout=60
    )
    assert done.stderr.decode("cp1252").startswith("Error: größe \\u03c9.csv: ")
