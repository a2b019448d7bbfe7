"""Events of a source: gaps, troubles and measured conditions, yielded in order with the samples."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from palpate.samples import Block


class GapCause(Enum):
    """Why the earlier baseline is no longer valid.

    Attributes
    ----------
    DISCONNECTED
        The device was unplugged, or the stream was lost, and is back.
    REOPENED
        The device was opened again after an error.
    RESTARTED
        The device or the sender started again, or its clock was set.
    RANGE
        The range of the converter was moved.
    WIRING
        A wire came off or was put on again.
    SHARED
        Another program reads the device, too: readings are lost, or may be wrong.
    CLOCK_SET
        The wall clock was set forward; or the computer is a virtual machine that was paused, which
        no other clock shows.
    SLEPT
        The computer slept.
    STOPPED
        The program stood still: it was stopped, or the computer was too busy.
    UPSTREAM
        The sender of the samples reports a gap of its own source.
    RECORDED
        A recording has a mark for a gap; only its text is known.
    OTHER
        Anything else.
    """

    DISCONNECTED = "disconnected"
    REOPENED = "reopened"
    RESTARTED = "restarted"
    RANGE = "range"
    WIRING = "wiring"
    SHARED = "shared"
    CLOCK_SET = "clock set"
    SLEPT = "slept"
    STOPPED = "stopped"
    UPSTREAM = "upstream"
    RECORDED = "recorded"
    OTHER = "other"


class TroubleKind(Enum):
    """Kinds of trouble.

    Attributes
    ----------
    SHARED
        Another program reads the device, too.
    UNPLUGGED
        The device is gone, and the source waits for it.
    WIRING
        The readings show a fault of the wires.
    HINT
        A doubt about the wiring that does not prevent a measurement.
    """

    SHARED = "shared"
    UNPLUGGED = "unplugged"
    WIRING = "wiring"
    HINT = "hint"


@dataclass(frozen=True)
class Gap:
    """From the next sample on, the earlier baseline is no longer valid.

    Attributes
    ----------
    cause : GapCause
    text : str
        What happened, for the mark in the recording.

    Examples
    --------
    >>> Gap(GapCause.DISCONNECTED, "unplugged for 1.5 s").cause
    <GapCause.DISCONNECTED: 'disconnected'>
    """

    cause: GapCause
    text: str


@dataclass(frozen=True)
class TroubleBegan:
    """A trouble has begun; another event of the same kind updates its text.

    Attributes
    ----------
    kind : TroubleKind
    text : str
        The fault, and what to do.
    """

    kind: TroubleKind
    text: str


@dataclass(frozen=True)
class TroubleEnded:
    """A trouble of this kind is over.

    Attributes
    ----------
    kind : TroubleKind
    """

    kind: TroubleKind


@dataclass(frozen=True)
class Conditions:
    """Values that a source measured, other than the samples.

    Attributes
    ----------
    t_s : float
        Time of the measurement, s, on the clock of the samples.
    values : mapping of str to float
        Values by name with unit, as `temperature_C`.

    Examples
    --------
    >>> Conditions(1.5, {"temperature_C": 25.0}).as_dict()
    {'t_s': 1.5, 'temperature_C': 25.0}
    """

    t_s: float
    values: Mapping[str, float]

    def as_dict(self) -> dict[str, float]:
        """Return the time and the values, as in the sidecar of a recording."""
        return {"t_s": self.t_s, **self.values}


SourceEvent = Gap | TroubleBegan | TroubleEnded | Conditions
"""An event of a source."""
SourceItem = Block | SourceEvent
"""An item of a source's iteration: a block of samples, or an event."""
