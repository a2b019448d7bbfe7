"""From a recording to its touches, and from several touches to the one to trust."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate._core import Touch, Tracker


class Channels(Protocol):
    """What `touches` needs of a recording."""

    @property
    def t_hard_s(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def t_soft_s(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def hard(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def soft(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def full_scale_pF(self) -> float: ...  # noqa: D102


def touches(recording: Channels, *, scene: str = "handheld", **settings: Any) -> list[Touch]:
    """Find the touches of a recording and estimate the ratio of each.

    Parameters
    ----------
    recording : Recording or Simulation
        `t_hard_s`, `t_soft_s` (s; nan where unknown), `hard` and `soft` (pF, baseline included),
        arrays of shape (n,); a reading with a nan capacitance, or one of `full_scale_pF` or more, is
        left out and counted.
    scene : str
        As in `Tracker`.
    **settings
        As in `Tracker`.

    Returns
    -------
    list of Touch
        In order of time; empty where nothing rose out of the noise.

    Raises
    ------
    ValueError
        An unknown scene or setting, a setting out of range.

    Examples
    --------
    >>> import palpate
    >>> from palpate import scenarios
    >>> [touch] = palpate.touches(scenarios.run("stiff-steady"))
    >>> abs(touch.ratio / scenarios.PROBE.ratio(8.68) - 1) < 3 * touch.standard_error / touch.ratio
    True
    """
    tracker = Tracker(scene, **{"full_scale": recording.full_scale_pF, **settings})
    timed = bool(np.isfinite(recording.t_hard_s).all() and np.isfinite(recording.t_soft_s).all())
    rows = np.arange(len(recording.hard)) * 1_000_000  # without times: equal steps, both channels at once
    t_hard, t_soft = (recording.t_hard_s, recording.t_soft_s) if timed else (rows, rows)
    tracker.process(t_hard, t_soft, recording.hard, recording.soft)
    tracker.finish()
    return tracker.touches if timed else [touch._untimed() for touch in tracker.touches]


def most_reliable(touches: Sequence[Touch], *, by: str = "standard_error") -> Touch:
    """Choose one of several touches on the same object.

    Parameters
    ----------
    touches : sequence of Touch
    by : str
        "standard_error": the smallest, among the touches without a flag. "covariance": the smallest
        among all, the paper's choice (Sec. IV).

    Returns
    -------
    Touch

    Raises
    ------
    ValueError
        No touch to choose from, or an unknown `by`.

    Examples
    --------
    >>> import palpate
    >>> from palpate import scenarios
    >>> four = palpate.touches(scenarios.run("four-specimens"))
    >>> palpate.most_reliable(four, by="covariance") in four
    True
    """
    if by == "covariance":
        candidates = list(touches)
    elif by == "standard_error":
        candidates = [touch for touch in touches if not touch.flags and np.isfinite(touch.standard_error)]
    else:
        raise ValueError(f"by: got {by!r}, allowed: 'standard_error', 'covariance'")
    if not candidates:
        flags = "; ".join(" ".join(touch.flags) or "no standard error" for touch in touches) or "none at all"
        raise ValueError(f"touches: got none to choose from ({flags}), allowed: at least one without a flag")
    return min(candidates, key=lambda touch: float(getattr(touch, by)))
