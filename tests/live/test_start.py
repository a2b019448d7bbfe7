"""How `palpate live` starts: what is missing, the printed address, what libraries log."""

import logging
import re
import signal
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from command_lines import run
from live_bench import HOST
from live_server import PATIENCE_S, Live
from palpate.cli.live import library_logs
from palpate.live.server import PortInUse, listen, listen_near


def test_what_is_refused_before_anything_is_measured() -> None:
    with listen(HOST, 0) as taken:
        port = str(taken.getsockname()[1])
        result = run("live", "sim:four-specimens", "--no-open", "--port", port)
    assert result.exit_code == 2
    assert "not free" in result.stderr or "in use" in result.stderr
    result = run("live", "sim:four-specimens", "--no-open", "--host", "0.0.0.0", "--no-token")
    assert result.exit_code == 2
    assert (
        "--no-token: got --host 0.0.0.0, allowed: only with an address of this machine"
        in result.stderr
    )


def test_the_next_free_port_is_taken_if_none_was_asked_for() -> None:
    with listen(HOST, 0) as taken:
        port = taken.getsockname()[1]
        with listen_near(HOST, port) as other:
            assert port < other.getsockname()[1] < port + 20
    words = [sys.executable, "-m", "palpate", "live", "sim:four-specimens", "--no-open"]
    with ExitStack() as running:
        with suppress(PortInUse):  # else another program has it
            running.enter_context(listen(HOST, 8746))
        process = running.enter_context(
            subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        )
        assert process.stdout
        assert process.stderr
        used = re.search(r":(\d+)/", process.stdout.readline())
        assert used
        assert int(used[1]) > 8746
        told = "port 8746 is in use, perhaps by another palpate live: this page has port "
        assert process.stderr.readline() == f"{told}{used[1]}\n"
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE_S)


def test_the_token_is_in_the_printed_address() -> None:
    with Live() as live:
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", live.address)
        assert live.asks("/") == 403
        assert live.asks("/", live.token) == 200
        with Live() as other:
            assert live.asks("/", other.token) == 403


def test_ctrl_c_twice_ends_it_without_a_traceback(tmp_path: Path) -> None:
    with Live("--record", str(tmp_path / "run.csv"), told=subprocess.PIPE) as live:
        assert live.asks("/", live.token) == 200
        live.process.send_signal(signal.SIGINT)
        live.process.send_signal(signal.SIGINT)
        _, told = live.process.communicate(timeout=PATIENCE_S)
    assert live.process.returncode == 130
    assert re.fullmatch(r"ended\n\S*run.csv: \d+ rows; file closed\n", told)


def test_a_librarys_traceback_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    def said(*, debug: bool) -> list[str]:
        with library_logs(debug=debug):
            try:
                raise KeyError("lost\nin the middle")
            except KeyError:
                logging.getLogger("uvicorn.error").exception("Exception in ASGI application\n")
            logging.getLogger("uvicorn.error").warning("Invalid HTTP request received.")
            logging.getLogger("asyncio").error("broken")
            if not debug:
                logging.getLogger("asyncio").error("broken")  # is written once
        return capsys.readouterr().err.splitlines()

    assert said(debug=True).count("Traceback (most recent call last):") == 1
    assert said(debug=False) == [
        "page: uvicorn.error: KeyError: 'lost\\nin the middle'; --debug shows more",
        "page: asyncio: broken; --debug shows more",
    ]
