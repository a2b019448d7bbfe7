"""What palpate raises, besides ValueError and TypeError for bad arguments."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pathlib import Path


class PalpateError(Exception):
    """Base of every error of the package's own."""


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


class MissingExtraError(PalpateError, ImportError):
    """A package that only an extra of palpate needs is not installed.

    Parameters
    ----------
    package : str
        What cannot be imported.
    extra : str
        The extra of palpate that brings it.
    """

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(f"{package} is not installed; type: pip install 'palpate[{extra}]'")
        self.extra = extra
