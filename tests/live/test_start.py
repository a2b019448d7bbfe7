"""How `palpate live` starts: what is missing, the printed address, what libraries log."""

import logging
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner
from live_bench import HOST
from live_server import PATIENCE_S, Live
from palpate import MissingExtra, check
from palpate.ad7746.evalkit import hotplug
from palpate.ad7746.evalkit.find import Board
from palpate.cli import main
from palpate.cli.library_logs import LIBRARIES, library_logs
from palpate.cli.live import _arrivals


def test_the_line_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "uvicorn", None)
    result = CliRunner().invoke(main, ["live", "sim:four-specimens"])
    assert result.exit_code == 6
    assert "pip install 'palpate[live]'" in result.stderr


def test_a_port_that_is_not_free() -> None:
    from palpate.live.serve import listen

    with listen(HOST, 0) as taken:
        port = str(taken.getsockname()[1])
        result = CliRunner().invoke(main, ["live", "sim:four-specimens", "--no-open", "--port", port])
    assert result.exit_code == 2
    assert "not free" in result.stderr or "in use" in result.stderr


def test_the_token_is_in_the_printed_address() -> None:
    with Live() as live:
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{32}", live.address)
        assert live.asks("/") == 403
        assert live.asks("/", live.token) == 200
        with Live() as other:
            assert live.asks("/", other.token) == 403
    with Live("--no-token") as live:
        assert live.address == live.origin
        assert live.asks("/") == 200


def test_other_machines_always_need_the_token() -> None:
    result = CliRunner().invoke(main, ["live", "sim:four-specimens", "--no-open", "--host", "0.0.0.0", "--no-token"])
    assert result.exit_code == 2
    assert "--no-token: got --host 0.0.0.0, allowed: only with an address of this machine" in result.stderr


def test_a_board_that_comes_while_one_is_simulated_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    there: set[Board] = set()
    notes: list[str] = []
    monkeypatch.setattr(hotplug, "looking", lambda: lambda: set(there))
    session: Any = SimpleNamespace(stream=SimpleNamespace(source=SimpleNamespace(notify=notes.append)))
    with _arrivals(session):
        there.add(Board(1, 7, (2,)))
        deadline = time.monotonic() + 30
        while not notes and time.monotonic() < deadline:
            time.sleep(0.01)
    assert notes == ["usb:1/7 was plugged in: to measure with it, end this with Ctrl-C, then type palpate live again"]


def test_without_libusb_a_simulated_board_still_measures(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise MissingExtra("libusb-1.0 is not installed")

    monkeypatch.setattr(hotplug, "looking", fail)
    session: Any = None
    with _arrivals(session):
        pass


@pytest.mark.parametrize("pause_s", [0.0, 0.05, 0.3])
def test_ctrl_c_twice_ends_it_without_a_traceback(tmp_path: Path, pause_s: float) -> None:
    with Live("--record", str(tmp_path / "run.csv"), told=subprocess.PIPE) as live:
        assert live.asks("/", live.token) == 200
        live.process.send_signal(signal.SIGINT)
        time.sleep(pause_s)
        live.process.send_signal(signal.SIGINT)
        _, told = live.process.communicate(timeout=PATIENCE_S)
    assert live.process.returncode == 130
    assert re.fullmatch(r"ended\n\S*run.csv: \d+ rows; file closed\n", told)


SLOWLY = """
import time
from palpate.live import workbench
begin = workbench.Workbench.__init__
def slowly(*given):
    time.sleep(3)
    begin(*given)
workbench.Workbench.__init__ = slowly
from palpate.cli import main
main(prog_name="palpate")
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recording_is_closed_also_before_the_page_is_made(tmp_path: Path, number: int) -> None:
    path = tmp_path / "run.csv"
    command = [sys.executable, "-c", SLOWLY, "live", "sim:four-specimens?speed=1", "--no-open", "--port", "0"]
    with subprocess.Popen(
        [*command, "--record", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        while not (path.exists() and len(path.read_bytes().splitlines()) > 6):
            time.sleep(0.02)
            assert process.poll() is None
        process.send_signal(number)
        told = process.communicate(timeout=PATIENCE_S)
    assert told[0] == ""  # no address yet
    assert (process.returncode, told[1].endswith("; file closed\n")) == (130, True)
    assert not check(path).faults


@pytest.mark.parametrize("debug", [False, True])
def test_a_librarys_traceback_is_one_line(debug: bool, capsys: pytest.CaptureFixture[str]) -> None:
    with library_logs(debug=debug):
        for _ in range(3):
            try:
                raise KeyError("lost\nin the middle")
            except KeyError:
                logging.getLogger("uvicorn.error").exception("Exception in ASGI application\n")
            logging.getLogger("uvicorn.error").warning("Invalid HTTP request received.")
            logging.getLogger("uvicorn.error").error("Traceback (most recent call last):\n  here\nOSError: gone")
        for name in LIBRARIES:
            logging.getLogger(name).error("broken")
    lines = capsys.readouterr().err.splitlines()
    if debug:
        assert lines.count("Traceback (most recent call last):") == 6
    else:
        assert lines == [
            "page: uvicorn.error: KeyError: 'lost\\nin the middle'; --debug shows more",
            "page: uvicorn.error: OSError: gone; --debug shows more",
            *(f"page: {name}: broken; --debug shows more" for name in LIBRARIES),
        ]
