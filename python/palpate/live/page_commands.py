"""The commands that a page sends: a struct for each of them. What does not fit is refused when it is decoded."""

from typing import Annotated

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

from palpate.live.protocol import RefusedCommand
from palpate.messages import quoted
from palpate.recording.session import MOST_WANTED

LONGEST_MESSAGE = 32768  # bytes of a message of a page
LONGEST_TEXT = 4000  # characters of a text: a list of specimens; a note and a name have less
LARGEST = 2**31 - 1

Text = Annotated[
    str,
    Meta(max_length=LONGEST_TEXT, description=f"up to {LONGEST_TEXT} characters that can be shown"),
]
Count = Annotated[int, Meta(ge=1, le=LARGEST, description="an integer above 0")]
Seconds = Annotated[float, Meta(description="seconds, a number")]
Switch = Annotated[bool, Meta(description="true or false")]


class Command(Struct, tag_field="do", forbid_unknown_fields=True):
    """What a page orders."""

    @property
    def do(self) -> str:
        """The name of the command."""
        return str(self.__struct_config__.tag)


class TareCommand(Command, tag="tare"):
    """Measure the baseline again."""


class TareAnywayCommand(Command, tag="tare anyway"):
    """Measure the baseline again, also in contact."""


class RecordCommand(Command, tag="record"):
    """Begin a recording; without a name: the proposed one."""

    name: Text | None = None


class StopCommand(Command, tag="stop"):
    """End the recording."""


class AgainCommand(Command, tag="again"):
    """Begin the next measurement after one that has ended."""


class MarkCommand(Command, tag="mark"):
    """Mark this moment."""


class MarkTextCommand(Command, tag="mark text"):
    """Give a mark its text."""

    id: Count
    text: Text


class PressCommand(Command, tag="press"):
    """Press the probe of the demo on a specimen, until it is released."""

    specimen: Text


class ReleaseCommand(Command, tag="release"):
    """Lift the probe of the demo."""


class UnderstoodCommand(Command, tag="understood"):
    """Do not show again that the computer is slow."""


class CentreCommand(Command, tag="centre"):
    """Set the range of the converter again."""


class DeviceCommand(Command, tag="device"):
    """Begin a new measurement with other settings of the converter."""

    capf: Annotated[int, Meta(description="an integer")] | UnsetType = UNSET
    excitation: Text | UnsetType = UNSET

    def changed(self) -> dict[str, int | str]:
        """Return the options that are set."""
        options: dict[str, int | str] = {}
        if self.capf is not UNSET:
            options["capf"] = self.capf
        if self.excitation is not UNSET:
            options["excitation"] = self.excitation
        return options


class PlanCommand(Command, tag="plan"):
    """Take another list of specimens; without a title or an operator: those from before."""

    text: Text
    wanted: Annotated[
        int, Meta(ge=1, le=MOST_WANTED, description=f"an integer from 1 to {MOST_WANTED}")
    ]
    unit: Text = "MPa"
    title: Text | None = None
    operator: Text | None = None


class ReadListCommand(Command, tag="read list"):
    """Answer how each line of a list of specimens is read."""

    text: Text
    unit: Text = "MPa"


class SpecimenCommand(Command, tag="specimen"):
    """Choose the specimen of the next touch; "": the list decides."""

    name: Text


class AssignCommand(Command, tag="assign"):
    """Give a touch another specimen; "": none."""

    touch: Count
    name: Text


class NameCommand(Command, tag="name"):
    """Give touches a specimen, written as in a list; "": none."""

    touches: Annotated[list[Count], Meta(description="numbers of touches")]
    text: Text


class DiscardCommand(Command, tag="discard"):
    """Leave a touch out."""

    touch: Count


class KeepCommand(Command, tag="keep"):
    """Keep a touch, whatever its flags are."""

    touch: Count


class MoreCommand(Command, tag="more"):
    """Want one touch more of the specimen of the last touch, else of the next one."""


class NoteCommand(Command, tag="note"):
    """Add a note."""

    text: Text


class CalibratingCommand(Command, tag="calibrating"):
    """Begin or end to calibrate."""

    on: Switch


class SaveCalibrationCommand(Command, tag="save calibration"):
    """Save the calibration, and a report of it."""


class VerifyCommand(Command, tag="verify"):
    """Add the result on a known specimen to the calibration file."""


class CompareCommand(Command, tag="compare"):
    """Compare the recordings."""


class CutCommand(Command, tag="cut"):
    """Estimate a part of a recording as a touch."""

    from_s: Seconds
    to_s: Seconds


class ReportCommand(Command, tag="report"):
    """Write a report of the newest recording."""


class StopReportCommand(Command, tag="stop report"):
    """Stop the report that is being written."""


class SettingsCommand(Command, tag="settings"):
    """Set the options of later reports."""

    unit: Text = "MPa"
    shore: Switch = False
    probe: Text = ""
    site: Text = ""
    operator: Text = ""


