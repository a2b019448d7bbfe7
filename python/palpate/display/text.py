"""Objects as one short line, for a prompt."""

from collections.abc import Mapping, Sequence
from math import isnan, nan
from typing import TYPE_CHECKING, Any

from palpate import number_format
from palpate._core import HandoverRls, HandoverRls32, Tracker, VectorRls
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from datetime import timedelta

    from palpate.calibration import Calibration
    from palpate.recording import Recording
    from palpate.stream import Stream
    from palpate.touch import Touch

_LONGEST = 20
"""Touches shown of a list; a longer list is shown without its middle."""


def ratio(value: float, error: float) -> str:
    """Return a result of an estimator or a fit with its standard error; without one, a few digits.

    Examples
    --------
    >>> ratio(1.600483, 4.7e-5), ratio(1.600483, float("nan"))
    ('1.600483 ± 0.000047', '1.60')
    """
    if number_format.is_known(error):
        return number_format.plus_minus(value, error)
    return number_format.number(value)


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
    if length_s < 600:
        return f"{length_s:.1f} s"
    return str(duration).partition(".")[0]


def counted(count: int, noun: str) -> str:
    """Return a number of things.

    Examples
    --------
    >>> counted(1, "touch"), counted(4, "touch"), counted(1411, "pair")
    ('1 touch', '4 touches', '1,411 pairs')
    """
    if count == 1:
        return f"1 {noun}"
    plural = "es" if noun.endswith("ch") else "s"
    return f"{count:,} {noun}{plural}"


def counts_text(counts: Mapping[str, int]) -> str:
    """Return the counts that are not 0, each with its name.

    Examples
    --------
    >>> counts_text({"saturated": 1411, "refused": 0, "late": 2})
    '1,411 saturated, 2 late'
    """
    parts = []
    for name, count in counts.items():
        if count:
            parts.append(f"{count:,} {name}")
    return ", ".join(parts)


def changed_settings(shown: Any) -> dict[str, object]:
    """Return the settings of an estimator or a tracker that are not the default, and a size."""
    kind = own_class(shown)
    if isinstance(shown, Tracker):
        default = kind(shown.scene).settings
    elif isinstance(shown, VectorRls):
        default = {**kind(size=1).settings, "size": None}
    else:
        default = kind().settings
    changed = {}
    for name, value in shown.settings.items():
        if value != default[name]:
            changed[name] = value
    return changed


def own_class(shown: object) -> Any:
    """Return the class of the core that an object is, or is derived from."""
    return next(kind for kind in type(shown).__mro__ if kind.__module__ == "palpate")


def estimator_line(shown: Any) -> str:
    """Return an estimator, with the settings that are not the default."""
    settings = ", ".join(_assignments(shown))
    return f"<{type(shown).__name__}({settings}): {estimator_result(shown)}>"


def estimator_result(shown: Any) -> str:
    """Return the result of an estimator, and the number of its samples."""
    samples = counted(shown.samples, "sample")
    if shown.rejected:
        samples += f", {shown.rejected:,} rejected"
    if isinstance(shown, VectorRls):
        errors = shown.standard_errors.tolist()
        coefficients = map(ratio, shown.coefficients.tolist(), errors)
        return f"coefficients {', '.join(coefficients)}, {samples}"
    error = nan
    if isinstance(shown, HandoverRls | HandoverRls32):
        error = shown.standard_error
    return f"ratio {ratio(shown.ratio, error)}, {samples}"


def _assignments(shown: Any) -> list[str]:
    return [f"{name}={value!r}" for name, value in changed_settings(shown).items()]


def tracker_line(shown: Tracker) -> str:
    """Return a tracker, with the settings that are not the default of its scene."""
    arguments = ", ".join([repr(shown.scene), *_assignments(shown)])
    parts: list[str] = [shown.state]
    running = running_ratio(shown)
    if running:
        parts.append(f"ratio {running}")
    parts.append(counted(shown.touch_count, "touch"))
    return f"<{type(shown).__name__}({arguments}): {', '.join(parts)}>"


