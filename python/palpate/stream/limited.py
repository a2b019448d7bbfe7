"""Steps of a source that may not return: in a thread of their own, with a limit."""

from collections.abc import Callable
from threading import Thread

from palpate.errors import SourceTimeout

_PARTS = 10


def limited(step: Callable[[], object], limit_s: float, what: str) -> None:
    """Run a step, and wait for it; raise what it raises.

    Parameters
    ----------
    step : callable
    limit_s : float
        Longest time to wait, s.
    what : str
        The step, for the message.

    Raises
    ------
    SourceTimeout
        It takes longer; its thread still runs.

    Examples
    --------
    >>> from threading import Event
    >>> limited(Event().set, 1.0, "the lamp did not light")
    """
    raised: list[BaseException] = []

    def run() -> None:
        try:
            step()
        except BaseException as error:  # noqa: BLE001  raised again in the thread that waits
            raised.append(error)

    thread = Thread(target=run, name="palpate-step", daemon=True)
    thread.start()
    if not ended(thread, limit_s):
        raise SourceTimeout(f"{what} within {limit_s:g} s; it still runs")
    if raised:
        raise raised[0]


def ended(thread: Thread, limit_s: float) -> bool:
    """Wait for the end of a thread; return whether it came. A time in which the whole program stood still counts as one part.

    Examples
    --------
    >>> thread = Thread(target=int)
    >>> thread.start()
    >>> ended(thread, 1.0)
    True
    """
    for _ in range(_PARTS):
        thread.join(limit_s / _PARTS)
        if not thread.is_alive():
            return True
    return False
