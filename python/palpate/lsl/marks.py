"""The texts of marks: a word for the kind, and what is to be said; of a touch a JSON object."""

import json
import math

from palpate._core import Touch


def ended_text(number: int, touch: Touch, start_s: float) -> str:
    """Return the mark of a touch at its end, "touch {...}"; numbers have all digits.

    Parameters
    ----------
    number : int
        From 1.
    touch : Touch
        Also revised: the mark has the first result.
    start_s : float
        Its begin on the clock of LSL, s.

    Returns
    -------
    str
    """
    return f"touch {_told(number, touch, touch.first_ratio, touch.first_standard_error, start_s)}"


def revised_text(number: int, touch: Touch, start_s: float) -> str:
    """Return the mark of a touch when the baseline after it is known, "revised {...}"; parameters as `ended_text`."""
    return f"revised {_told(number, touch, touch.ratio, touch.standard_error, start_s)}"


def _told(number: int, touch: Touch, ratio: float, standard_error: float, start_s: float) -> str:
    values = {"ratio": ratio, "standard_error": standard_error, "start": start_s}
    known = {name: value if math.isfinite(value) else None for name, value in values.items()}
    return json.dumps(
        {"number": number, **known, "samples": touch.samples, "flags": list(touch.flags)}, allow_nan=False
    )
