"""The state of a step that is tried again until it succeeds."""

import time
from collections.abc import Callable

LASTING = 2  # failures in a row: one that is over at the next try is counted, not reported


class RetryState:
    """Whether a step works that is tried again, and if not: why, since when, how often.

    Attributes
    ----------
    failures : int
        All failures so far.
    reason : str
        Why it fails now; empty: it works.

    Examples
    --------
    >>> state = RetryState()
    >>> state.failed("No space left on device")
    >>> state.is_lasting, state.change()
    (False, '')
    >>> state.failed("No space left on device")
    >>> state.change(), state.change()
    ('fails', '')
    >>> state.succeeded()
    >>> state.change(), state.failures
    ('works', 2)
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.failures = 0
        self.reason: str = ""
        self._clock = clock
        self._in_a_row = 0
        self._since_s = 0.0
        self._reported = ""  # reason of the failure that was reported last

    def failed(self, reason: str) -> None:
        """Note a failure."""
        if not self._in_a_row:
            self._since_s = self._clock()
        self._in_a_row += 1
        self.failures += 1
        self.reason = reason

    def succeeded(self) -> None:
        """Note that it works."""
        self._in_a_row = 0
        self.reason = ""

    @property
    def lasts_s(self) -> float:
        """For how long it fails, s; 0: it works."""
        return self._clock() - self._since_s if self._in_a_row else 0.0

    @property
    def is_lasting(self) -> bool:
        """Whether it failed more than once in a row."""
        return self._in_a_row >= LASTING

    def change(self) -> str:
        """Return "fails" or "works" once after each change to report, else ""."""
        if self.is_lasting and self.reason != self._reported:
            self._reported = self.reason
            return "fails"
        if self._reported and not self._in_a_row:
            self._reported = ""
            return "works"
        return ""


def reason_of(error: Exception) -> str:
    """Return why a step failed: the words of the system, or of palpate, or the type of the error."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return f"{type(error).__name__}: {error}"
