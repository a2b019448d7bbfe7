"""Objects as one short line, for a prompt."""

from collections.abc import Sequence
from math import isnan
from typing import TYPE_CHECKING, Any

from palpate import number_format
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from datetime import timedelta

    from palpate._core import Touch, Tracker
    from palpate.calibration import Calibration
    from palpate.recording import Recording
    from palpate.stream import Stream

_MOST = 20
"""Touches shown of a list; more leave out those in the middle."""


def ratio(value: float, error: float) -> str:
    """Return a result of an estimator or a fit with its standard error; without one, a few digits.

    Examples
    --------
    >>> ratio(1.600483, 4.7e-5), ratio(1.600483, float("nan"))
    ('1.600483 ± 0.000047', '1.60')
    """
    return (
        number_format.plus_minus(value, error)
        if number_format.known(error)
        else number_format.number(value)
    )


def seconds(time_s: float) -> str:
    """Return a time on the clock of a recording; without times "-".

    Examples
    --------
    >>> seconds(1.5084), seconds(float("nan"))
    ('1.508 s', '-')
    """
    return "-" if isnan(time_s) else f"{time_s:.3f} s"


def lasting(duration: "timedelta | None") -> str:
    """Return a duration, as 36.7 s or 1:02:03; None: not known.

    Examples
    --------
    >>> from datetime import timedelta
    >>> lasting(timedelta(seconds=36.673)), lasting(timedelta(seconds=3723.4)), lasting(None)
    ('36.7 s', '1:02:03', 'duration unknown')
    """
    if duration is None:
        return "duration unknown"
    length_s = duration.total_seconds()
    return f"{length_s:.1f} s" if length_s < 600 else str(duration).partition(".")[0]


def counted(count: int, what: str) -> str:
    """Return a number of things.

    Examples
    --------
    >>> counted(1, "touch"), counted(4, "touch"), counted(1411, "pair")
    ('1 touch', '4 touches', '1,411 pairs')
    """
    plural = "" if count == 1 else "es" if what.endswith("ch") else "s"
    return f"{count:,} {what}{plural}"


def changed(settings: dict[str, Any], defaults: dict[str, Any]) -> dict[str, Any]:
    """Return the settings that differ from their defaults."""
    return {name: value for name, value in settings.items() if value != defaults[name]}


def own_class(shown: object) -> Any:
    """Return the class of the core that an object is, or is derived from."""
    return next(kind for kind in type(shown).__mro__ if kind.__module__ == "palpate")


def defaults(shown: Any) -> dict[str, Any]:
    """Return the default settings of an estimator, of its size."""
    size = {name: value for name, value in shown.settings.items() if name == "size"}
    return dict(own_class(shown)(**size).settings)


def estimator(shown: Any) -> str:
    """Return an estimator, with the settings that are not the default."""
    return f"<{type(shown).__name__}({_given(shown, defaults(shown) | {'size': None})}): {measured(shown)}>"


def measured(shown: Any) -> str:
    """Return what an estimator has found, and of how many samples."""
    rejected = f", {shown.rejected:,} rejected" if shown.rejected else ""
    samples = f"{counted(shown.samples, 'sample')}{rejected}"
    if hasattr(shown, "coefficients"):
        pairs = zip(shown.coefficients.tolist(), shown.standard_errors.tolist(), strict=True)
        return f"coefficients {', '.join(ratio(*pair) for pair in pairs)}, {samples}"
    return f"ratio {ratio(shown.ratio, getattr(shown, 'standard_error', float('nan')))}, {samples}"


def _given(shown: Any, defaults: dict[str, Any], *first: str) -> str:
    return ", ".join(
        [
            *first,
            *(f"{name}={value!r}" for name, value in changed(shown.settings, defaults).items()),
        ]
    )


def tracker(shown: "Tracker") -> str:
    """Return a tracker, with the settings that are not those of its scene."""
    given = _given(shown, own_class(shown)(shown.scene).settings, repr(shown.scene))
    found = f", ratio {running_ratio(shown)}" if running_ratio(shown) else ""
    return f"<{type(shown).__name__}({given}): {shown.state}{found}, {counted(shown.touch_count, 'touch')}>"


def running_ratio(shown: "Tracker") -> str:
    """Return the ratio of the running touch; "" without one: those that have ended have their own results."""
    return (
        str(Uncertainty.of_ratio(shown.ratio, shown.standard_error))
        if shown.state in ("contact", "done")
        else ""
    )


def touch(shown: "Touch") -> str:
    """Return a touch: when, the ratio with its uncertainty (it knows no session: the scatter is assumed), and its flags."""
    when = f"reading {shown.start}" if isnan(shown.start_s) else seconds(shown.start_s)
    flags = f", flags {', '.join(shown.flags)}" if shown.flags else ""
    result = f"ratio {Uncertainty.of(shown)}, {counted(shown.samples, 'sample')}{flags}"
    return f"<Touch at {when}: {result}>"


def touches(shown: "Sequence[Touch]", said: "Sequence[str]" = ()) -> str:
    """Return a list of touches, one a line; then what was said of their recording."""
    lines = [repr(one) for one in shown]
    if len(lines) > _MOST:
        half = _MOST // 2
        lines[half:-half] = [f"... {counted(len(lines) - _MOST, 'touch')} more ..."]
    return "\n".join(["[" + ",\n ".join(lines) + "]", *said])


def remarks(notes: Sequence[str], doubts: Sequence[str]) -> list[str]:
    """Return a line for each doubt and each other note of a recording.

    Examples
    --------
    >>> remarks(["a gap", "changed"], ["changed"])
    ['results may be wrong: changed', 'note: a gap']
    """
    return [
        *(f"results may be wrong: {doubt}" for doubt in doubts),
        *(f"note: {x}" for x in notes if x not in doubts),
    ]


def recording(shown: "Recording") -> str:
    """Return a recording: how long, how many pairs, and what was said of it."""
    said = [
        counted(len(group), name)
        for name, group in (("mark", shown.marks), ("note", shown.notes))
        if group
    ]
    doubts = (
        [f"{counted(len(shown.doubts), 'doubt')}: results may be wrong"] if shown.doubts else []
    )
    return f"<Recording: {', '.join([length(shown), *said, *doubts])}>"


def length(shown: "Recording") -> str:
    """Return how long a recording is, and how many pairs it has."""
    return f"{lasting(known_duration(shown))}, {counted(len(shown.hard), 'pair')}"


def known_duration(shown: "Recording") -> "timedelta | None":
    """Return the duration of a recording; None without times."""
    try:
        return shown.duration
    except ValueError:
        return None


def calibration(shown: "Calibration") -> str:
    """Return a calibration: how many specimens, and the range of their moduli."""
    low, high = shown.range
    specimens = counted(len(set(shown.moduli.tolist())), "specimen")
    return f"<Calibration: {specimens}, {low:g} to {high:g} MPa, rigid ratio {rigid(shown)}>"


def rigid(shown: "Calibration") -> str:
    """Return the ratio on a rigid object, with its standard error."""
    return ratio(shown.probe.rigid_ratio, float(shown.fitted.covariance[0, 0]) ** 0.5)


def stream(shown: "Stream") -> str:
    """Return a measurement: its state, and how much it has measured."""
    counters = shown.counters
    parts = [
        shown.tracker.state,
        counted(counters.read, "sample"),
        counted(shown.tracker.touch_count, "touch"),
    ]
    dropped = [f"{counters.dropped:,} dropped"] if counters.dropped else []
    return f"<Stream of {type(shown.source).__name__}: {', '.join([*parts, *dropped])}>"
