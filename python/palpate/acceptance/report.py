"""The report of an acceptance: steps with their verdicts, in one JSON file."""

import json
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, Self

from palpate._core import __version__
from palpate.messages import shortened

SCHEMA = "palpate-kit-report-1"
_LONGEST_ERROR = 1000  # characters

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


@dataclass(frozen=True)
class AcceptanceReport:
    """All results of an acceptance; `source` has no file path, `registers` are in hexadecimal."""

    started: str
    source: str
    versions: Mapping[str, str]
    device: Mapping[str, Any]
    registers: str
    steps: Sequence[Step]
    stopped: str = ""

    def to_json(self) -> str:
        """Return the report as JSON."""
        return json.dumps({"schema": SCHEMA, **asdict(self)}, indent=2, default=str) + "\n"


def versions() -> dict[str, str]:
    """Return the versions of this installation."""
    return {
        "palpate": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
    }


def without_path(source: str) -> str:
    """Return a source without the path of a firmware file.

    Examples
    --------
    >>> without_path("usb:?firmware=/home/ann/Icv_usb.hex&capf=0")
    'usb:?firmware=...&capf=0'
    """
    return re.sub(r"(firmware=)[^&]*", r"\1...", source)


def utc_now() -> str:
    """Return the time, UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")
