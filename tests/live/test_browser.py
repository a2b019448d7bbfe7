"""How `palpate live` opens a browser: beside the server, and without the token in a command line."""

import os
import re
import signal
import stat
import sys
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import pytest
from live_browser import Browser
from live_server import Live
from palpate.cli import browser
from recording_bench import soon

ADDRESS = "http://127.0.0.1:8746/Q4h-Zk_0aBcDeFgHiJkLmNoPqRsTuVwX/"


@pytest.fixture
def foreground(tmp_path: Path) -> Iterator[Path]:
    """Write a program that takes its arguments and stays."""
    if sys.platform == "win32":
        pytest.skip("a script of the shell")
    program = tmp_path / "browser"
    program.write_text('#!/bin/sh\necho $$ > "$0.pid"\necho "$@" > "$0.new"\n'
                       'mv "$0.new" "$0.arguments"\nexec sleep 1000\n')  # fmt: skip
    program.chmod(0o700)
    yield program
    with suppress(FileNotFoundError):
        os.kill(int((tmp_path / "browser.pid").read_text()), signal.SIGKILL)


def test_a_browser_in_the_foreground_gets_a_file_that_leads_to_the_page(
    foreground: Path, page: Browser
) -> None:
    arguments = foreground.with_name("browser.arguments")
    with Live(browser=foreground) as live:
        soon(arguments.exists)
        [url] = arguments.read_text().split()
        assert live.token not in url
        file = Path(url2pathname(urlsplit(url).path))
        assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
        assert live.asks("/", live.token) == 200
        page.driver.get(url)
        page.until(lambda: page.driver.current_url == live.address)
        page.until(lambda: page["simulated"].is_displayed())
        assert live.end() == 130
    assert not file.parent.exists()


@pytest.mark.parametrize("was_shown", [True, False])
def test_the_address_is_printed_again_if_the_page_was_not_shown(
    was_shown: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr(browser, "REMIND_S", 0.0)
    shown = threading.Event()
    if was_shown:
        shown.set()
    with browser.browser(ADDRESS, shown):
        soon(lambda: len(opened) == 1)
        for timer in threading.enumerate():
            if isinstance(timer, threading.Timer):
                timer.join()
        assert ADDRESS in Path(url2pathname(urlsplit(opened[0]).path)).read_text()
    told = capsys.readouterr().err
    assert told.count(f"the browser has not shown the page: open {ADDRESS} yourself") == (
        0 if was_shown else 1
    )


def test_without_a_folder_for_the_file_the_address_is_printed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(**_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(browser, "TemporaryDirectory", full)
    with browser.browser(ADDRESS, threading.Event()):
        assert re.search(f"No space left on device: open {ADDRESS}", capsys.readouterr().err)