def running_ratio(shown: Tracker) -> str:
    """Return the ratio of the running touch; "" without one or without a sample.

    A touch that has ended has its own.
    """
    if shown.state not in ("contact", "done") or isnan(shown.ratio):
        return ""
    return str(Uncertainty.of_ratio(shown.ratio, shown.standard_error))


def touch_line(shown: "Touch") -> str:
    """Return a touch: its time, the ratio with its uncertainty, and its flags.

    A touch does not know its session: the scatter is assumed.
    """
    when = seconds(shown.start_s)
    if isnan(shown.start_s):
        when = f"reading {shown.start}"
    parts = [f"ratio {Uncertainty.of(shown)}", counted(shown.samples, "sample")]
    if shown.flags:
        parts.append(f"flags {', '.join(shown.flags)}")
    return f"<Touch at {when}: {', '.join(parts)}>"


def touch_lines(shown: "Sequence[Touch]", notes: "Sequence[str]" = ()) -> str:
    """Return a list of touches, one a line; then the notes on their recording."""
    lines = list(map(repr, shown))
    if len(lines) > _LONGEST:
        half = _LONGEST // 2
        lines[half:-half] = [f"... {counted(len(lines) - _LONGEST, 'touch')} more ..."]
    touches = ",\n ".join(lines)
    return "\n".join([f"[{touches}]", *notes])


def note_lines(notes: Sequence[str], doubts: Sequence[str]) -> list[str]:
    """Return a line for each doubt and each other note of a recording.

    Examples
    --------
    >>> note_lines(["a gap", "changed"], ["changed"])
    ['results may be wrong: changed', 'note: a gap']
    """
    lines = [f"results may be wrong: {doubt}" for doubt in doubts]
    for note in notes:
        if note not in doubts:
            lines.append(f"note: {note}")
    return lines


def recording_line(shown: "Recording") -> str:
    """Return a recording: its duration, and how many pairs, marks, notes and doubts it has."""
    parts = [recording_length(shown)]
    if shown.marks:
        parts.append(counted(len(shown.marks), "mark"))
    if shown.notes:
        parts.append(counted(len(shown.notes), "note"))
    if shown.doubts:
        parts.append(f"{counted(len(shown.doubts), 'doubt')}: results may be wrong")
    return f"<Recording: {', '.join(parts)}>"


def recording_length(shown: "Recording") -> str:
    """Return the duration of a recording, and how many pairs it has."""
    return f"{lasting(known_duration(shown))}, {counted(len(shown.hard), 'pair')}"


def known_duration(shown: "Recording") -> "timedelta | None":
    """Return the duration of a recording; None without times."""
    try:
        return shown.duration
    except ValueError:
        return None


def calibration_line(shown: "Calibration") -> str:
    """Return a calibration: its specimens, and the range of their moduli."""
    low, high = shown.range
    specimens = counted(len(shown.residuals), "specimen")
    return f"<Calibration: {specimens}, {low:g} to {high:g} MPa, rigid ratio {rigid_ratio(shown)}>"


def rigid_ratio(shown: "Calibration") -> str:
    """Return the ratio on a rigid object, with its standard error."""
    error = float(shown.fitted.covariance[0, 0]) ** 0.5
    return ratio(shown.probe.rigid_ratio, error)


def stream_line(shown: "Stream") -> str:
    """Return a measurement: its state, and how much it has measured."""
    counters = shown.counters
    parts = [
        shown.tracker.state,
        counted(counters.read, "sample"),
        counted(shown.tracker.touch_count, "touch"),
    ]
    if counters.dropped:
        parts.append(f"{counters.dropped:,} dropped")
    return f"<Stream of {type(shown.source).__name__}: {', '.join(parts)}>"
