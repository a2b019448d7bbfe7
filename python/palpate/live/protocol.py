"""The messages that a page gets: a struct for each of them. The commands that it sends are in `page_commands`.

`tests/tools/page_types.py` writes both as types for the JavaScript of the page, page/messages.d.ts.
"""

from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import UNSET, Meta, Struct, UnsetType

MaybeNumber = Annotated[float, Meta(extra={"null": True})]
"""A number, or nan and infinity, which JSON does not have: the page gets null."""


class RefusedCommand(ValueError):
    """A command of a page is not valid, or not possible now. The text says what is allowed."""


class RunFile(Struct, frozen=True):
    """A file of this run."""

    name: str
    kind: str  # recording, settings, calibration or report


class ShownModulus(Struct, frozen=True):
    """A modulus with its 95 % interval."""

    value_MPa: MaybeNumber
    low_MPa: MaybeNumber
    high_MPa: MaybeNumber
    text: str
    reason: str
    extrapolated: bool


class ShownScatter(Struct, frozen=True):
    """Relative scatter from touch to touch, and where it is from."""

    share: float
    source: str


class Message(Struct, tag_field="type"):
    """What a page gets."""

    @property
    def message_type(self) -> str:
        """The name of the message."""
        return str(self.__struct_config__.tag)


class SimulatedPress(Struct, frozen=True):
    """What a simulated hand presses on."""

    start_s: float
    ratio: float
    name: str


class PressedSpecimen(Struct, frozen=True):
    """A specimen on which the page can press, and its true modulus, MPa."""

    name: str
    modulus: float


class SimulationFacts(Struct, frozen=True):
    """What is known of a simulation; `specimens`: the page presses on them, empty: the hand presses by itself."""

    specimens: list[PressedSpecimen]
    truths: list[SimulatedPress]


class ReviewedFile(Struct, frozen=True):
    """A recording that is shown; `end`: how it ended, `amendable`: its touches can get specimens."""

    name: str
    rows: int
    missing: int
    refused: int
    end: str
    amendable: bool


class HelloMessage(Message, tag="hello", kw_only=True):
    """What does not change during a measurement."""

    measurement: int
    kind: str  # live or file
    file: ReviewedFile | None
    origin_s: float | None  # time of the first row
    seconds: float | None  # length of a touch
    source: str
    simulation: SimulationFacts | None
    device: str
    scene: str
    stated: list[str]
    threshold: MaybeNumber
    calibrated: bool
    scatter: float | None  # of the calibration
    assumed: float | None  # scatter without one


class ListedRecording(Struct, frozen=True):
    """A recording that a page can open; `changed_s`: when it was written last, s since 1970."""

    name: str
    changed_s: float


class RecordingsMessage(Message, tag="recordings"):
    """The newest recordings of the folder, the newest one first."""

    files: list[ListedRecording]


class RunningRecording(Struct, frozen=True):
    """The recording that runs."""

    name: str
    rows: int
    seconds: float | None


class ShownCounters(Struct, frozen=True):
    """The counts of `palpate.stream.StreamCounters`."""

    read: int
    lost: int
    late: int
    delivered: int
    dropped: int
    waiting: int
    refused: int
    saturated: int
    recorded: int
    unrecorded: int
    errors: int
    reconnects: int
    retaken: int


class Instruction(Struct, frozen=True):
    """What to do now: Touch, Hold, Lift, Repeat, Stop, Tare, Wait or Ended; File: nothing is measured."""

    word: str
    sub: str
    tone: str = "idle"  # idle, busy, good, caution or fault
    share: float | None = None  # part of the touch that is measured
    reason: str = ""  # in few words, for large letters; "": sub has them


class ShownLine(Struct, frozen=True):
    """The status line."""

    level: str  # quiet, note, caution or fault
    title: str
    text: str
    since_s: float | None
    what: str  # a key


class RatioState(Struct, frozen=True):
    """The state of the tracker; a part of `StateMessage`."""

    state: str
    end_s: float | None  # time of the last row
    ratio: MaybeNumber
    standard_error: MaybeNumber
    uncertainty: MaybeNumber
    uncertainty_from: str
    modulus: ShownModulus | None


class FilesState(Struct, frozen=True):
    """The recording that runs, and the files of this run; a part of `StateMessage`."""

    recording: RunningRecording | None
    counters: ShownCounters | UnsetType
    proposed: str  # name of the next recording
    files: list[RunFile]
    progress: str  # of the report that is being written
    comparable: int


class StatusState(Struct, frozen=True):
    """What to do and what is wrong; a part of `StateMessage`."""

    now: Instruction
    line: ShownLine
    announce: str  # for screen readers
    on: str | UnsetType | None = UNSET  # specimen of the running touch


