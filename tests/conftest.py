"""Fixtures, the profiles of the property tests, and the summary of what they found."""

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest
from effort import SEED, Tally, draws, lines
from hypothesis import settings
from project import ROOT, need

# The same examples in every run, unless .ci/nightly gives a seed. No database, which workers would share.
settings.register_profile(
    "palpate", max_examples=draws(200), deadline=None, derandomize=SEED == 0, database=None
)
settings.load_profile("palpate")

# A shell starts what it runs in the background deaf to SIGINT, and children inherit that: those that tests interrupt, too.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# The same with nohup and SIGHUP.
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Give hypothesis the seed, before its own plugin looks for one."""
    if SEED:
        config.option.hypothesis_seed = SEED


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One more worker than processors: many tests wait for a clock or a child."""
    return (os.cpu_count() or 1) + 1


@pytest.fixture
def tally(request: pytest.FixtureRequest) -> Tally:
    return Tally(request.node.user_properties)


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Real recordings beside the project; they are not part of it."""
    folder = ROOT.parent / "shared" / "recordings"
    if not folder.is_dir():
        pytest.skip("no real recordings beside the project")
    return folder


@pytest.fixture(scope="session")
def cmake() -> str:
    """Find cmake beside the interpreter, as the test extra installs it, or the system's."""
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return need("cmake")


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """One headless browser for all tests of a worker; `reset` gives it an empty page."""
    from live_browser import browser

    with browser(tmp_path_factory.mktemp("downloads")) as opened:
        yield opened


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Shuffle the tests if there is a seed for their order."""
    if order := os.environ.get("PALPATE_ORDER"):
        Random(order).shuffle(items)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    reports = (report for reports in terminalreporter.stats.values() for report in reports)
    found = [
        each
        for report in reports
        if getattr(report, "when", "") == "call"
        for each in report.user_properties
    ]
    if found:
        terminalreporter.section("measured")
    for line in lines(found):
        terminalreporter.write_line(line)


@pytest.fixture
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait for no disk: a test of what is in the files does not cut the power."""
    monkeypatch.setattr("os.fsync", lambda _: None)
    monkeypatch.setattr("os.fdatasync", lambda _: None, raising=False)
