"""A measurement and its terminal: one that is closed ends it in order, and an error is printed when it comes."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from palpate import check

PATIENCE_S = 60
posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="no signals and terminals on this system")
SOURCE = "sim:four-specimens?speed=1"
COMMANDS = {
    "record": ["-m", "palpate", "record", SOURCE, "-o"],
    "live": ["-m", "palpate", "live", SOURCE, "--no-open", "--port", "0", "--record"],
}
OWN_TERMINAL = (
    "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); os.execv(sys.argv[1], sys.argv[1:])"
)
NOHUP = "import os, signal, sys; signal.signal(signal.SIGHUP, signal.SIG_IGN); os.execv(sys.argv[1], sys.argv[1:])"


def begun(first: str, command: list[str], path: Path, output: int) -> "subprocess.Popen[str]":
    """Return the running command, when some rows are in its file; the output, if it is no pipe, is its input, too."""
    whole = [sys.executable, "-c", first, sys.executable, *command, str(path)]
    process = subprocess.Popen(
        whole, stdin=output if output > 0 else None, stdout=output, stderr=output, text=True, start_new_session=True
    )
    until(lambda: path.exists() and len(path.read_bytes().splitlines()) > 6, process)
    return process


def until(there: Callable[[], bool], process: "subprocess.Popen[str]") -> None:
    end = time.monotonic() + PATIENCE_S
    while not there():
        assert process.poll() is None
        if time.monotonic() > end:
            process.kill()
            pytest.fail(f"not within {PATIENCE_S} s")
        time.sleep(0.02)


@posix
@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_a_closed_terminal_closes_the_recording(command: list[str], tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    process = begun(OWN_TERMINAL, command, tmp_path / "run.csv", theirs)
    os.close(theirs)
    os.close(ours)
    assert process.wait(PATIENCE_S) == 130
    assert check(tmp_path / "run.csv").clean


@posix
@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_nohup_is_obeyed(command: list[str], tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with begun(NOHUP, command, path, subprocess.PIPE) as process:
        process.send_signal(signal.SIGHUP)
        more = len(path.read_bytes().splitlines()) + 20
        until(lambda: len(path.read_bytes().splitlines()) > more, process)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert check(path).clean


@posix
def test_live_says_in_the_terminal_what_it_recorded(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with begun(
        "import os, sys; os.execv(sys.argv[1], sys.argv[1:])", COMMANDS["live"], path, subprocess.PIPE
    ) as process:
        process.send_signal(signal.SIGHUP)
        told = process.communicate(timeout=PATIENCE_S)[1]
    assert process.returncode == 130
    assert told == f"ended\nrun.csv: {check(path).survey.rows} rows; file closed\n"


@posix
def test_live_says_in_the_terminal_that_a_recording_failed(tmp_path: Path) -> None:
    path, rescued, printed = tmp_path / "run.csv", tmp_path / "run.rescued.csv", tmp_path / "printed"
    with printed.open("w") as output:
        process = begun("import os, sys; os.execv(sys.argv[1], sys.argv[1:])", COMMANDS["live"], path, output.fileno())
        path.unlink()
        until(lambda: "Error: " in printed.read_text(), process)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 4
    assert printed.read_text().splitlines()[1:] == [
        f"Error: {path}: was removed while it was recorded; what could be saved is in {rescued}",
        "ended",
    ]
    assert check(rescued).survey.rows > 0
