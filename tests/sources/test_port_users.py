"""A second program that reads a serial port: who it is, found at the start and later, and how a measurement ends."""

import os
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import palpate
import pytest
from command_lines import run
from palpate import Stream
from palpate.errors import DeviceRefused, ProtocolError
from palpate.files import Json
from palpate.source_events import GapCause
from palpate.sources import SampleSource, port_users
from palpate.sources.port_users import PortUser, port_readers
from recording_bench import four
from serial_lines import Sent

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs /proc of Linux")

READER = """
import os, select, sys
port = os.open(sys.argv[1], os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
print("reads", flush=True)
while True:
    select.select([port], [], [])
    try:
        os.read(port, 4096)
    except BlockingIOError:
        pass
"""


@pytest.fixture
def port() -> Iterator[tuple[int, str]]:
    """Return the board's end of a port, and its name."""
    end, other = os.openpty()
    tty.setraw(other)
    yield end, os.ttyname(other)
    os.close(end)
    os.close(other)


@contextmanager
def second_reader(name: str) -> Iterator[int]:
    """Let another program read a port; its process."""
    command = [sys.executable, "-c", READER, name]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as program:
        assert program.stdout
        program.stdout.readline()
        yield program.pid
        program.kill()


def test_a_program_is_found_at_the_start(port: tuple[int, str], tmp_path: Path) -> None:
    _, name = port
    with second_reader(name) as pid:
        [user] = port_readers(name)
        done = run("record", f"serial:{name}", "-o", tmp_path / "run.csv")
    assert user.pid == pid
    assert done.exit_code == 3
    text = f"another program reads it ({user.name}, process {pid}), and each would get a part"
    assert text in done.stderr
    assert "close that program" in done.stderr
    palpate.open(f"serial:{name}").close()  # free again


def test_a_program_that_comes_later(port: tuple[int, str]) -> None:
    """It is found by what it takes; the measurement goes on until it is ended."""
    end, name = port
    messages: list[str] = []
    ended = threading.Event()

    def board() -> None:
        number = 0
        while not ended.wait(0.001):
            number += 1
            os.write(end, b"seq=%d,hard=6.920%03d,soft=4.690125\n" % (number, number % 1000))

    sender = threading.Thread(target=board)
    with Stream(f"serial:{name}", notify=messages.append) as stream:
        sender.start()
        estimates = iter(stream)
        next(estimates)
        with second_reader(name) as pid:
            while not any(f"process {pid}): lines are lost" in text for text in messages):
                next(estimates)
        next(estimates)
    ended.set()
    sender.join()
    assert not any("unplugged" in text for text in messages)
    assert isinstance(stream.error, ProtocolError)
    assert "another program read it, too" in str(stream.error)


def processes(folder: Path, *opened: tuple[int, str, int, str]) -> Path:
    """Make a folder as /proc: process, name, access, and the file that it has open."""
    for pid, name, access, file in opened:
        process = folder / str(pid)
        for inner in ("fd", "fdinfo"):
            (process / inner).mkdir(parents=True, exist_ok=True)
        number = len(list((process / "fd").iterdir()))
        (process / "fd" / str(number)).symlink_to(file)
        (process / "fdinfo" / str(number)).write_text(f"pos:\t0\nflags:\t0{access:o}\n")
        (process / "comm").write_text(f"{name}\n")
        (process / "stat").write_text(f"{pid} (a (b) c) S 1 {pid}")
    return folder


def test_who_reads(tmp_path: Path) -> None:
    """Not a writer, another device, this program or the ones that began it, or the other end of a pseudo-terminal."""
    own, parent, port = os.getpid(), 4_999_999, "/dev/pts/99"
    proc = processes(
        tmp_path,
        (5_000_001, "cat", os.O_RDONLY, port),
        (5_000_002, "minicom", os.O_RDWR | os.O_NONBLOCK, port),
        (5_000_003, "echo", os.O_WRONLY, port),
        (5_000_004, "other", os.O_RDWR, "/dev/pts/98"),
        (5_000_005, "board", os.O_RDWR, port),
        (5_000_005, "board", os.O_RDWR, "/dev/ptmx"),
        (own, "palpate", os.O_RDWR, port),
        (parent, "shell", os.O_RDWR, port),
    )
    (proc / str(own) / "stat").write_text(f"{own} (palpate) S {parent} {own}")
    (proc / "5000006" / "fd").mkdir(parents=True)  # it ends meanwhile
    assert port_readers(port, proc) == [PortUser(5_000_001, "cat"), PortUser(5_000_002, "minicom")]
    assert port_readers("/dev/ttyUSB7", proc) == []
    assert str(PortUser(77, "cat")) == "cat, process 77"


def test_nothing_is_looked_for_elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    proc = processes(tmp_path, (5_000_001, "cat", os.O_RDONLY, "/dev/cu.usb"))
    monkeypatch.setattr(sys, "platform", "darwin")
    assert port_readers("/dev/cu.usb", proc) == []


def test_a_damaged_line_lets_it_look(monkeypatch: pytest.MonkeyPatch) -> None:
    found = iter([[], [], [PortUser(77, "cat")], [], []])
    monkeypatch.setattr(port_users, "port_readers", lambda _: next(found))
    monkeypatch.setattr(port_users, "_LOOK_NS", -1)
    good, bad = "hard=6.92,soft=4.69", "hard=6.92"
    sent = Sent([good, good, bad, good, bad, good, good])
    assert sent.causes == [GapCause.SHARED, GapCause.SHARED]
    first, last = (text for _, text in sent.gaps)
    assert (
        first
        == "another program reads tty (cat, process 77): lines are lost, and values may be wrong"
    )
    assert last == "no other program reads tty any more"
    assert "another program read it, too (cat, process 77): 2 lines were not read" in sent.failed
    assert any("(cat, process 77)" in text and "close that program" in text for text in sent.said)


def test_without_another_program_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(port_users, "port_readers", lambda _: [])
    sent = Sent(["hard=6.92,soft=4.69", "hard=6.92", "hard=6.92,soft=4.69"])
    assert (sent.failed, sent.causes, len(sent.samples)) == ("", [], 2)
    with pytest.raises(DeviceRefused, match="another program reads it, and each would get"):
        raise port_users.refused_as_shared("tty")


class Taken(SampleSource):
    """Samples; where it is ended, it says that lines were taken."""

    def __init__(self) -> None:
        self._ended = threading.Event()

    def samples(self) -> Iterator[Any]:
        """Yield the samples, then wait for the end."""
        for sample in four():
            if not self._ended.is_set():
                yield sample
        self._ended.wait()
        raise ProtocolError("tty: another program read it, too")

    def describe(self) -> Json:
        """Return a name."""
        return {"name": "taken"}

    def interrupt(self) -> None:
        """Go to the end."""
        self._ended.set()


def test_the_exit_code_is_4_also_if_all_touches_were_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.sources.open", lambda *_, **__: Taken())
    done = run("record", "serial:tty", "-o", tmp_path / "run.csv", "--touches", "1")
    assert (done.exit_code, "tty: another program read it, too" in done.stderr) == (4, True)
