"""The report of an acceptance: one JSON file, to attach to an issue. It is written by one person, read by another."""

import json
import platform
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from palpate._core import __version__
from palpate.errors import PalpateError, quoted, shortened
from palpate.files import read_bytes
from palpate.kit.step import LONGEST, VERDICTS, Step
from palpate.recording.sidecar import is_deep

SCHEMA = "palpate-kit-report-1"
LARGEST = 1_000_000
"""Bytes of a report, at most."""
MOST_STEPS = 200
_LONGEST_REASON = 200
_REMEDY = "damaged, cut off, or another file: take it again from whoever made it, or run palpate kit accept again"


class ReportError(PalpateError):
    """A file is not a report of an acceptance."""


@dataclass(frozen=True)
class Report:
    """All that an acceptance found.

    Attributes
    ----------
    started : str
        UTC, ISO 8601.
    source : str
        Name of the source, without the path of a firmware.
    versions : mapping of str
    device : mapping
        Description of the source after the steps.
    registers : str
        All registers after the reset, in hexadecimal; empty: not read.
    steps : tuple of Step
    stopped : str
        Why it ended before the last step; empty: it did not.
    """

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

    def title(self) -> str:
        """Return what it is a report of, in one line."""
        return f"{self.source}, {self.started}, palpate {self.versions.get('palpate', '?')}"


def now() -> str:
    """Return the time, UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def made(
    started: str, source: str, device: Mapping[str, Any], registers: bytes, steps: Iterable[Step], stopped: str = ""
) -> Report:
    """Return the report of these steps, with the versions of this installation; no path of a file is in it."""
    versions = {"palpate": __version__, "python": platform.python_version(), "system": platform.platform()}
    shown = re.sub(r"(firmware=)[^&]*", r"\1...", source)
    return Report(started, shown, versions, device, registers.hex(" "), tuple(steps), stopped)


def load(path: Path) -> Report:
    """Read a report.

    Parameters
    ----------
    path : pathlib.Path

    Returns
    -------
    Report

    Raises
    ------
    ReportError
        It is not a report: too large, not JSON, another schema, or a part that is missing, of another type, too long,
        or not printable.
    OSError
        The file cannot be read.
    """
    data = read_bytes(path, LARGEST)
    try:
        document = json.loads(data.decode(), parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise ReportError(f"{path}: not JSON ({shortened(str(error), _LONGEST_REASON)}): {_REMEDY}") from error
    try:
        return _report(document)
    except ValueError as error:
        raise ReportError(f"{path}: not a report: {error}: {_REMEDY}") from error


def _no_constant(text: str) -> None:
    raise ValueError(f"got {text}, allowed: numbers")


def _report(document: Any) -> Report:
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise ValueError(f"no schema {SCHEMA} in it")
    given = {name: document[name] for name in document if name != "schema"}
    _exactly("report", given, _REPORT)
    if len(given["steps"]) > MOST_STEPS:
        raise ValueError(f"steps: got {len(given['steps'])}, allowed: {MOST_STEPS} at most")
    return Report(**{**given, "steps": tuple(map(_step, given["steps"]))})


def _step(given: Any) -> Step:
    _exactly("step", given, _STEP)
    if given["verdict"] not in VERDICTS:
        raise ValueError(f"verdict: got {quoted(given['verdict'])}, allowed: {', '.join(VERDICTS)}")
    return Step(**{**given, "do": tuple(given["do"])})


def _exactly(what: str, given: Any, wanted: Mapping[str, Callable[[Any], bool]]) -> None:
    if not isinstance(given, dict):
        raise ValueError(f"{what}: got {quoted(given)}, allowed: names and values")  # noqa: TRY004  of a file
    if set(given) != set(wanted):
        wrong = min(set(given) ^ set(wanted))
        raise ValueError(f"{what}: {quoted(wrong)} is {'unknown' if wrong in given else 'missing'}")
    for name, right in wanted.items():
        if not right(given[name]):
            raise ValueError(f"{name}: got {quoted(given[name])}: another type, too long, or not printable")


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and len(value) <= LONGEST and (value.isprintable() or not value)


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


def _is_plain(value: Any) -> bool:
    """Return whether it is an object of numbers, texts and nothing deeper."""
    return isinstance(value, dict) and all(
        _is_text(name) and (inner is None or isinstance(inner, bool | int | float) or _is_text(inner))
        for name, inner in value.items()
    )


_STEP = {"name": _is_text, "verdict": _is_text, "measured": _is_text, "expected": _is_text, "do": _are_texts,
         "values": _is_plain}  # fmt: skip
_REPORT: dict[str, Callable[[Any], bool]] = {
    "started": _is_text,
    "source": _is_text,
    "versions": _is_plain,
    "device": lambda value: isinstance(value, dict) and not is_deep(value),
    "registers": _is_text,
    "steps": lambda value: isinstance(value, list),
    "stopped": _is_text,
}
