"""Where a decision changes: so that a test can look at both sides of a limit."""

from collections.abc import Callable


def edge(decides: Callable[[float], bool], no: float, yes: float) -> float:
    """Return a value at which a decision changes, by bisection from one that gives no and one that gives yes."""
    assert decides(yes)
    assert not decides(no)
    for _ in range(40):
        middle = (no + yes) / 2
        no, yes = (no, middle) if decides(middle) else (middle, yes)
    return yes


def around(limit: float) -> tuple[float, float]:
    """Return values just below and just above a limit."""
    return 0.997 * limit, 1.003 * limit
