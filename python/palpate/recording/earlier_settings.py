"""Settings in the sidecars of earlier versions, by their names of today."""

import math
from collections.abc import Mapping
from typing import Any

from palpate.design import run_length
from palpate.files import Json

_DEFAULT = (0.75, 10.0, 3.0)  # drift, threshold and clip, where nobody chose them
_INTERVALS = (10.0, 1e12)  # samples, that the estimators allow
_FINITE = 1000.0  # a larger threshold was for no alarm
# of the scene sliding, whose estimator was that of handheld, and had this guard
_OF_HANDHELD = (
    "steady",
    "initial_covariance",
    "max_covariance",
    "confirmed",
    "contact_exponent",
    "age",
)
_GUARD = 5.0


def renamed(settings: Mapping[str, Any]) -> Json:
    """Return scene and settings of a tracker with the false alarms that its CUSUM was for.

    The scenes handheld and sliding had `drift` and `threshold`, as `paper` still has. They become
    `false_alarm_interval` and `smallest_shift`: those from which `palpate.design.cusum` computes
    them, the nearest that is allowed, or the defaults for what were the defaults.

    Examples
    --------
    >>> renamed({"scene": "handheld", "drift": 0.75, "threshold": 10.0, "steady": 0.99})
    {'scene': 'handheld', 'steady': 0.99}
    >>> found = renamed({"scene": "sliding", "drift": 0.5, "threshold": 6.0})
    >>> round(found["false_alarm_interval"]), found["smallest_shift"]
    (1354, 1.0)
    """
    now = dict(settings)
    if settings.get("scene") == "sliding" and "steady" in settings:
        now = _of_windows(settings)
    if settings.get("scene") == "paper" or not settings.keys() & {"drift", "threshold"}:
        return now
    chosen = (now.pop("drift", 0.75), now.pop("threshold", 10.0), now.get("clip", 3.0))
    if chosen == _DEFAULT:
        return now
    if not all(_is_number(value) for value in chosen):
        return dict(settings)
    return now | _goal(*chosen)


def _of_windows(settings: Mapping[str, Any]) -> Json:
    now = {name: value for name, value in settings.items() if name not in _OF_HANDHELD}
    if now.get("guard") == _GUARD:
        del now["guard"]
    return now


def _goal(drift: float, threshold: float, clip: float) -> dict[str, float]:
    interval = math.inf
    if threshold <= _FINITE:
        found = run_length(drift, max(threshold, 0.0), clip=clip) / 2
        interval = min(max(found, _INTERVALS[0]), _INTERVALS[1])
    shift = min(max(2 * drift, 1e-3), 1.5 * clip)
    return {"false_alarm_interval": interval, "smallest_shift": shift}


def _is_number(value: object) -> bool:
    return type(value) is float or (type(value) is int and abs(value) < 2**63)
