"""Plugin of pytest: which test executes what, how long it takes and whether it passes; or runs the chosen tests only.

MUTATION_RECORD=FILE records, MUTATION_RUN=FILE has the names of the tests to run, in this order.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

RECORD = os.environ.get("MUTATION_RECORD")
RUN = os.environ.get("MUTATION_RUN")
# of mutants.hpp; without it the lines of Python are recorded
BYTES = os.environ.get("PALPATE_EXECUTED")
tests: dict[str, Any] = {}
measured: Any = None
if RECORD and not BYTES:
    import coverage

    measured = coverage.Coverage(data_file=None, source=["python/palpate"], config_file=False)
    measured.start()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep the chosen tests, the fastest first."""
    if RUN:
        order = {name: place for place, name in enumerate(json.loads(Path(RUN).read_text()))}
        items[:] = sorted((i for i in items if i.nodeid in order), key=lambda i: order[i.nodeid])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Record what this test executes."""
    tests[item.nodeid] = {"s": 0.0, "passed": True, "mutants": []}
    if measured:
        measured.switch_context(item.nodeid)
    result = yield
    if RECORD and BYTES:
        executed = Path(BYTES).read_bytes()
        tests[item.nodeid]["mutants"] = [number for number, byte in enumerate(executed) if byte]
        with Path(BYTES).open("r+b") as file:  # in place: the extension has it mapped
            file.write(bytes(len(executed)))
    return result


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    tests[report.nodeid]["s"] += report.duration
    tests[report.nodeid]["passed"] &= report.passed
    if report.failed and RUN:
        Path(RUN).with_suffix(".failed").write_text(report.nodeid)


def pytest_unconfigure() -> None:
    """Write what was recorded; with coverage, the tests of each line: {file: {line: [test]}}."""
    lines: dict[str, Any] = {}
    if measured:
        measured.stop()
        data = measured.get_data()
        lines = {
            os.path.relpath(file): data.contexts_by_lineno(file) for file in data.measured_files()
        }
    if RECORD:
        Path(RECORD).write_text(json.dumps({"tests": tests, "lines": lines}))
