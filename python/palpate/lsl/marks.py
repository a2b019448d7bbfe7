"""The texts of marks: a word for the kind, and what is to be said; of a touch a JSON object."""

import json
import math

from palpate._core import Touch


def touch_text(number: int, touch: Touch, start_s: float) -> str:
    """Return the mark of a touch.

    Parameters
    ----------
    number : int
        From 1.
    touch : Touch
    start_s : float
        Its begin on the clock of LSL, s.

    Returns
    -------
    str
        "touch {...}" at its end; "revised {...}" when the baseline after it is known. Numbers have all digits.
    """
    values = {"ratio": touch.ratio, "standard_error": touch.standard_error, "start": start_s}
    known = {name: value if math.isfinite(value) else None for name, value in values.items()}
    fields = {"number": number, **known, "samples": touch.samples, "flags": list(touch.flags)}
    return f"{'revised' if touch.revised else 'touch'} {json.dumps(fields, allow_nan=False)}"
