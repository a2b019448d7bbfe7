"""Guided calibration: the fit after each touch, and the file at the end."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from palpate.calibration import Calibration
from palpate.calibration.grading import (
    CalibrationGrade,
    CalibrationJudgement,
    judge_calibration,
)
from palpate.calibration.placement import NumberedRatio, SpecimenRatios
from palpate.calibration.provenance import FileChecksum, Provenance, joined_texts, present_time
from palpate.calibration.selection import RatioChoice, Track, choose_ratio
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens
from palpate.errors import CalibrationError, MissingExtra, PalpateError
from palpate.files import write_file
from palpate.flags import advice, sentences
from palpate.live.measurement import Keywords, LiveMeasurement
from palpate.live.plan import KnownSpecimen, TouchKept, TouchPlan
from palpate.live.protocol import (
    CalibrationMessage,
    CalibrationPoint,
    RefusedCommand,
    RigidRatio,
    ShownCurve,
    ShownParameter,
)
from palpate.live.source_watch import SourceWatch
from palpate.recording.csv_reader import RecordingFile
from palpate.repeatability import objections
from palpate.report import CalibrationHead, calibration_page
from palpate.report.calibration_head import TITLE, LeftOutTouch
from palpate.report.recording_facts import NamedValue
from palpate.touch import Touch
from palpate.tracking import tracked

FEWEST = 3  # specimens of different moduli that eq. (2) needs
_POINTS = 81
_NEAR_S = 0.5  # two begins of one touch


@dataclass(frozen=True)
class ShownFit:
    """A fit for the page: the touches that are used, points, judgement, and the curve if there is one.

    `verdict`: the judgement in one sentence; `details`: the fit in the words of `palpate calibrate`. `grade`: "" if
    there are too few touches for a judgement.
    """

    touches: int
    points: list[CalibrationPoint]
    verdict: str
    grade: str
    look: list[int]
    doubts: list[str]
    details: str
    sound: bool
    parameters: list[ShownParameter]
    curve: ShownCurve | None
    rigid: RigidRatio | None


@dataclass(frozen=True)
class SavedCalibration:
    """A calibration that was saved: the message and its file; "": it is only in memory."""

    message: str
    file: str


class GuidedCalibration:
    """Fits a calibration to the touches so far, in a thread of its own, each time that they change.

    It is saved, with its report, by a button, or when nothing is lacking any more and it is good; the measurement goes
    on with it. The calibration of the demo is kept in memory only. `notify`: called from any thread when the message has changed.
    """

    def __init__(
        self,
        measurement: LiveMeasurement,
        plan: TouchPlan,
        watch: SourceWatch,
        notify: Callable[[], None] = lambda: None,
    ) -> None:
        self._measurement = measurement
        self._plan = plan
        self._watch = watch
        self._notify = notify
        self._files = measurement.files
        self._on = False
        self._saved = ""
        self._is_lacking = True  # touches were lacking since it was saved
        self._worker = ThreadPoolExecutor(1, "palpate-calibrating")
        self._is_waiting = False  # the worker will look at the touches
        self._fitted: list[KnownSpecimen] | None = None  # what `_shown` was fitted to
        self._shown: ShownFit | None = None
        plan.on_changed.append(self.look)

    def document(self) -> CalibrationMessage:
        """Return the message: the newest fit that is ready."""
        if not self._on:
            return CalibrationMessage(on=False)
        following = self._plan.progress.next
        message = CalibrationMessage(
            on=True,
            saved=self._saved or None,
            next=f"Next: {following}." if following else "",
        )
        shown = self._shown
        if shown:
            message.touches = shown.touches
            message.points = shown.points
            message.verdict = shown.verdict
            message.grade = shown.grade
            message.look = shown.look
            message.doubts = shown.doubts
            message.details = shown.details
            message.sound = shown.sound
            message.parameters = shown.parameters
            message.curve = shown.curve
            message.rigid = shown.rigid
        return message

    def doubt(self) -> str:
        """Return why the calibration that is being made is not good; "": it is, or none is made."""
        shown = self._shown
        if not self._on or self._saved or shown is None or shown.sound:
            return ""
        return shown.verdict

    def look(self) -> None:
        """Let the worker fit the touches as they are now, and save the calibration if nothing is lacking."""
        if self._on and not self._is_waiting:
            self._is_waiting = True
            self._worker.submit(self._look).add_done_callback(self._report)

    def _report(self, work: Future[None]) -> None:
        """Show an error of the worker."""
        error = work.exception()
        if error:
            self._measurement.notify(f"Error: calibrating: {type(error).__name__}: {error}")

    def _look(self) -> None:
        self._is_waiting = False
        if not self._on:
            return
        known = self._plan.known()
        following = self._plan.progress.next
        if known != self._fitted:
            self._shown = self._grown(known)
            self._fitted = known
        if following:
            self._is_lacking = True
        elif self._is_lacking and self._shown and self._shown.grade == CalibrationGrade.GOOD:
            self._is_lacking = False
            self._finish(self._shown)
        self._notify()

    def calibrating(self, on: bool) -> str:
        """Begin or end to calibrate; return the message."""
        if not on:
            self._on = False
            return "Calibrating has ended; nothing is lost."
        known = self._plan.known()
        if len(known) < FEWEST:
            raise RefusedCommand(
                f"Calibrating needs {FEWEST} specimens at least, of different known moduli; "
                f"{FEWEST - len(known)} to go. Give their moduli in the list of specimens."
            )
        self._on = True
        self._fitted = None
        self._is_lacking = True
        self.look()
        return f"Calibrating with {len(known)} specimens of known modulus."

    def save_calibration(self) -> SavedCalibration:
        """Save the calibration, and a report of it; return the answer."""
        known = self._plan.known()
        lacking = too_few(known)
        if lacking:
            raise RefusedCommand(lacking)
        _, specimens, found = self._fit(known)
        about = replace(found.about, provenance=self._provenance())
        found = replace(found, about=about)
        if self._is_demo:
            self._saved = "Kept in memory: the demo writes no file. It is used from now on."
            self.use(found, None)
            return SavedCalibration("Kept in memory; moduli are from it now.", "")
        path = self._files.free("probe.toml")
        found.save(path)
        self._files.made(path, "calibration")
        with suppress(MissingExtra):
            text = calibration_page(found, specimens, self._head(known))
            beside = self._files.free(f"{path.stem}-calibration.html")
            write_file(beside, text.encode())
            self._files.made(beside, "report")
        self._saved = f"Saved as {path.name}; it is used from now on."
        self.use(found, path)
        message = f"Saved as {path.name}; moduli are from it now."
        if not found.sound:
            message += " It is not reliable yet: its verdict is in the file."
        return SavedCalibration(message, path.name)

    def _head(self, known: Sequence[KnownSpecimen]) -> CalibrationHead:
        """Return the head of the report: session, operator, date, recording, touches left out."""
        session = self._plan.document
        recorder = self._measurement.newest_recorder
        recording = recorder.path.name if recorder else ""
        facts = [
            NamedValue("Operator", session.operator or ""),
            NamedValue("Date", f"{datetime.now().astimezone():%Y-%m-%d %H:%M:%S %Z}"),
            NamedValue("Recordings", recording or "not recorded"),
        ]
        title = session.title
        return CalibrationHead(
            f"{TITLE}: {title}" if title else TITLE,
            tuple(facts),
            left_out=tuple(_left_out(known, self._plan.rows, recording)),
        )

    def _provenance(self) -> Provenance:
        """Return where the touches of this run come from.

        The checksum of a recording that goes on covers its rows so far.
        """
        files = []
        for path in self._files.recordings():
            try:
                files.append(FileChecksum.of(path))
            except OSError as error:
                self._measurement.notify(f"{path.name}: no checksum: {error.strerror}")
        stated = self._files.settings
        operator = self._plan.operator or stated.operator
        return Provenance(
            date=present_time(),
            measured=self._watch.begun_at,
            probe=joined_texts([stated.probe]),
            operator=joined_texts([operator]),
            site=joined_texts([stated.site]),
            files=tuple(files),
            chips=tuple(sorted(self._watch.chips)),
            simulated=self._watch.simulated,
        )

    @property
    def _is_demo(self) -> bool:
        """Whether the page presses a simulated probe."""
        hand = self._measurement.hand
        return hand is not None and bool(hand.specimens)

    def use(self, found: Calibration, path: Path | None) -> None:
        """Go on with a calibration: with another measurement, if it needs other settings."""
        self._files.calibration = path
        self._plan.use_calibration(found)
        name = path.name if path else "a calibration in memory"
        text = f"moduli are from {name} from here on"
        self._plan.note(text)
        self._measurement.use(found.for_tracking(self._measurement.settings), text)

    def _fit(
        self, known: Sequence[KnownSpecimen]
    ) -> tuple[list[KnownSpecimen], list[SpecimenTouches], Calibration]:
        """Return the specimens with the touches as they are used, and the fit."""
        recorder = self._measurement.newest_recorder
        settings = self._measurement.settings
        chosen = RatioChoice("hold", {})
        track = None
        if recorder:
            track = _track(RecordingFile(recorder.path), settings, known)
        if track:
            chosen = choose_ratio([track], {each.name: each.modulus for each in known})
            known = _measured_again(known, track, chosen)
        specimens = []
        for each in known:
            if each.usable:
                specimens.append(
                    SpecimenTouches(
                        each.name,
                        each.modulus,
                        each.kept,
                        ratio_of=each.ratio_of,
                        modulus_uncertainty=each.modulus_uncertainty,
                    )
                )
        about = replace(chosen.about, scene=settings.get("scene", "handheld"))
        found = fit_specimens(specimens, exponents=chosen.exponents, about=about)
        return list(known), specimens, found

    def _finish(self, shown: ShownFit) -> None:
        """Save the calibration, and a report of the recording if there is one."""
        saved = "Not saved"
        try:
            with self._measurement.commands:
                saved = f"{self.save_calibration().message} There is no report"
            if self._files.compared():
                self._files.report()
        except OSError as failure:
            self._shown = replace(shown, verdict=f"{saved}: {failure.strerror or failure}.")
        except (ValueError, PalpateError) as failure:
            self._shown = replace(shown, verdict=f"{saved}: {failure}.")

    def _grown(self, known: Sequence[KnownSpecimen]) -> ShownFit:
        found = None
        failure = ""
        lacking = too_few(known)
        try:
            if not lacking:
                known, _, found = self._fit(known)
        except CalibrationError:
            failure = "the ratios do not rise along a curve so far"
        except (ValueError, PalpateError) as error:  # MissingExtra, too
            failure = str(error)
        judged = judge_calibration(found, _ratios(known), failure)
        if lacking:
            judged = CalibrationJudgement(CalibrationGrade.BAD, lacking)
        return ShownFit(
            touches=sum(len(each.usable) for each in known),
            points=_points(known, found),
            verdict=judged.sentence,
            grade="" if lacking else judged.grade.value,
            look=list(judged.touches),
            doubts=list(judged.doubts),
            details=found.verdict if found else "",
            sound=judged.grade == CalibrationGrade.GOOD,
            parameters=_parameters(found) if found else [],
            curve=_curve(found) if found else None,
            rigid=_rigid(found) if found else None,
        )


def _ratios(known: Sequence[KnownSpecimen]) -> list[SpecimenRatios]:
    """Return the ratios of the touches that a fit uses."""
    specimens = []
    for each in known:
        ratios = []
        for number, touch, is_kept in each.touches:
            if is_kept and not objections(touch, (), each.ratio_of):
                ratios.append(NumberedRatio(number, each.ratio_of(touch)[0]))
        specimens.append(SpecimenRatios(each.name, each.modulus, tuple(ratios)))
    return specimens


def _left_out(
    known: Sequence[KnownSpecimen], rows: Sequence[TouchKept], recording: str
) -> Iterator[LeftOutTouch]:
    """Yield the touches on specimens of known modulus that do not count, with the reasons.

    `rows`: what the plan knows of the touches of this measurement; earlier ones have numbers below 1.
    """
    for each in known:
        for number, touch, kept in each.touches:
            reasons = sentences(objections(touch, (), each.ratio_of), advice(touch))
            if not kept and number > 0:
                reasons = [rows[number - 1].why]
            if not kept and not reasons:
                reasons = ["left out by hand"]
            if reasons:
                yield LeftOutTouch(number, recording, each.name, tuple(reasons))


def _track(
    recording: RecordingFile, settings: Keywords, known: Sequence[KnownSpecimen]
) -> Track | None:
    """Return a recording with the specimen of each kept touch, by its reading; None: it does not have all of them."""
    touches = tracked(recording, **settings).touches
    kept = 0
    found = {}
    for each in known:
        for one in each.kept:
            kept += 1
            for touch in touches:
                if abs(touch.start_s - one.start_s) < _NEAR_S:
                    found[touch.start] = each.name
    return Track(recording, dict(settings), found) if len(found) == kept else None


def _measured_again(
    known: Sequence[KnownSpecimen], track: Track, chosen: RatioChoice
) -> list[KnownSpecimen]:
    """Return the specimens with the touches as the chosen settings measure them."""
    touches = tracked(track.recording, **{**track.tracking, **chosen.settings}).touches

    def again(one: Touch) -> Touch:
        near = min(touches, key=lambda touch: abs(touch.start_s - one.start_s), default=one)
        if (near.contact_exponent, near.age_s) == (one.contact_exponent, one.age_s):
            return one
        return near

    found = []
    for each in known:
        measured = tuple((number, again(one), kept) for number, one, kept in each.touches)
        found.append(replace(each, ratio_of=chosen.ratio_of, touches=measured))
    return found


def too_few(known: Sequence[KnownSpecimen]) -> str:
    """Return how many specimens are lacking before eq. (2) can be fitted, as a sentence; empty if there are enough."""
    begun = len({each.modulus for each in known if each.usable})
    return f"{FEWEST} specimens at least; {FEWEST - begun} to go." if begun < FEWEST else ""


def _parameters(found: Calibration) -> list[ShownParameter]:
    """Return the parameters of eq. (2), for the page."""
    return [ShownParameter(row.name, row.value, row.interval) for row in found.parameter_rows()]


def _curve(found: Calibration) -> ShownCurve:
    """Return points of the curve, for the page."""
    curve = found.curve(_POINTS)
    return ShownCurve(
        curve.modulus.tolist(), curve.ratio.tolist(), curve.low.tolist(), curve.high.tolist()
    )


def _rigid(found: Calibration) -> RigidRatio:
    """Return the ratio on a rigid object, for the page."""
    curve = found.curve(_POINTS)
    return RigidRatio(curve.rigid_ratio, curve.rigid_error)


def _points(known: Sequence[KnownSpecimen], found: Calibration | None) -> list[CalibrationPoint]:
    """Return the touches beside the curve, for the page."""
    points: list[CalibrationPoint] = []
    for each in known:
        fitted = found.probe.ratio(each.modulus) if found else None
        for number, touch, kept in each.touches:
            ratio = each.ratio_of(touch)[0]
            points.append(CalibrationPoint(each.modulus, each.name, fitted, number, ratio, kept))
    return points