class OpenCommand(Command, tag="open"):
    """Show another source: "measure", "demo", or the name of a listed recording."""

    what: Text


class NoiseCommand(Command, tag="noise"):
    """Answer the noise of the newest samples without contact."""


class ViewCommand(Command, tag="view"):
    """Send a view: the rows between two times in a frame with this number."""

    id: Count
    from_s: Seconds
    to_s: Seconds
    rows: Annotated[int, Meta(ge=2, le=LARGEST, description="an integer above 1")]


MeasurementCommand = (
    TareCommand
    | TareAnywayCommand
    | RecordCommand
    | StopCommand
    | AgainCommand
    | MarkCommand
    | MarkTextCommand
)
HandCommand = PressCommand | ReleaseCommand
"""Of the demo: they wait for no other command."""
DeviceCommands = UnderstoodCommand | CentreCommand | DeviceCommand
SessionCommand = (
    PlanCommand
    | SpecimenCommand
    | AssignCommand
    | NameCommand
    | DiscardCommand
    | KeepCommand
    | MoreCommand
    | NoteCommand
)
CalibrationCommand = CalibratingCommand | SaveCalibrationCommand | VerifyCommand
ReviewCommand = ReadListCommand | CompareCommand | CutCommand
ReportCommands = ReportCommand | StopReportCommand | SettingsCommand
PageCommand = NoiseCommand | ViewCommand
"""Of one page alone; the others are for all of them."""
BenchCommand = (
    MeasurementCommand
    | HandCommand
    | DeviceCommands
    | SessionCommand
    | CalibrationCommand
    | ReviewCommand
    | ReportCommands
)
AnyCommand = BenchCommand | OpenCommand | PageCommand

COMMANDS: dict[str, type[Command]] = {
    str(kind.__struct_config__.tag): kind for kind in AnyCommand.__args__
}
_DECODER = msgspec.json.Decoder(AnyCommand)
_RAW_DECODER = msgspec.json.Decoder(dict[str, msgspec.Raw])


def decode(message: str) -> AnyCommand:
    """Return the command of a message, or raise `RefusedCommand`.

    Examples
    --------
    >>> decode('{"do": "note", "text": "second specimen"}')
    NoteCommand(text='second specimen')
    >>> decode('{"do": "keep"}')
    Traceback (most recent call last):
    palpate.live.protocol.RefusedCommand: keep: got no touch, allowed: an integer above 0
    >>> decode('{"do": "format the disk"}')  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    palpate.live.protocol.RefusedCommand: do: got 'format the disk', allowed: tare, tare anyway, ...
    """
    try:
        command: AnyCommand = _DECODER.decode(message)
    except (msgspec.DecodeError, RecursionError) as error:
        raise RefusedCommand(_refusal(message) or f"message: {error}") from error
    for name, value in msgspec.structs.asdict(command).items():
        if isinstance(value, str) and not _can_be_shown(value):
            raise RefusedCommand(_got(name, value, Text))
    return command


def _can_be_shown(text: str) -> bool:
    lines = text.replace("\t", " ").splitlines()
    return all(line.isprintable() for line in lines)


def _refusal(message: str) -> str:
    """Return what is wrong with a message: its name, a field that is missing, wrong, or unknown; "": not found."""
    try:
        values = _RAW_DECODER.decode(message)
    except (msgspec.DecodeError, RecursionError):
        return f"message: got {quoted(message)}, allowed: a command as a JSON object"
    do = _plain(values.pop("do", msgspec.Raw(b"null")))
    kind = COMMANDS.get(do) if isinstance(do, str) else None
    if kind is None:
        return f"do: got {quoted(do)}, allowed: {', '.join(COMMANDS)}"
    for field in msgspec.structs.fields(kind):
        if field.name not in values:
            if field.required:
                return f"{do}: got no {field.name}, allowed: {_allowed(field.type)}"
            continue
        value = values.pop(field.name)
        try:
            msgspec.json.decode(value, type=field.type)
        except msgspec.DecodeError:
            return _got(field.name, _plain(value), field.type)
    for name in values:
        names = ", ".join(kind.__struct_fields__) or "no value"
        return f"{do}: got {quoted(name)}, allowed: {names}"
    return ""


def _plain(value: msgspec.Raw) -> object:
    """Return a value for a message about it."""
    try:
        return msgspec.json.decode(value)
    except (msgspec.DecodeError, RecursionError):
        return str(bytes(value), errors="replace")


def _got(name: str, value: object, kind: object) -> str:
    return f"{name}: got {quoted(value)}, allowed: {_allowed(kind)}"


def _allowed(kind: object) -> str:
    """Return what a field may be, in words."""
    known = msgspec.json.schema(kind)
    options = known.get("anyOf", [known])
    return " or ".join(each["description"] for each in options if "description" in each)
