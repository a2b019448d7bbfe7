"""Fixtures, the rule for missing tools, and the summary of what the property tests found."""

import os
import shutil
import sys
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).parents[1]

# Seeds are fixed: the same examples in every run.
settings.register_profile("palpate", max_examples=200, deadline=None, derandomize=True, database=None)
settings.load_profile("palpate")


class Tally:
    """Examples run, and the largest deviations seen, over the whole session."""

    def __init__(self) -> None:
        self.examples: Counter[str] = Counter()
        self.largest: dict[str, float] = {}
        self.faults: dict[str, list[int]] = {}

    def count(self, what: str) -> None:
        """Note one example of a property."""
        self.examples[what] += 1

    def note(self, what: str, value: float) -> None:
        """Keep the largest value of its name."""
        self.largest[what] = max(value, self.largest.get(what, 0.0))

    def fault(self, what: str, rows: int, lost: int) -> None:
        """Note one try of a fault: rows that were acknowledged by then, and those of them that were lost."""
        counts = self.faults.setdefault(what, [0, 0, 0])
        self.faults[what] = [old + new for old, new in zip(counts, (1, rows, max(lost, 0)), strict=True)]


_TALLY = Tally()


@pytest.fixture(scope="session")
def tally() -> Tally:
    return _TALLY


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Real recordings beside the project; they are not part of it."""
    folder = ROOT.parent / "shared" / "recordings"
    if not folder.is_dir():
        pytest.skip("no real recordings beside the project")
    return folder


def need(tool: str) -> str:
    """Path of a program that a test cannot do without: missing, it is a skip, or a failure where all must run."""
    path = shutil.which(tool)
    if path is None:
        message = f"{tool} is not installed"
        if os.environ.get("PALPATE_NO_SKIP"):
            pytest.fail(message)
        pytest.skip(message)
    return path


@pytest.fixture(scope="session")
def cmake() -> str:
    """Find cmake beside the interpreter, as the test extra installs it, or the system's."""
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return need("cmake")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if _TALLY.faults:
        terminalreporter.section("faults")
        terminalreporter.write_line(f"{'':52} {'tries':>6} {'rows':>9} {'lost':>5}")
        for what, (tries, rows, lost) in _TALLY.faults.items():
            terminalreporter.write_line(f"{what:52} {tries:6} {rows:9} {lost:5}")
    if not _TALLY.examples:
        return
    terminalreporter.section("property tests")
    terminalreporter.write_line(f"hypothesis examples: {sum(_TALLY.examples.values())}")
    for what, value in sorted(_TALLY.largest.items()):
        terminalreporter.write_line(f"largest {what}: {value:.3g}")
