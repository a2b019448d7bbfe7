"""How a command ends: exit codes, and errors as one line."""

from palpate import DeviceNotFound, MissingExtra, PalpateError, SourceTimeout

UNEXPECTED = 1
USAGE = 2
NO_DEVICE = 3
BAD_DATA = 4
NOT_RELIABLE = 5
MISSING_EXTRA = 6
INTERRUPTED = 130


def code_of(error: Exception) -> int:
    """Return the exit code of an error."""
    if isinstance(error, MissingExtra):
        return MISSING_EXTRA
    if isinstance(error, DeviceNotFound | SourceTimeout):
        return NO_DEVICE
    return BAD_DATA if isinstance(error, PalpateError | OSError) else UNEXPECTED


def said_of(error: Exception) -> str:
    """Return an error as one line."""
    text = " ".join(str(error).splitlines())
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return text if isinstance(error, PalpateError | OSError) else f"unexpected: {type(error).__name__}: {text}"
