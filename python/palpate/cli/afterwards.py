"""Touches estimated afterwards, for `palpate replay --offline`: a table, and objects beside those of the live result."""

import math
from typing import TYPE_CHECKING, Any

from palpate import digits

if TYPE_CHECKING:
    from palpate import OfflineTouch

HEADER = "touch   start_s  samples     ratio  std. error       live  std. error  flags"


def row(number: int, touch: "OfflineTouch") -> str:
    """Return one touch as a line of the table; the numbers begin at 1."""
    error, live = touch.standard_error, touch.live
    ratio = "-" if math.isnan(touch.ratio) else digits.number(touch.ratio, error)
    return (
        f"{number:5} {touch.start_s:9.3f} {touch.samples:8} {ratio:>9} {digits.error(error):>11}"
        f" {digits.number(live.ratio, live.standard_error):>10} {digits.error(live.standard_error):>11}"
        f"  {' '.join(touch.flags)}".rstrip()
    )


def table(touches: "list[OfflineTouch]") -> str:
    """Return a header, a line for each touch, and the methods; an empty text without touches."""
    lines = [HEADER, *(row(number, touch) for number, touch in enumerate(touches, 1))]
    methods: dict[str, list[str]] = {}
    for number, touch in enumerate(touches, 1):
        methods.setdefault(method(touch), []).append(str(number))
    for name, numbers in methods.items():
        which = "All touches" if len(methods) == 1 else f"Touch{'es' * (len(numbers) > 1)} {', '.join(numbers)}"
        lines.append(f"{which}: {name}.")
    return "\n".join(lines) + "\n" if touches else ""


def method(touch: "OfflineTouch") -> str:
    """Return the method with the baselines as text."""
    return f"{touch.method}, baseline {touch.baselines}" if touch.baselines else touch.method


def add(document: dict[str, Any], touches: "list[OfflineTouch]") -> None:
    """Add the results to replay's JSON document, beside the live ones."""
    for record, touch in zip(document["touches"], touches, strict=True):
        record["offline"] = touch.as_dict()
