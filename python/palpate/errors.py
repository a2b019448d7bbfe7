"""Errors of palpate, and the import of what may be missing. Invalid arguments raise ValueError or TypeError."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Collection, Iterable
    from pathlib import Path
    from typing import Any, Self

LONGEST = 60
"""Characters of a value from outside in a message, at most."""
_LIKE = 0.7  # share of the characters of two names that agree, at least


def quoted(value: object) -> str:
    """Return a value from outside as a message quotes it: its beginning, if it is long.

    Examples
    --------
    >>> quoted("C1 (pF)"), len(quoted("9" * 1_000_000)) < 100
    ("'C1 (pF)'", True)
    """
    return shortened(repr(value))


def printable(text: str, keep: str = "") -> str:
    r"""Return a text from outside for a terminal: control and hidden characters as escapes, but for those in `keep`.

    Examples
    --------
    >>> print(printable("run\x1b[2J.csv"))
    run\x1b[2J.csv
    """
    return (
        text
        if text.isprintable()
        else "".join(c if c.isprintable() or c in keep else repr(c)[1:-1] for c in text)
    )


def shortened(text: str, most: int = LONGEST) -> str:
    """Return a text as `printable`, or its beginning and its length."""
    shown = printable(text[:most])
    return shown if len(text) <= most else f"{shown}... ({len(text):,} characters)"


def listed(names: Collection[str], most: int = 20) -> str:
    """Return names as a message lists them, separated by commas.

    Examples
    --------
    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    shown = ", ".join(shortened(name) for name, _ in zip(names, range(most), strict=False))
    return shown if len(names) <= most else f"{shown} and {len(names) - most:,} more"


def unlike(given: object, allowed: Iterable[str], what: str = "") -> str:
    """Return what a message says of a wrong name: `what` it is of, the name, the allowed ones, and the most similar one.

    Examples
    --------
    >>> print(unlike("treshold", ["drift", "threshold"]))
    got 'treshold', allowed: drift, threshold; did you mean 'threshold'?
    """
    names = list(allowed)
    got = f"got {what} {quoted(given)}" if what else f"got {quoted(given)}"
    return f"{got}, allowed: {', '.join(names) or 'none'}{nearest(given, names)}"


def nearest(given: object, allowed: Iterable[str]) -> str:
    """Return the end of a message about a wrong name: the most similar name, or nothing.

    Examples
    --------
    >>> nearest("Handeld", ["paper", "handheld"]), nearest("x", ["paper"])
    ("; did you mean 'handheld'?", '')
    """
    text = str(given)
    if len(text) > LONGEST:
        return ""
    from difflib import get_close_matches

    names = {name.casefold(): name for name in allowed}
    found = get_close_matches(text.casefold(), names, 1, _LIKE)
    return f"; did you mean {names[found[0]]!r}?" if found else ""


class PalpateError(Exception):
    """Base class of all errors of palpate."""

    def __init__(self, *message: object) -> None:  # without it, inspect.signature knows none
        super().__init__(*message)


class MissingExtra(PalpateError, ImportError):
    """An optional package is missing. The message has the pip command that installs it."""


class SourceError(PalpateError):
    """A source failed. The message says what happened and what to do."""


class DeviceNotFound(SourceError):
    """The device was not found or was unplugged."""


class DeviceRefused(DeviceNotFound):
    """The device exists but cannot be used: no permission, used by another program, or no firmware."""


class SourceTimeout(SourceError):
    """The device does not answer in time."""


class ProtocolError(SourceError):
    """The device sent an invalid answer."""


class RecordingError(PalpateError):
    """A file is not a valid recording, or cannot be written.

    Parameters
    ----------
    path : pathlib.Path
        The file.
    reason : str
        What is wrong, and what was expected.
    line : int, optional
        Number of the line, counted from 1.
    """

    def __init__(self, path: Path, reason: str, line: int | None = None) -> None:
        place = printable(f"{path}" if line is None else f"{path}, line {line}")
        super().__init__(f"{place}: {reason}")
        self.path = path
        self.reason = reason
        self.line = line

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy it from its parts: it comes from another process, too."""
        return type(self), (self.path, self.reason, self.line)


class CalibrationError(PalpateError):
    """A calibration is not possible with these specimens, or a file is not a calibration."""


class SomeFailed(PalpateError, ExceptionGroup):
    """Some of several recordings failed; the results of the rest are kept.

    Attributes
    ----------
    results : list
        One for each recording, in order; of one that failed, its exception.
    exceptions : tuple of Exception
        Those in `results`, in order.
    """

    results: list[Any]

    @classmethod
    def of(cls, results: list[Any]) -> Self:
        """Return the error for these results."""
        failed = [result for result in results if isinstance(result, Exception)]
        error = cls(
            f"{len(failed)} of {len(results)} recordings failed; the first: {failed[0]}; all results are in .results",
            failed,
        )
        error.results = results
        return error


def need(module: str, extra: str) -> Any:
    """Import a module of an extra of palpate ("": of a package in none); MissingExtra has the pip command that installs it.

    Examples
    --------
    >>> need("math", "science").sqrt(4.0)
    2.0
    >>> need("no_such_package.part", "science")
    Traceback (most recent call last):
    palpate.errors.MissingExtra: no_such_package is not installed; type: pip install 'palpate[science]'
    """
    from importlib import import_module

    package = module.split(".")[0]
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        what = f"'palpate[{extra}]'" if extra else package
        raise MissingExtra(f"{package} is not installed; type: pip install {what}") from error


def display(function: str, *shown: Any) -> Any:
    """Call a function of palpate.display, as "cards.touches": a class names it, and imports it when it is shown."""
    module, _, name = function.partition(".")
    return getattr(need(f"palpate.display.{module}", ""), name)(*shown)
