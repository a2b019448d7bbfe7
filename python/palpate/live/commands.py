"""The workbench: the parts behind a page, what they show, and who runs which command."""

from abc import abstractmethod
from collections.abc import Callable, Collection
from pathlib import Path
from typing import assert_never

from palpate.calibration import Calibration
from palpate.flags import advice
from palpate.live.annotations import Annotations
from palpate.live.calibration_fit import GuidedCalibration
from palpate.live.compare import compared
from palpate.live.connection import ConnectionState
from palpate.live.device import Device
from palpate.live.file_review import RecordedMeasurement
from palpate.live.instruction_rules import file_state
from palpate.live.measurement import LiveMeasurement, Measurement
from palpate.live.page_commands import (
    AgainCommand,
    AssignCommand,
    BenchCommand,
    CalibratingCommand,
    CalibrationCommand,
    CentreCommand,
    CompareCommand,
    CutCommand,
    DeviceCommand,
    DeviceCommands,
    DiscardCommand,
    HandCommand,
    KeepCommand,
    MarkCommand,
    MarkTextCommand,
    MeasurementCommand,
    MoreCommand,
    NameCommand,
    NoteCommand,
    PlanCommand,
    PressCommand,
    ReadListCommand,
    RecordCommand,
    ReleaseCommand,
    ReportCommand,
    ReportCommands,
    ReviewCommand,
    SaveCalibrationCommand,
    SessionCommand,
    SettingsCommand,
    SpecimenCommand,
    StopCommand,
    StopReportCommand,
    TareAnywayCommand,
    TareCommand,
    UnderstoodCommand,
    VerifyCommand,
)
from palpate.live.plan import TouchPlan
from palpate.live.protocol import (
    Answer,
    CalibrationMessage,
    DeviceMessage,
    DoneMessage,
    HelloMessage,
    Message,
    RefusedCommand,
    StateMessage,
    StatusState,
    VerificationMessage,
)
from palpate.live.source_watch import SourceWatch
from palpate.live.specimen_check import SpecimenCheck
from palpate.live.touch_rows import TouchTable
from palpate.uncertainty import TOUCH_SCATTER

LiveCommand = MeasurementCommand | DeviceCommands | CalibrationCommand
"""Commands of a measurement that runs."""
OnlyOne = LiveCommand | SessionCommand
"""Commands that run one after the other; the rest takes seconds, and changes nothing that another one needs."""


