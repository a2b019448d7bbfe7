"""Day and month in dates like 11/21/2026: which comes first."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Order:
    """Days and months of dates, and whether their order is known.

    Attributes
    ----------
    said : str
    month, day : numpy.ndarray, shape (n,)
    known : bool
        Whether a number above 12 settles it; if not, only the differences of dates hold.
    notes : list of str
    """

    said: str
    month: NDArray[np.int32]
    day: NDArray[np.int32]
    known: bool
    notes: list[str] = field(default_factory=list)


def order_of(year: NDArray[np.int32], first: NDArray[np.int32], second: NDArray[np.int32]) -> Order:
    """Return the order of day and month: that without a month above 12, else that in which the dates are closer.

    Parameters
    ----------
    year, first, second : numpy.ndarray, shape (n,)
        The numbers of the dates; second or first is the day.
    """
    day_first, month_first = Order(" day/month", second, first, True), Order(" month/day", first, second, True)
    if first.max() > 12:
        return day_first
    if second.max() > 12:
        return month_first
    spans = [np.ptp(year * 372 + order.month * 31 + order.day) for order in (day_first, month_first)]
    nearer = day_first if spans[0] <= spans[1] else month_first
    notes = []
    if spans[0] or spans[1]:
        notes = [f"dates are read as{nearer.said}, in which they are closest: no number above 12 settles it"]
    return Order(nearer.said if notes else "", nearer.month, nearer.day, False, notes)
