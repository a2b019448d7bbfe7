"""Errors of palpate, and the import of optional packages.

Invalid arguments raise ValueError or TypeError.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pathlib import Path
    from typing import Any, Self

from palpate.messages import printable


class PalpateError(Exception):
    """Base class of all errors of palpate.

    Examples
    --------
    >>> import palpate
    >>> try:
    ...     palpate.open("serial:/dev/not-there")
    ... except palpate.errors.DeviceNotFound:
    ...     print("connect the device")
    ... except palpate.PalpateError as error:
    ...     print(f"another problem: {error}")
    connect the device
    """

    def __init__(self, *message: object) -> None:  # gives inspect.signature a signature
        super().__init__(*message)


class MissingExtra(PalpateError, ImportError):
    """An optional package is missing. The message has the pip command that installs it."""


class SourceError(PalpateError):
    """A source failed. The message says what happened and what to do."""


class DeviceNotFound(SourceError):
    """The device was not found or was unplugged."""


class DeviceRefused(DeviceNotFound):
    """The device exists but cannot be used: no permission, in use elsewhere, or no firmware."""


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
        place = f"{path}"
        if line is not None:
            place += f", line {line}"
        super().__init__(f"{printable(place)}: {reason}")
        self.path = path
        self.reason = reason
        self.line = line

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the error by its parts: it may come from another process."""
        return type(self), (self.path, self.reason, self.line)


class CalibrationError(PalpateError):
    """A calibration is not possible with these specimens, or a file is not a calibration."""


class CalibrationRefused(CalibrationError):
    """A calibration was not made for these readings: another chip, or a simulation."""


class SomeFailed(PalpateError, ExceptionGroup):
    """Some of several recordings failed; the results of the rest are kept.

    Attributes
    ----------
    results : list
        One for each recording, in order; the exception, if the recording failed.
    exceptions : tuple of Exception
        The exceptions in `results`, in order.
    """

    results: list[Any]

    @classmethod
    def of(cls, results: list[Any]) -> Self:
        """Return the error for these results."""
        failed = [result for result in results if isinstance(result, Exception)]
        error = cls(
            f"{len(failed)} of {len(results)} recordings failed; the first: {failed[0]}; "
            "all results are in .results",
            failed,
        )
        error.results = results
        return error


def need(module: str, extra: str) -> Any:
    """Import a module that an extra of palpate installs; "": no extra installs it.

    The message of MissingExtra has the pip command that installs its package.

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
        requirement = f"'palpate[{extra}]'" if extra else package
        raise MissingExtra(
            f"{package} is not installed; type: pip install {requirement}"
        ) from error
