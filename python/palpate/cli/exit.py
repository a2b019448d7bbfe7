"""How a command ends: exit codes, and errors as one line."""

from palpate import DeviceNotFound, MissingExtra, PalpateError, SourceTimeout
from palpate.errors import shortened

UNEXPECTED = 1
USAGE = 2
NO_DEVICE = 3
BAD_DATA = 4
NOT_RELIABLE = 5
MISSING_EXTRA = 6
INTERRUPTED = 130
_LONGEST = 1500  # characters of a message


def code_of(error: Exception) -> int:
    """Return the exit code of an error."""
    if isinstance(error, MissingExtra):
        return MISSING_EXTRA
    if isinstance(error, DeviceNotFound | SourceTimeout):
        return NO_DEVICE
    return BAD_DATA if isinstance(error, PalpateError | OSError) else UNEXPECTED


def said_of(error: Exception) -> str:
    """Return an error as one line."""
    text = one_line(str(error))
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return text if isinstance(error, PalpateError | OSError) else f"unexpected: {type(error).__name__}: {text}"


def one_line(message: str) -> str:
    """Return a message as one line that fits a screen; libraries quote what they were given as a whole."""
    return shortened(" ".join(message.splitlines()), _LONGEST)
