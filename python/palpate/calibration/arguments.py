"""The arguments of a calibration, checked."""

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def check_level(level: float) -> None:
    """Refuse a probability that is not between 0 and 1."""
    if not 0 < level < 1:
        raise ValueError(f"level: got {level}, allowed: 0 < level < 1")


def check_measured(ratio: float, standard_error: float, touches: float) -> None:
    """Refuse a ratio, a standard error or a number of touches that cannot be."""
    if not isfinite(ratio):
        raise ValueError(f"ratio: got {ratio}, allowed: a finite number")
    if not (isfinite(standard_error) and standard_error >= 0):
        raise ValueError(f"standard_error: got {standard_error}, allowed: 0 or more, or None")
    if not touches >= 1:
        raise ValueError(f"touches: got {touches}, allowed: 1 or more")


def checked(
    ratios: ArrayLike, moduli: ArrayLike, standard_errors: ArrayLike | None, touches: ArrayLike | None
) -> dict[str, Array]:
    """Return the data of a fit as arrays of one length, by name; refuse what cannot be fitted."""
    shape = np.shape(ratios)
    count = np.asarray(1.0 if touches is None else touches, dtype=float)
    given = {
        "ratios": ratios,
        "moduli": moduli,
        "standard_errors": np.zeros(shape) if standard_errors is None else standard_errors,
        "touches": np.broadcast_to(count, shape) if count.ndim == 0 else count,
    }
    data = {name: np.array(values, dtype=float) for name, values in given.items()}
    for name, values in data.items():
        if values.ndim != 1 or values.shape != shape:
            raise ValueError(f"{name}: got shape {values.shape}, allowed: (n,), the same for all")
        least = 0.0 if name == "standard_errors" else np.nextafter(0.0, 1.0) if name != "touches" else 1.0
        wrong = ~(np.isfinite(values) & (values >= least))
        if wrong.any():
            allowed = {"standard_errors": "0 or more", "touches": "1 or more"}.get(name, "positive numbers")
            raise ValueError(f"{name}: got {values[wrong][0]}, allowed: {allowed}")
    return data
