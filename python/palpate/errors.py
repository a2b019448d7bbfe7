"""Errors of palpate. Invalid arguments raise ValueError or TypeError."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pathlib import Path


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
        place = f"{path}" if line is None else f"{path}, line {line}"
        super().__init__(f"{place}: {reason}")
        self.path = path
        self.reason = reason
        self.line = line


class CalibrationError(PalpateError):
    """A calibration is not possible with these specimens, or a file is not a calibration."""
