"""What palpate raises, besides ValueError and TypeError for bad arguments."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pathlib import Path


class PalpateError(Exception):
    """Base of every error of the package's own."""


class MissingExtra(PalpateError, ImportError):
    """Something optional is not installed; the text is the pip line that installs it."""


class SourceError(PalpateError):
    """A source of samples that cannot go on; the text says what happened and what to do."""


class DeviceNotFound(SourceError):
    """No device, not the one that was named, or it was unplugged."""


class DeviceRefused(DeviceNotFound):
    """A device that is there but may not be used: permission, another program, no firmware."""


class SourceTimeout(SourceError):
    """A device that is there but does not answer, or whose conversions never end."""


class ProtocolError(SourceError):
    """An answer that cannot be right."""


class RecordingError(PalpateError):
    """A file that cannot be read as a recording.

    Parameters
    ----------
    path : pathlib.Path
        The file.
    reason : str
        What is wrong with it, and what was expected.
    line : int, optional
        Where, counted from 1.
    """

    def __init__(self, path: Path, reason: str, line: int | None = None) -> None:
        place = f"{path}" if line is None else f"{path}, line {line}"
        super().__init__(f"{place}: {reason}")
        self.path = path
        self.reason = reason
        self.line = line


class CalibrationError(PalpateError):
    """Specimens from which no calibration can be made, or a file that is not one."""
