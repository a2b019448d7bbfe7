"""Tables of four presses by a hand, in which something fails."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PERIOD_S, PRESSES_S, HOLD_S = 0.026, (3.0, 12.0, 21.0, 30.0), 6.0
END_PF = 4.096
JUMP_S, JUMP_PF = 19.9, 1.1  # at rest


def _pressed(t: Array) -> Array:
    """Return how deep the probe is pressed at each time, with the tremor of a hand."""
    depth = np.zeros_like(t)
    for begin_s in PRESSES_S:
        rise = np.clip((t - begin_s) / 0.4, 0, 1)
        fall = np.clip((t - begin_s - HOLD_S) / 0.3, 0, 1)
        tremor = 0.08 * np.sin(2 * np.pi * 6.3 * t + begin_s)
        depth = np.maximum(depth, (rise - fall) * (1 + tremor))
    return depth


def _channels() -> tuple[Array, Array, Array]:
    """Return the times, s, and both channels without a fault, pF."""
    random = np.random.default_rng(3)
    t = np.arange(0.0, 40.0, PERIOD_S)
    hard = 1.5 + 0.75 * _pressed(t) + random.normal(0, 3e-5, len(t))
    soft = 1.2 + 0.25 * _pressed(t + PERIOD_S / 2) + random.normal(0, 3e-5, len(t))
    return t, hard, soft


def _written(folder: Path, name: str, t: Array, hard: Array, soft: Array) -> Path:
    path = folder / f"{name}.csv"
    columns = [t, t + PERIOD_S / 2, hard, soft]
    header = "time (s),soft time (s),hard (pF),soft (pF)"
    np.savetxt(path, np.column_stack(columns), "%.6f", ",", header=header, comments="")
    return path


def healthy(folder: Path) -> Path:
    """Write presses without a fault."""
    return _written(folder, "healthy", *_channels())


def jumped(folder: Path) -> Path:
    """Write a hard channel that jumps at rest."""
    t, hard, soft = _channels()
    hard[t > JUMP_S] += JUMP_PF
    return _written(folder, "jumped", t, hard, soft)


def saturated(folder: Path) -> Path:
    """Write a hard channel that runs into the end of its range in each press."""
    t, hard, soft = _channels()
    return _written(folder, "saturated", t, np.minimum(hard + 2.1, END_PF), soft)


def loose(folder: Path) -> Path:
    """Write a soft channel that falls back to its level at rest for one reading of sixteen."""
    t, hard, soft = _channels()
    soft[np.random.default_rng(4).random(len(t)) < 1 / 16] = 1.2
    return _written(folder, "loose", t, hard, soft)


def falling(folder: Path) -> Path:
    """Write channels that both fall when pressed."""
    t, hard, soft = _channels()
    return _written(folder, "falling", t, 3 - hard, 3 - soft)


def at_the_lower_end(folder: Path) -> Path:
    """Write both channels at the lower end of their range for ever."""
    t, hard, _ = _channels()
    nothing = np.full_like(hard, -END_PF)
    return _written(folder, "stuck", t, nothing, nothing)
