"""The line about long work: on a terminal, with rate and time left; nowhere else, and gone before anything is printed."""

import os
import struct
import subprocess
import sys
import threading
import time
from contextlib import nullcontext
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from effort import NIGHTLY
from palpate.cli import progress
from palpate.cli.progress import Progress, Reading, told
from project import ROOT

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="no such terminals on this system")
EAGER = """
import sys, time
from palpate.cli import main, progress
progress._SILENT_S, progress._EVERY_S = 0.0, 0.001
leave = progress.Progress.__exit__
def left(line, *error):  # the thread that draws may be late: not before it has drawn
    while line._thread and line._thread.is_alive() and not line._shown:
        time.sleep(0.001)
    leave(line, *error)
progress.Progress.__exit__ = left
main(sys.argv[1:])
"""


class Screen:
    """A terminal of one line, in place of standard error: what was drawn, and when."""

    def __init__(self) -> None:
        self.drawn: list[tuple[float, str]] = []
        self.line = ""

    def isatty(self) -> bool:
        return True

    def fileno(self) -> int:
        raise ValueError("no file")

    def say(self, message: str, *, nl: bool) -> None:
        assert not nl
        now = time.monotonic()
        for part in message.split("\r")[1:]:
            self.line = part + self.line[len(part) :]
        self.drawn.append((now, message))  # last: who waits for it sees the line


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> Screen:
    found = Screen()
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=found))  # pytest sets sys.stderr itself
    monkeypatch.setattr(progress, "say", found.say)
    monkeypatch.setattr(progress, "_SILENT_S", 0.1)
    monkeypatch.setattr(progress, "_EVERY_S", 0.02)
    return found


def until(count: int, screen: Screen) -> None:
    end = time.monotonic() + 20
    while len(screen.drawn) < count and time.monotonic() < end:
        time.sleep(0.005)
    assert len(screen.drawn) >= count


def test_nothing_is_drawn_too_early_or_too_often(screen: Screen) -> None:
    """The times between are at least those; on a loaded computer they are longer."""
    begin = time.monotonic()
    with Progress("work", "steps") as line:
        line(0, 10)
        line(3, 10)
        until(len(screen.drawn) + 8, screen)
    times = [drawn for drawn, _ in screen.drawn]
    assert times[0] - begin >= 0.1
    assert all(later - before >= 0.02 for before, later in pairwise(times[:-1]))  # the last one clears the line
    assert "work: 3 of 10 steps, " in screen.drawn[-2][1]
    assert screen.drawn[-2][1].endswith(" left")


def test_what_is_done_before_the_first_second_says_nothing(screen: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "_SILENT_S", 3600.0)
    with Progress("work", "steps") as line:
        for _ in line.over(range(5)):
            pass
    assert screen.drawn == []
    assert not [thread for thread in threading.enumerate() if "_draw_often" in thread.name]


def test_the_line_is_cleared_at_the_end_and_after_an_error(screen: Screen) -> None:
    for error in (None, RuntimeError("broken")):
        with pytest.raises(RuntimeError) if error else nullcontext(), Progress("work", "steps") as line:
            line(2, 10)
            until(len(screen.drawn) + 2, screen)
            assert screen.line.strip()
            if error:
                raise error
        assert screen.line.strip() == ""


def test_nothing_is_drawn_while_something_is_asked(screen: Screen) -> None:
    with Progress("work", "steps") as line:
        until(2, screen)
        with line.aside():
            assert screen.line.strip() == ""
            count = len(screen.drawn)
            time.sleep(0.1)
            assert len(screen.drawn) == count
        until(count + 1, screen)


def test_the_line_is_no_wider_than_the_terminal(screen: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "17")
    with Progress("work with a long name", "steps") as line:
        line(3, 10)
        until(3, screen)
        assert screen.line == "work with a long"


