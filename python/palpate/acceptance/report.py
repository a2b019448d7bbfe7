"""The report of an acceptance: steps with their verdicts, in one JSON file."""

import json
import platform
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from palpate._core import __version__
from palpate.errors import PalpateError
from palpate.files import read_bytes
from palpate.messages import shortened

SCHEMA = "palpate-kit-report-1"
LARGEST = 1_000_000  # bytes of a report
_LONGEST_ERROR = 1000  # characters
_LONGEST_REASON = 200
_REMEDY = (
    "damaged, cut off, or another file: take it again from whoever made it, "
    "or run palpate kit accept again"
)

Value = bool | int | float | str | None


class Verdict(StrEnum):
    """The result of a step."""

    OK = "ok"
    WRONG = "wrong"
    NOT_DONE = "not done"


_MARKS = {Verdict.OK: "ok", Verdict.WRONG: "!!", Verdict.NOT_DONE: "--"}


@dataclass(frozen=True)
class Step:
    """One step: what was measured, what is expected, and what to do if it is wrong."""

    name: str
    verdict: Verdict
    measured: str
    expected: str = ""
    do: tuple[str, ...] = ()
    values: Mapping[str, Value] = field(default_factory=dict)

    @classmethod
    def judged(
        cls,
        name: str,
        measured: str,
        expected: str,
        *remedies: str,
        right: bool,
        values: Mapping[str, Value] | None = None,
    ) -> Self:
        """Return a step that was done; the remedies are kept only if it is not right."""
        if right:
            return cls(name, Verdict.OK, measured, expected, values=values or {})
        return cls(name, Verdict.WRONG, measured, expected, remedies, values or {})

    @classmethod
    def not_done(cls, name: str, why: str) -> Self:
        """Return a step that was not done."""
        return cls(name, Verdict.NOT_DONE, why)

    def lines(self) -> list[str]:
        """Return the step as lines of text."""
        line = f"{_MARKS[self.verdict]}  {self.name}: {self.measured}"
        if self.expected and self.verdict != Verdict.NOT_DONE:
            line += f" (expected: {self.expected})"
        return [line, *(f"      {remedy}" for remedy in self.do)]


def error_line(error: Exception) -> str:
    """Return the message of an error as a step shows it: in one line."""
    return shortened(" ".join(str(error).split()), _LONGEST_ERROR)


def count_verdicts(steps: Iterable[Step]) -> str:
    """Return how many steps have each verdict, as text."""
    found = [step.verdict for step in steps]
    return ", ".join(f"{found.count(verdict)} {verdict}" for verdict in Verdict)


class ReportError(PalpateError):
    """A file is not a report of an acceptance."""


@dataclass(frozen=True)
class AcceptanceReport:
    """All results of an acceptance."""

    started: str
    source: str
    versions: Mapping[str, str]
    device: Mapping[str, Any]
    registers: str
    steps: tuple[Step, ...]
    stopped: str = ""

    def to_json(self) -> str:
        """Return the report as JSON."""
        return json.dumps({"schema": SCHEMA, **asdict(self)}, indent=2, default=str) + "\n"

    def lines(self) -> list[str]:
        """Return a title and the steps, as lines of text."""
        title = f"{self.source}, {self.started}, palpate {self.versions.get('palpate', '?')}"
        return [title, *(line for step in self.steps for line in step.lines())]


def utc_now() -> str:
    """Return the time, UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def new_report(
    started: str,
    source: str,
    device: Mapping[str, Any],
    registers: bytes,
    steps: Iterable[Step],
    stopped: str = "",
) -> AcceptanceReport:
    """Return the report of these steps, with the versions of this installation and no file path."""
    versions = {
        "palpate": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
    }
    without_path = re.sub(r"(firmware=)[^&]*", r"\1...", source)
    return AcceptanceReport(
        started, without_path, versions, device, registers.hex(" "), tuple(steps), stopped
    )


def read_report(path: Path) -> AcceptanceReport:
    """Read a report.

    Raises OSError, or ReportError: another schema, a part that is missing or unknown, or characters
    that cannot be printed.
    """
    data = read_bytes(path, LARGEST)
    try:
        return _parse(json.loads(data))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        reason = shortened(str(error), _LONGEST_REASON)
        raise ReportError(f"{path}: not a report ({reason}): {_REMEDY}") from error


def _parse(document: dict[str, Any]) -> AcceptanceReport:
    if document.pop("schema", "") != SCHEMA:
        raise ValueError(f"no schema {SCHEMA} in it")
    steps = tuple(_parse_step(**step) for step in document.pop("steps"))
    report = AcceptanceReport(steps=steps, **document)
    for text in [report.stopped, *report.lines()]:
        if not text.isprintable():
            raise ValueError("its texts are not printable")
    return report


def _parse_step(verdict: str, do: list[str], **texts: Any) -> Step:
    return Step(verdict=Verdict(verdict), do=tuple(do), **texts)
