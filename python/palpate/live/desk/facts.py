"""What is known of a measurement at one moment: all that the word and the line are made from."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.live.desk.watching import Seen


@dataclass(frozen=True)
class Result:
    """The last touch that ended.

    Attributes
    ----------
    number : int
        From 1.
    text : str
        The ratio with its uncertainty; with a calibration the modulus, too.
    why : str
        Why it is left out; empty: it is kept.
    flags : tuple of str
        The flags that exclude it.
    swapped : str
        The sentence that says so if the inputs seem to be exchanged; else empty.
    revised : bool
    """

    number: int
    text: str
    why: str = ""
    flags: tuple[str, ...] = ()
    swapped: str = ""
    revised: bool = False


@dataclass(frozen=True)
class Pace:
    """How fast pairs arrive.

    Attributes
    ----------
    per_s, nominal_per_s : float
        Pairs a second: now, and by the period of the source; nan: not known.
    read, late, dropped : int
        Pairs of the last seconds: all, those that came late, those that had no room.
    """

    per_s: float = math.nan
    nominal_per_s: float = math.nan
    read: int = 0
    late: int = 0
    dropped: int = 0


@dataclass(frozen=True)
class Facts:
    """What is known of a measurement at one moment.

    Attributes
    ----------
    state : str
        Of the page: "baseline", "no contact", "contact", "adapting", "done", "ended".
    seen : Seen
    silent_s : float
        Seconds since the last pair.
    period_s : float
        Time from one pair to the next; nan: not known.
    troubles : mapping
        Of the source: kind -> sentence.
    outside : tuple of str
        Channels outside the range of the converter without a touch.
    can_centre : bool
        Whether the source can set its range.
    full_scale_pF : float
        The limit of a reading.
    retaken_s, gap_s : float
        Seconds since the baseline was found to be wrong, and since a gap, until that is over; inf: it is over.
    gap : str
        What happened at that gap.
    lost : int
        Pairs that were lost at it.
    cut : int
        Number of the touch that it cut; 0: none.
    pace : Pace
    recording : str
        Name of the recording that runs; empty: none.
    recording_error : str
        Why the recording failed; empty: it did not.
    unrecorded : int
        Pairs that it does not have.
    error : str
        The error that ended the measurement.
    result : Result or None
    next : mapping or None
        The next touch: name of its specimen, nth, of.
    about : str
        A sentence for a calm line, of what goes on beside the measurement.
    """

    state: str
    seen: Seen = field(default_factory=Seen)
    silent_s: float = 0.0
    period_s: float = math.nan
    troubles: Mapping[str, str] = field(default_factory=dict)
    outside: tuple[str, ...] = ()
    can_centre: bool = False
    full_scale_pF: float = math.inf
    retaken_s: float = math.inf
    gap_s: float = math.inf
    gap: str = ""
    lost: int = 0
    cut: int = 0
    pace: Pace = field(default_factory=Pace)
    recording: str = ""
    recording_error: str = ""
    unrecorded: int = 0
    error: str = ""
    result: Result | None = None
    next: Mapping[str, Any] | None = None
    about: str = ""

    @property
    def pressed(self) -> bool:
        """Whether the probe is in contact."""
        return self.state in ("contact", "adapting", "done")

    @property
    def cut_text(self) -> str:
        """The sentence about the touch that was cut."""
        return f" Touch {self.cut} is cut: repeat it." if self.cut else ""
