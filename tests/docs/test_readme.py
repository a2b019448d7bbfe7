"""The README's commands and outputs are what they say."""

import doctest
import re
import shlex
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
from project import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks() -> list[tuple[str, str]]:
    """Return the commands that are followed by what they print."""
    return re.findall(r"```sh\n(.*?)\n```\n\n```text\n(.*?)```", README, re.DOTALL)


def test_the_first_command_ends_on_the_live_page(tmp_path: Path) -> None:
    command, shown = blocks()[0]
    live = shlex.split(command.split("&&")[-1])
    assert live == [".venv/bin/palpate", "live"]
    told = tmp_path / "told"
    with told.open("w") as file:
        done = subprocess.Popen(
            [sys.executable, "-m", "palpate", "live", "--port", "0"], stdout=file, stderr=file
        )
        while "Ctrl-C" not in told.read_text(encoding="utf-8") and done.poll() is None:
            time.sleep(0.1)
        address = re.findall(r"http://[^ ]*", told.read_text(encoding="utf-8"))[0]
        page = urllib.request.urlopen(address).read().decode()
        done.send_signal(signal.SIGINT)
        assert done.wait() == 130
    assert "<title>palpate</title>" in page
    own = re.compile(r":\d+/[\w-]{32}/ ")
    assert own.sub(":8746/ ", told.read_text(encoding="utf-8")) == own.sub(
        ":8746/ ", f"{shown}ended\n"
    )


def test_replay_prints_what_the_readme_shows() -> None:
    command, shown = blocks()[1]
    replay = shlex.split(command)
    assert replay[0] == ".venv/bin/palpate"
    done = subprocess.run(
        [sys.executable, "-m", "palpate", *replay[1:]],
        capture_output=True,
        encoding="utf-8",
        check=True,
        cwd=ROOT,
    )
    assert done.stderr + done.stdout == shown


def test_the_python_lines_print_what_the_readme_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    done = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert done.attempted >= 10
    assert done.failed == 0


def test_the_first_screen_has_purpose_picture_table_and_commands() -> None:
    """A visitor who reads 40 lines knows what it is for, and what to type."""
    first = README.splitlines()[:40]
    text = "\n".join(first)
    assert "two noisy signals" in first[2]
    assert "(docs/images/ratio.png)" in text
    assert "| Measure | Understand | Trust | Fast |" in text
    for need in ("apt install g++", "xcode-select --install", "Python 3.11"):
        assert need in text
    commands = [command for command, _ in blocks()[:2]]
    assert all(command in text for command in commands)


def test_the_readme_has_the_run_time_of_the_alternatives() -> None:
    """Its table is printed by a command, and its times are of one machine."""
    table = (ROOT / "docs" / "alternatives.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\w+).*\| ([\d,]+) \|$", table, re.MULTILINE)
    times_us = [(name, float(number.replace(",", "")) / 1e3) for name, number in rows]
    assert times_us[0][0] == "palpate"
    assert f"[{times_us[0][1]:.1f} µs a sample]" in README
    streams = [time for name, time in times_us if name not in ("palpate", "scipy")]
    assert f"{min(streams):.0f} to {max(streams):.0f} µs in other libraries" in README
