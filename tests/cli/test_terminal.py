"""Commands at a real terminal: one that is closed ends a measurement in order, and only a terminal shows progress."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from shutil import copy

import pytest
from command_lines import run
from palpate import check
from project import FOUR

PATIENCE_S = 240  # until a test fails; nothing is measured by it
pytestmark = pytest.mark.skipif(
    not hasattr(os, "fork"), reason="no signals and terminals on this system"
)
SOURCE = "sim:four-specimens?speed=1"
RECORD, LIVE = ["record", SOURCE, "-o"], ["live", SOURCE, "--no-open", "--port", "0", "--record"]
PLAIN = "import os, sys; os.execv(sys.argv[1], sys.argv[1:])"
OWN_TERMINAL = f"import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); {PLAIN}"
NOHUP = f"import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); {PLAIN}"


def begun(first: str, command: list[str], path: Path, output: int) -> "subprocess.Popen[str]":
    """Return the running command, when some rows are in its file; the output, if it is no pipe, is its input, too."""
    whole = [sys.executable, "-c", first, sys.executable, "-m", "palpate", *command, str(path)]
    places = {"stdin": output if output > 0 else None, "stdout": output, "stderr": output}
    process = subprocess.Popen(whole, **places, text=True, start_new_session=True)  # type: ignore[call-overload]
    until(lambda: rows(path) > 5, process)
    return process  # type: ignore[no-any-return]


def rows(path: Path) -> int:
    return len(path.read_bytes().splitlines()) if path.exists() else 0


def until(is_done: Callable[[], bool], process: "subprocess.Popen[str]") -> None:
    end = time.monotonic() + PATIENCE_S
    while not is_done():
        assert process.poll() is None
        if time.monotonic() > end:
            process.kill()
            pytest.fail(f"not within {PATIENCE_S} s")
        time.sleep(0.02)


def test_a_closed_terminal_closes_the_recording(tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    process = begun(OWN_TERMINAL, RECORD, tmp_path / "run.csv", theirs)
    os.close(theirs)
    os.close(ours)
    assert (process.wait(PATIENCE_S), check(tmp_path / "run.csv").clean) == (130, True)


def test_nohup_ignores_a_closed_terminal(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with begun(NOHUP, RECORD, path, subprocess.PIPE) as process:
        process.send_signal(signal.SIGHUP)
        more = rows(path) + 20
        until(lambda: rows(path) > more, process)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, check(path).clean) == (130, True)


def test_two_signals_in_a_row_close_the_file(tmp_path: Path) -> None:
    """The process is stopped until both wait for it: the second comes before the file is closed."""
    path = tmp_path / "run.csv"
    with begun(PLAIN, RECORD, path, subprocess.PIPE) as process:
        process.send_signal(signal.SIGSTOP)
        os.waitpid(process.pid, os.WUNTRACED)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGCONT)
        messages = process.communicate(timeout=PATIENCE_S)[1]
    report = check(path)
    assert (process.returncode, report.clean) == (130, True)
    ending = rf"run.csv: {report.survey.rows} rows(, \d+ [a-z ]+)*, no touch; file closed\n$"
    assert re.search(ending, messages), messages


def test_live_says_in_the_terminal_that_a_recording_failed(tmp_path: Path) -> None:
    path, printed = tmp_path / "run.csv", tmp_path / "printed"
    with printed.open("w") as output:
        process = begun(PLAIN, LIVE, path, output.fileno())
        path.unlink()
        until(lambda: "Error: " in printed.read_text(), process)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 4
    assert printed.read_text().splitlines()[1:] == [
        "It begins when the page is open, after 8 s at the latest.",
        f"Error: {path}: was removed, renamed or moved while it was recorded",
        "ended",
    ]


def on_a_terminal(words: list[str]) -> tuple[str, str]:
    """Return what a command prints, and what it writes on a terminal, which is its standard error."""
    ours, theirs = os.openpty()
    command = [sys.executable, "-m", "palpate", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, text=True) as process:
        os.close(theirs)
        assert process.stdout
        printed, drawn = process.stdout.read(), b""
        try:
            while part := os.read(ours, 4096):
                drawn += part
        except OSError:  # on Linux: the other end is closed
            pass
    os.close(ours)
    assert process.returncode == 0
    return printed, drawn.decode()


def test_progress_is_shown_on_a_terminal_only(tmp_path: Path) -> None:
    printed, drawn = on_a_terminal(
        ["record", "sim:four-specimens", "-o", str(tmp_path / "run.csv"), "--json"]
    )
    assert (" pairs, 0 lost, " in drawn, "\r" in printed) == (True, False)
    other = tmp_path / "other.csv"
    for suffix in (".csv", ".json"):
        copy(FOUR.with_suffix(suffix), other.with_suffix(suffix))
    check_words = ["check", str(FOUR), str(other)]
    bar, *notes = on_a_terminal(check_words)[1].replace("\r\n", "\n").rstrip().split("\n")
    assert "check  [##" in bar
    below = [f"{file}: simulated: no probe was used" for file in (FOUR, other)]
    assert notes == below
    assert "\r" not in run(*check_words).output


HANGS = """
import os, time
from pathlib import Path
def hang(_):
    Path("writing").touch()
    for _ in range(6000):
        time.sleep(0.1)  # a signal just before a sleep is noticed after it
os.fsync = hang  # when all is written, and the file does not have its name yet
"""


@pytest.mark.parametrize(
    ("words", "number"),
    [
        (["convert", str(FOUR), "-o", "run.parquet"], "SIGTERM"),
        (["simulate", "-o", "ten", "--object", "gel=1.1"], "SIGHUP"),
    ],
)
def test_a_command_that_is_ended_leaves_no_half_file(
    words: list[str], number: str, tmp_path: Path
) -> None:
    code = f"{HANGS}\nfrom palpate.cli.main import palpate_command; palpate_command({words!r}, prog_name='palpate')"
    with subprocess.Popen(
        [sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, cwd=tmp_path
    ) as running:
        until((tmp_path / "writing").exists, running)
        assert len(list(tmp_path.rglob("*"))) > 1
        running.send_signal(getattr(signal, number))
        messages = running.communicate(timeout=PATIENCE_S)[1]
    assert (running.returncode, messages.splitlines()[-1]) == (130, "interrupted")
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["writing"]
