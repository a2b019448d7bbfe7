"""What one client may cost: the measurement shares the processor with the page."""

import time
from collections.abc import Callable
from typing import NamedTuple


class Limit(NamedTuple):
    """A rate: so many per second, and so many at once after a pause."""

    per_s: float
    at_once: float


HEAD = 16384
"""Bytes of a request; it has no body. A browser sends about 700, and the cookies of other programs at the same host."""
LINES = 100
"""Lines of a request."""
PATIENCE_S = 5.0
"""Time for a whole request to arrive; then for a client to take what it has asked for."""
WAITING = 128
"""Connections that have not sent anything yet; when there are more, the oldest is closed."""
OPEN = 64
"""Connections with a request, web sockets included."""
REQUESTS = Limit(60, 180)
"""Requests with the token: a page makes about 50 when it is opened; more wait."""
STRANGERS = Limit(20, 20)
"""Requests without the token, which are refused in words; more are closed without a word."""
PAGES_OPENED = Limit(3, 32)
"""Web sockets opened."""
BYTES = Limit(4500, 16384)
"""Bytes on a web socket: a page confirms every fourth of 120 frames a second, with 40 bytes, and asks for views with 100."""
MESSAGES = Limit(60, 120)
"""Messages on a web socket."""
VIEWS = Limit(15, 15)
"""Views of one page: parts of the measurement, or of the recording, that it looks at; more wait."""
VIEWS_WAITING = 4
"""Of more the oldest are not sent: the page looks elsewhere by now."""
TRACES = Limit(20, 60)
"""Courses of touches that one page asks for; more are refused."""
COMMANDS = Limit(4, 12)
"""Buttons of all pages."""
FRAGMENTS = 16
"""Frames that continue one message."""
DOWNLOADS = 2
"""Recordings sent at the same time; others wait."""
DOWNLOADS_ASKED = 8
"""Recordings sent or waiting; more are refused."""
DOWNLOAD_PER_S = 8 << 20
"""Bytes per second of one download."""


class Bucket:
    """Counts against a limit.

    Parameters
    ----------
    limit : Limit
    clock : callable
        Returns the time, s.

    Examples
    --------
    >>> bucket = Bucket(Limit(per_s=1, at_once=2), clock=lambda: 0.0)
    >>> [bucket.take() for _ in range(3)]
    [True, True, False]
    """

    def __init__(self, limit: Limit, clock: Callable[[], float] = time.monotonic) -> None:
        self._limit, self._clock = limit, clock
        self._left, self._at = limit.at_once, clock()

    def take(self, count: float = 1) -> bool:
        """Take so many; False: there are not so many left, and none is taken."""
        now = self._clock()
        self._left = min(self._left + (now - self._at) * self._limit.per_s, self._limit.at_once)
        self._at = now
        if count > self._left:
            return False
        self._left -= count
        return True