class StateMessage(Message, tag="state", kw_only=True):
    """What changes all the time."""

    state: str
    end_s: float | None  # time of the last row
    ratio: MaybeNumber
    standard_error: MaybeNumber
    uncertainty: MaybeNumber
    uncertainty_from: str
    modulus: ShownModulus | None
    recording: RunningRecording | None
    counters: ShownCounters | UnsetType
    proposed: str
    files: list[RunFile]
    progress: str
    comparable: int
    now: Instruction
    line: ShownLine
    announce: str
    on: str | UnsetType | None


class TouchRow(Struct, frozen=True, kw_only=True):
    """A touch: its fields as in `palpate.Touch`, then what the session knows of it."""

    number: int
    start: int
    start_s: MaybeNumber
    samples: int
    ratio: MaybeNumber  # the one that counts, as `standard_error`
    covariance: MaybeNumber
    standard_error: MaybeNumber
    revised: bool
    first_ratio: MaybeNumber
    first_standard_error: MaybeNumber
    level_ratio: MaybeNumber
    level_standard_error: MaybeNumber
    contact_exponent: MaybeNumber
    depth_pF: MaybeNumber
    rise_s: MaybeNumber
    age_s: MaybeNumber
    ratio_before: MaybeNumber
    before_standard_error: MaybeNumber
    ratio_after: MaybeNumber
    after_standard_error: MaybeNumber
    offset_ratio: MaybeNumber
    offset_standard_error: MaybeNumber
    effects: dict[str, MaybeNumber]
    alarm_share: MaybeNumber
    saturated: int
    refused: int
    flags: list[str]
    outliers: int
    end_s: float | None
    modulus: ShownModulus | None
    advice: list[str]
    own_error: MaybeNumber  # uncertainty without the scatter
    specimen: str | None
    kept: bool
    why: str  # it is left out


class ShownTrend(Struct, frozen=True):
    """A trend over touches."""

    change: MaybeNumber
    probability: MaybeNumber


class ShownAgreement(Struct):
    """Whether touches agree, as `palpate.Agreement`."""

    agree: bool
    ratio: float | None
    standard_error: float | None
    touches: int
    spread: MaybeNumber
    scatter: MaybeNumber
    probability: MaybeNumber
    cause: str | None
    trend: ShownTrend | None
    without_tilt: MaybeNumber
    text: str
    modulus: ShownModulus | UnsetType | None = UNSET


class TouchesMessage(Message, tag="touches", kw_only=True):
    """The table of touches. `rows`: those that are new or have changed, of `count`."""

    rows: list[TouchRow]
    scatter: ShownScatter
    means: dict[str, float]  # of the ratios, by specimen
    most_reliable: int | None
    together: ShownAgreement | None
    count: int


class ShownMark(Struct, frozen=True):
    """A mark."""

    id: int
    t_s: float
    text: str


class ShownGap(Struct, frozen=True):
    """A place where pairs are missing."""

    from_s: float
    to_s: float
    lost: int
    text: str


class ShownJudgement(Struct, frozen=True):
    """What was judged of a channel."""

    t_s: float
    channel: str
    name: str
    text: str


class ShownFlag(Struct, frozen=True):
    """A flag of a touch, and when it arose."""

    t_s: float
    touch: int
    name: str
    text: str


class EventsMessage(Message, tag="events"):
    """What is marked on the axis of time."""

    marks: list[ShownMark]
    tares: list[float]
    gaps: list[ShownGap]
    judgements: list[ShownJudgement]
    flags: list[ShownFlag]


class Deviation(Struct, frozen=True):
    """How far a touch is from the mean of its specimen; `touch`: None, of an earlier measurement."""

    touch: int | None
    deviation: MaybeNumber | None
    kept: bool


class SpecimenRow(Struct, frozen=True):
    """A specimen of the list; modulus in MPa, with its relative uncertainty."""

    name: str
    modulus: float | None
    uncertainty: float | None
    kept: int
    of: int
    mean: MaybeNumber | None
    deviations: list[Deviation]


class NextTouch(Struct, frozen=True):
    """The specimen of the next touch."""

    name: str
    modulus: float | None
    nth: int
    of: int


class TouchCount(Struct, frozen=True):
    """How many of the wanted touches are done."""

    kept: int
    of: int


class ShownNote(Struct, frozen=True):
    """A note."""

    t_s: float
    text: str


class LastTouchKept(Struct, frozen=True):
    """The newest touch, and whether it is kept."""

    touch: int
    kept: bool


class SessionResult(Struct, frozen=True):
    """The result of a session: its scatter, and how many known moduli are in their intervals."""

    scatter: float
    source: str
    inside: int
    of: int
    left_out: int


class SessionMessage(Message, tag="session", kw_only=True):
    """The plan, and how much of it is done."""

    title: str
    operator: str
    wanted: int
    specimens: list[SpecimenRow]
    next: NextTouch | None
    count: TouchCount
    notes: list[ShownNote]
    last: LastTouchKept | None
    done: SessionResult | None


class CalibrationPoint(Struct, frozen=True):
    """A touch on a specimen of known modulus, beside the curve."""

    modulus: float
    specimen: str
    fitted: MaybeNumber | None
    touch: int
    ratio: MaybeNumber
    kept: bool


