"""Plugin of pytest: records which mutants each test executes, how long it takes and whether it passes.

MUTATION_RECORD=FILE is written; PALPATE_EXECUTED is the file in which mutants.hpp marks what was executed.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

RECORD, EXECUTED = os.environ.get("MUTATION_RECORD"), Path(os.environ["PALPATE_EXECUTED"])
tests: dict[str, Any] = {}


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Record what this test executes."""
    tests[item.nodeid] = {"s": 0.0, "passed": True}
    result = yield
    executed = EXECUTED.read_bytes()
    tests[item.nodeid]["mutants"] = [number for number, byte in enumerate(executed) if byte]
    with EXECUTED.open("r+b") as file:  # in place: the extension has it mapped
        file.write(bytes(len(executed)))
    return result


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    tests[report.nodeid]["s"] += report.duration
    tests[report.nodeid]["passed"] &= report.passed


def pytest_unconfigure() -> None:
    if RECORD:
        Path(RECORD).write_text(json.dumps(tests))
