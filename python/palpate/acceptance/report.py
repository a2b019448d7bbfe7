"""One step of the acceptance, and the report of all: one JSON file, written by one person, read by another."""

import json
import platform
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from palpate._core import __version__
from palpate.errors import PalpateError
from palpate.files import read_bytes
from palpate.messages import shortened

OK, WRONG, NOT_DONE = "ok", "wrong", "not done"
SCHEMA = "palpate-kit-report-1"
LARGEST = 1_000_000  # bytes of a report
_LONGEST = 1000  # characters of an error in a step
_REMEDY = "damaged, cut off, or another file: take it again from whoever made it, or run palpate kit accept again"
_MARKS = {OK: "ok", WRONG: "!!", NOT_DONE: "--"}

Value = bool | int | float | str | None


@dataclass(frozen=True)
class Step:
    """One step."""

    name: str
    verdict: str
    measured: str
    expected: str = ""
    do: tuple[str, ...] = ()
    values: Mapping[str, Value] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """Return the step as lines of text."""
        expected = (
            f" (expected: {self.expected})" if self.expected and self.verdict != NOT_DONE else ""
        )
        return [
            f"{_MARKS[self.verdict]}  {self.name}: {self.measured}{expected}",
            *(f"      {do}" for do in self.do),
        ]


def judged(name: str, measured: str, expected: str, *do: str, right: bool, **values: Value) -> Step:
    """Return a step that was done; `do`, what to do, is kept only if it is not right."""
    return Step(
        name,
        OK if right else WRONG,
        measured,
        expected,
        () if right else tuple(filter(None, do)),
        values,
    )


def left_out(name: str, why: str) -> Step:
    """Return a step that was not done."""
    return Step(name, NOT_DONE, why)


def one_line(error: Exception) -> str:
    """Return the message of an error as a step shows it."""
    return shortened(" ".join(str(error).split()), _LONGEST)


def summary(steps: Iterable[Step]) -> str:
    """Return how many steps have each verdict."""
    found = [step.verdict for step in steps]
    return ", ".join(f"{found.count(verdict)} {verdict}" for verdict in _MARKS)


class ReportError(PalpateError):
    """A file is not a report of an acceptance."""


@dataclass(frozen=True)
class AcceptanceReport:
    """All that an acceptance found."""

    started: str
    source: str
    versions: Mapping[str, str]
    device: Mapping[str, Any]
    registers: str
    steps: tuple[Step, ...]
    stopped: str = ""

    def text(self) -> str:
        """Return the report as JSON."""
        return json.dumps({"schema": SCHEMA, **asdict(self)}, indent=2, default=str) + "\n"

    def lines(self) -> list[str]:
        """Return what it is a report of, and the steps, as lines of text."""
        title = f"{self.source}, {self.started}, palpate {self.versions.get('palpate', '?')}"
        return [title, *(line for step in self.steps for line in step.lines())]


def now() -> str:
    """Return the time, UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def made(
    started: str,
    source: str,
    device: Mapping[str, Any],
    registers: bytes,
    steps: Iterable[Step],
    stopped: str = "",
) -> AcceptanceReport:
    """Return the report of these steps, with the versions of this installation; no path of a file is in it."""
    versions = {
        "palpate": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
    }
    shown = re.sub(r"(firmware=)[^&]*", r"\1...", source)
    return AcceptanceReport(
        started, shown, versions, device, registers.hex(" "), tuple(steps), stopped
    )


def load(path: Path) -> AcceptanceReport:
    """Read a report; raises OSError, or ReportError: another schema, a part that is missing or unknown, odd characters."""
    data = read_bytes(path, LARGEST)
    try:
        document = json.loads(data)
        if document.pop("schema", "") != SCHEMA:
            raise ValueError(f"no schema {SCHEMA} in it")
        steps = tuple(
            Step(**{**given, "do": tuple(given["do"])}) for given in document.pop("steps")
        )
        found = AcceptanceReport(steps=steps, **document)
        if not all(map(str.isprintable, [found.stopped, *found.lines()])):
            raise ValueError("its texts are not printable")
        return found
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ReportError(
            f"{path}: not a report ({shortened(str(error), 200)}): {_REMEDY}"
        ) from error