class Workbench:
    """What a page shows of a measurement or of a recording, and the commands that both have; made before the start.

    `scatter`: relative scatter from touch to touch without a calibration, for whether touches agree, and for the uncertainty.
    `accept`: what is accepted of the calibration, of `palpate.calibration.origin.AcceptedOrigin`. `on_news`: called from
    any thread when the touches or what is in `news` have changed.
    """

    def __init__(
        self,
        measurement: Measurement,
        source: str,
        calibration: Calibration | None = None,
        scatter: float = TOUCH_SCATTER,
        calibration_file: Path | None = None,
        accept: Collection[str] = (),
    ) -> None:
        self.measurement = measurement
        self.on_news: Callable[[], None] = lambda: None
        measurement.files.calibration = calibration_file
        measurement.files.accept = tuple(accept)
        self.plan = TouchPlan(measurement, calibration)
        self.table = TouchTable(measurement, self.plan, scatter)
        self.annotations = Annotations(measurement)
        self.source = source
        self.plan.on_changed.append(self.publish)

    def publish(self) -> None:
        """Call `on_news`."""
        self.on_news()

    def hello(self) -> HelloMessage:
        """Return what does not change during a measurement."""
        return self.table.hello(self.source)

    def look(self) -> bool:
        """Look at the measurement; return whether word, line or announcement are other ones than before."""
        return False

    def state(self) -> StateMessage:
        """Return the values that change during a measurement, as of the last look."""
        ratio = self.table.now()
        files = self.measurement.recording_state()
        status = self._status()
        return StateMessage(
            state=ratio.state,
            end_s=ratio.end_s,
            ratio=ratio.ratio,
            standard_error=ratio.standard_error,
            uncertainty=ratio.uncertainty,
            uncertainty_from=ratio.uncertainty_from,
            modulus=ratio.modulus,
            recording=files.recording,
            counters=files.counters,
            proposed=files.proposed,
            files=files.files,
            progress=files.progress,
            comparable=files.comparable,
            now=status.now,
            line=status.line,
            announce=status.announce,
            on=status.on,
        )

    def changing(self) -> list[Message]:
        """Return the messages that may have changed at any time."""
        return [self.hello(), self.annotations.document()]

    def news(self) -> list[Message]:
        """Return the messages that change with `on_news`, but the touches."""
        return [self.plan.document]

    def run(self, command: BenchCommand) -> Answer:
        """Run a command of a page; return the answer. May wait for the disk.

        Raises `RefusedCommand` if it is not possible now, or not here; and what `Stream` raises.
        """
        if isinstance(command, ReviewCommand):
            return self._review(command)
        if isinstance(command, ReportCommands):
            return self._report(command)
        if isinstance(command, HandCommand):
            return DoneMessage(command.do, self._move_hand(command))
        with self.measurement.commands:
            return self._run_one(command)

    def _run_one(self, command: OnlyOne) -> Answer:
        if isinstance(command, SessionCommand):
            return DoneMessage(command.do, self._change_session(command))
        return self._measure(command)

    def _change_session(self, command: SessionCommand) -> str:
        """Run a command about the specimens and their touches; return the message."""
        plan = self.plan
        match command:
            case PlanCommand(text, wanted, unit, title, operator):
                return plan.plan(text, wanted, unit, title, operator)
            case SpecimenCommand(name):
                return plan.specimen(name)
            case AssignCommand(touch, name):
                return plan.assign(touch, name)
            case NameCommand(touches, text):
                return plan.name(touches, text)
            case DiscardCommand(touch):
                return plan.discard(touch)
            case KeepCommand(touch):
                return plan.keep(touch)
            case MoreCommand():
                return plan.more()
            case NoteCommand(text):
                return plan.note(text)
        assert_never(command)

    def _measure(self, command: LiveCommand) -> Answer:
        """Run a command of a measurement that runs."""
        raise RefusedCommand(f"{command.do}: this is a recording, nothing is measured")

    def _move_hand(self, command: HandCommand) -> str:
        """Press or lift the probe of the demo; return the message."""
        hand = self.measurement.hand
        if hand is None:
            raise RefusedCommand(f"{command.do}: got it without a simulation, allowed: with demo:")
        match command:
            case PressCommand(specimen):
                hand.press(specimen)
                return f"Pressing on {specimen}."
            case ReleaseCommand():
                hand.release()
                return "Lifted."
        assert_never(command)

    def _review(self, command: ReviewCommand) -> Answer:
        """Run a command that reads."""
        match command:
            case ReadListCommand(text, unit):
                return DoneMessage(command.do, "", lines=self.plan.read_list(text, unit))
            case CompareCommand():
                return compared(self.measurement.files.compared(), self.table.calibration)
            case CutCommand(from_s, to_s):
                return DoneMessage(command.do, self._cut(from_s, to_s))
        assert_never(command)

    def _report(self, command: ReportCommands) -> Answer:
        """Run a command about reports."""
        files = self.measurement.files
        match command:
            case ReportCommand():
                name = files.report()
                return DoneMessage(command.do, f"The report is {name}.", file=name)
            case StopReportCommand():
                return DoneMessage(command.do, files.stop_report())
            case SettingsCommand():
                files.use_settings(command)
                return DoneMessage(command.do, "")
        assert_never(command)

    @abstractmethod
    def _status(self) -> StatusState:
        """Return what to do, and what is wrong."""

    @abstractmethod
    def _cut(self, from_s: float, to_s: float) -> str:
        """Estimate the part of a recording between two times as a touch; return the result, or why there is none."""