def test_the_time_goes_on_within_a_step(screen: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with Progress("work", "steps") as line:
        line(0, 2)
        now[0] = 4.0
        line(1, 2)
        count = len(screen.drawn)
        until_drawn(count + 2, screen)
        assert screen.line.rstrip() == "work: 1 of 2 steps, 0.25 steps/s, 0:04 left"
        now[0] = 10.0
        until_drawn(len(screen.drawn) + 2, screen)
        assert screen.line.rstrip() == "work: 1 of 2 steps, 0.1 steps/s, 0:10 left"


def until_drawn(count: int, screen: Screen) -> None:
    """Wait without the clock, which stands still."""
    for _ in range(6000):
        if len(screen.drawn) >= count:
            return
        threading.Event().wait(0.01)
    pytest.fail("nothing is drawn")


def test_a_file_counts_while_it_is_read_and_when_it_is_read(tmp_path: Path) -> None:
    paths = [tmp_path / "a", tmp_path / "b"]
    for path in paths:
        path.write_bytes(bytes(2_000_000))

    line = Reading("read", paths)
    assert (line._total, line._done()) == (4.0, 0.0)
    line.begin(paths[0], SimpleNamespace(seen=SimpleNamespace(size=1_000_000)))
    line.begin(paths[1], object())  # a table: not in parts
    assert line._done() == 1.0
    line.end(paths[0])
    assert line._done() == 2.0


@pytest.mark.parametrize(
    ("done", "total", "seconds", "expected"),
    [
        (0, 0, 61.4, "1:01"),
        (5, 0, 3.0, "0:03"),
        (5, 10, 0.0, "0:00"),
        (12.5, 1000, 50.0, "12.5 of 1000 MB, 0.25 MB/s, 1:05:50 left"),
        (11, 10, 11.0, "11 of 10 MB, 1 MB/s, 0:00 left"),
    ],
)
def test_what_is_told(done: float, total: float, seconds: float, expected: str) -> None:
    assert told(done, total, "MB", seconds) == expected


def commands(folder: Path) -> dict[str, list[str | Path]]:
    return {
        "replay": ["replay", FOUR],
        "replay many": ["replay", FOUR, *folder.glob("3*.csv"), "--jobs", "2"],
        "check": ["check", *folder.glob("3*.csv")],
        "convert": ["convert", FOUR, "--force", "-o", folder / "out" / "run.csv"],
        "calibrate": ["calibrate", *folder.glob("*A.csv"), "--moduli", folder / "moduli.csv", "--force", "-o", folder / "p.toml"],
        "simulate": ["simulate", "-o", folder / "made" / "{}", "--touches", "1"],
        "bench": ["bench", "--seeds", "1", "--scenario", "tremor", "--json"],
        "figures": ["figures", "--force", "-o", folder / "figures"],
    }  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("specimens")
    command = [sys.executable, "-m", "palpate", "simulate", "-o", str(path), "--touches", "2"]
    subprocess.run(command, check=True, capture_output=True)
    (path / "out").mkdir()
    return path


@posix
@pytest.mark.parametrize("name", list(commands(Path()))[: None if NIGHTLY else 4])
def test_each_long_command_has_it_on_a_terminal_only(name: str, folder: Path) -> None:
    words = [str(word) for word in commands(folder)[name]]
    plain, shown = [[word.replace("{}", run) for word in words] for run in ("plain", "shown")]
    alone = subprocess.run([sys.executable, "-c", EAGER, *plain], capture_output=True, text=True, check=True)
    assert "\r" not in alone.stderr + alone.stdout
    printed, drawn = on_a_terminal([sys.executable, "-c", EAGER, *shown])
    lines, lasting = drawn.split("\r"), []
    what = words[0]
    assert [line for line in lines if line.startswith(f"{what}: ")], drawn
    for line in drawn.replace("\r\n", "\n").split("\n"):
        text = ""
        for part in line.split("\r"):
            text = part + text[len(part) :]
        lasting.append(text.rstrip())
    assert [line for line in lasting if line] == alone.stderr.splitlines()
    if name not in ("simulate", "bench"):  # other names; other times
        assert printed == alone.stdout


def on_a_terminal(command: list[str]) -> tuple[str, str]:
    """Return what a command prints, and what it writes on a terminal, which is its standard error."""
    import fcntl
    import termios

    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, text=True) as process:
        os.close(theirs)
        drawn = bytearray()
        reader = threading.Thread(target=_drain, args=(ours, drawn))
        reader.start()
        assert process.stdout
        printed = process.stdout.read()
        assert process.wait(60) in (0, 5)
        reader.join()
    os.close(ours)
    return printed, drawn.decode()


def _drain(terminal: int, into: bytearray) -> None:
    """Read until the other end is closed, which is an error on Linux."""
    try:
        while data := os.read(terminal, 4096):
            into.extend(data)
    except OSError:
        return
