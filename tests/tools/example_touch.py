"""A touch for a test that is about some of its values."""

from math import nan
from typing import Any

from palpate.flags import Flag
from palpate.touch import Touch

_VALUES: dict[str, Any] = {
    "start": 0,
    "start_s": 0.0,
    "samples": 250,
    "ratio": 4.0,
    "covariance": 0.1,
    "standard_error": 1e-4,
    "revised": False,
    "first_ratio": 4.0,
    "first_standard_error": 1e-4,
    "level_ratio": nan,
    "level_standard_error": nan,
    "contact_exponent": 1.0,
    "depth_pF": nan,
    "rise_s": nan,
    "age_s": 0.0,
    "ratio_before": nan,
    "before_standard_error": nan,
    "ratio_after": nan,
    "after_standard_error": nan,
    "offset_ratio": nan,
    "offset_standard_error": nan,
    "effects": {},
    "alarm_share": 0.0,
    "saturated": 0,
    "refused": 0,
    "held": True,
}


def example_touch(*flags: str, **values: Any) -> Touch:
    """Return a touch with these flags and values; the other values are those of a good touch."""
    return Touch(**_VALUES | values, flags=tuple(Flag(flag) for flag in flags))