class FileWorkbench(Workbench):
    """What a page shows of a recording."""

    def __init__(
        self,
        measurement: RecordedMeasurement,
        source: str,
        calibration: Calibration | None = None,
        scatter: float = TOUCH_SCATTER,
        calibration_file: Path | None = None,
        accept: Collection[str] = (),
    ) -> None:
        super().__init__(measurement, source, calibration, scatter, calibration_file, accept)
        self._recorded = measurement

    # Empty messages, for a page that showed a measurement before.
    def changing(self) -> list[Message]:
        """Return the messages that may have changed at any time; a recording has no device."""
        return [*super().changing(), DeviceMessage([], {}, can_centre=False)]

    def news(self) -> list[Message]:
        """Return the messages that change with `on_news`, but the touches; nothing is calibrated."""
        verification = VerificationMessage("", agrees=True, kept=True)
        return [*super().news(), CalibrationMessage(on=False), verification]

    def _status(self) -> StatusState:
        """Return that nothing is measured."""
        return file_state(self._recorded.file)

    def _cut(self, from_s: float, to_s: float) -> str:
        """Estimate a part of the recording as a touch; return the result, or why there is none."""
        try:
            touch = self._recorded.cut(from_s, to_s)
        except ValueError as error:
            return str(error)
        result = f"A to B: {self.table.result(touch)}, {touch.samples} samples"
        return "; ".join([result, *map(str, advice(touch))])


class LiveWorkbench(Workbench):
    """What a page shows of a measurement that runs, and its commands."""

    def __init__(
        self,
        measurement: LiveMeasurement,
        source: str,
        calibration: Calibration | None = None,
        scatter: float = TOUCH_SCATTER,
        calibration_file: Path | None = None,
        accept: Collection[str] = (),
    ) -> None:
        super().__init__(measurement, source, calibration, scatter, calibration_file, accept)
        self.live = measurement
        watch = SourceWatch(measurement, self.plan, accept)
        self.status = ConnectionState(measurement, self.plan, self.table, watch=watch)
        self.device = Device(measurement, self.status, source)
        self.guided = GuidedCalibration(measurement, self.plan, watch, self.publish)
        self.status.calibration_doubt = self.guided.doubt
        self.check = SpecimenCheck(measurement, self.plan, watch)

    def look(self) -> bool:
        """Look at the measurement; return whether word, line or announcement are other ones than before."""
        return self.status.look()

    def changing(self) -> list[Message]:
        """Return the messages that may have changed at any time."""
        return [*super().changing(), self.device.document()]

    def news(self) -> list[Message]:
        """Return the messages that change with `on_news`, but the touches."""
        return [*super().news(), self.guided.document(), self.check.document()]

    def _status(self) -> StatusState:
        return self.status.document()

    def _cut(self, from_s: float, to_s: float) -> str:
        raise RefusedCommand("cut: got it in a measurement, allowed: in a recording")

    def _measure(self, command: LiveCommand) -> Answer:
        """Run a command of a measurement that runs."""
        if isinstance(command, MeasurementCommand):
            return self._tare_and_record(command)
        if isinstance(command, DeviceCommands):
            return DoneMessage(command.do, self._set_device(command))
        return self._calibrate(command)

    def _tare_and_record(self, command: MeasurementCommand) -> DoneMessage:
        measurement = self.live
        match command:
            case TareCommand():
                message = measurement.tare()
            case TareAnywayCommand():
                message = measurement.tare(force=True)
            case RecordCommand(name):
                message = measurement.record(name)
            case StopCommand():
                message = measurement.stop()
            case AgainCommand():
                message = measurement.again()
            case MarkCommand():
                mark = measurement.mark()
                return DoneMessage(command.do, mark.message, id=mark.id)
            case MarkTextCommand(number, text):
                mark = measurement.mark_text(number, text)
                return DoneMessage(command.do, mark.message, id=mark.id)
            case _:
                assert_never(command)
        return DoneMessage(command.do, message)

    def _set_device(self, command: DeviceCommands) -> str:
        """Run a command about the device; return the message."""
        match command:
            case UnderstoodCommand():
                self.status.understood()
                return ""
            case CentreCommand():
                return self.device.centre()
            case DeviceCommand():
                return self.device.set(command)
        assert_never(command)

    def _calibrate(self, command: CalibrationCommand) -> DoneMessage:
        match command:
            case CalibratingCommand(on):
                return DoneMessage(command.do, self.guided.calibrating(on))
            case SaveCalibrationCommand():
                saved = self.guided.save_calibration()
                return DoneMessage(command.do, saved.message, file=saved.file)
            case VerifyCommand():
                return DoneMessage(command.do, self.check.verify())
        assert_never(command)