class ShownParameter(Struct, frozen=True):
    """A parameter of eq. (2), in words."""

    name: str
    value: str
    interval: str


class ShownCurve(Struct, frozen=True):
    """Points of the curve and of its confidence band."""

    modulus: list[MaybeNumber]
    ratio: list[MaybeNumber]
    low: list[MaybeNumber]
    high: list[MaybeNumber]


class RigidRatio(Struct, frozen=True):
    """The ratio on a rigid object."""

    value: MaybeNumber
    error: MaybeNumber


class CalibrationMessage(Message, tag="calibration", kw_only=True):
    """The guided calibration; without a fit only the first fields."""

    on: bool
    saved: str | UnsetType | None = UNSET  # where it was saved, as a sentence
    next: str | UnsetType = UNSET
    touches: int | UnsetType = UNSET
    points: list[CalibrationPoint] | UnsetType = UNSET
    verdict: str | UnsetType = UNSET  # one sentence
    grade: str | UnsetType = UNSET  # good, look, bad; "": too early
    look: list[int] | UnsetType = UNSET  # numbers of the touches to look at
    doubts: list[str] | UnsetType = UNSET
    details: str | UnsetType = UNSET  # of the fit, in the words of `palpate calibrate`
    sound: bool | UnsetType = UNSET
    parameters: list[ShownParameter] | UnsetType = UNSET
    curve: ShownCurve | UnsetType | None = UNSET
    rigid: RigidRatio | UnsetType | None = UNSET


class VerificationMessage(Message, tag="verification"):
    """Whether the calibration holds on a known specimen; `text` is empty: there is no result."""

    text: str
    agrees: bool
    kept: bool


class DeviceFact(Struct, frozen=True):
    """A fact of the device; `share`: of a bar."""

    name: str
    value: str
    warn: bool = False
    share: float | None = None
    title: str = ""


class DeviceOption(Struct, frozen=True):
    """A setting of the converter."""

    value: int | str
    allowed: list[int | str]
    title: str


class DeviceMessage(Message, tag="device"):
    """The device: its facts, and its settings by name."""

    facts: list[DeviceFact]
    options: dict[str, DeviceOption]
    can_centre: bool


class ReadLine(Struct, frozen=True):
    """How a line of a list is read: its modulus, MPa, with its relative uncertainty, or what is wrong."""

    modulus: float | UnsetType | None = UNSET
    uncertainty: float | UnsetType | None = UNSET
    wrong: str | UnsetType = UNSET


class DoneMessage(Message, tag="done"):
    """A command was done: its name and the answer."""

    do: str
    message: str
    id: int | UnsetType = UNSET  # of a mark
    file: str | UnsetType = UNSET  # that was made
    lines: list[ReadLine | None] | UnsetType = UNSET  # of a list of specimens


class ComparedFile(Struct, frozen=True):
    """A recording that is compared."""

    name: str
    touches: int
    kept: int


class ComparedTouch(Struct, frozen=True):
    """A touch on a compared specimen."""

    file: int
    number: int
    ratio: MaybeNumber
    left_out: str


class ComparedSpecimen(Struct, frozen=True):
    """The touches on one specimen in all recordings; `apart`: how far the farthest recording is from the others."""

    name: str
    farthest: int
    apart: MaybeNumber
    agreement: ShownAgreement | None
    touches: list[ComparedTouch]


class ComparedMessage(Message, tag="done"):
    """The answer to compare."""

    do: str
    files: list[ComparedFile]
    agree: int
    of: int
    scatter: float
    specimens: list[ComparedSpecimen]
    same: ComparedSpecimen | None  # all touches as one object, if no specimen is in two recordings


class RefusedMessage(Message, tag="refused"):
    """A command was refused."""

    message: str


Answer = DoneMessage | ComparedMessage
MESSAGES: tuple[type[Message], ...] = (
    HelloMessage,
    RecordingsMessage,
    StateMessage,
    TouchesMessage,
    EventsMessage,
    SessionMessage,
    CalibrationMessage,
    VerificationMessage,
    DeviceMessage,
    DoneMessage,
    ComparedMessage,
    RefusedMessage,
)
"""All messages to a page."""


def _number(value: Any) -> Any:
    """Return the Python number of a number of numpy."""
    if isinstance(value, np.generic):
        return value.item()
    raise NotImplementedError(f"message: got {type(value).__name__}")


_ENCODER = msgspec.json.Encoder(enc_hook=_number)


def encode(message: Message) -> str:
    """Return a message as JSON, with null for nan and infinity.

    Examples
    --------
    >>> encode(VerificationMessage("", agrees=True, kept=False))
    '{"type":"verification","text":"","agrees":true,"kept":false}'
    >>> encode(DeviceMessage([DeviceFact("Hard", "-", share=float("nan"))], {}, False))
    '{"type":"device","facts":[{"name":"Hard","value":"-","warn":false,"share":null,"title":""}],"options":{},"can_centre":false}'
    """
    return _ENCODER.encode(message).decode()
