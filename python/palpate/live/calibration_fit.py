"""Guided calibration: the fit after each touch, and the file at the end."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from palpate.calibration import Calibration
from palpate.calibration.provenance import FileChecksum, Provenance, joined_texts, present_time
from palpate.calibration.selection import RatioChoice, Track, choose_ratio
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens
from palpate.errors import CalibrationError, MissingExtra, PalpateError
from palpate.files import write_file
from palpate.flags import advice, sentences
from palpate.live.feed import Document, RefusedCommand
from palpate.live.measurement import LiveMeasurement
from palpate.live.plan import KnownSpecimen, TouchPlan
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


class GuidedCalibration:
    """Fits a calibration to the touches so far, in a thread of its own.

    It is saved, with its report, by a button, or when nothing is lacking any more and the fit is sound; the measurement
    goes on with it.
    """

    def __init__(self, measurement: LiveMeasurement, plan: TouchPlan, watch: SourceWatch) -> None:
        self._measurement, self._plan = measurement, plan
        self._watch = watch
        self._files = measurement.files
        self._on, self._saved, self._lacked = False, "", True
        self._worker = ThreadPoolExecutor(1, "palpate-calibrating")
        self._seen: Any = None
        self._running: Future[Document] | None = None
        self._shown: Document = {}

    def document(self) -> Document:
        """Return the message: the newest fit that is ready, and never one of other touches with these."""
        if not self._on:
            return {"on": False}
        known = self._plan.known()
        if self._running and self._running.done():
            self._shown, self._running = self._running.result(), None
        if known != self._seen and self._running is None:
            self._seen = known
            self._running = self._worker.submit(self._grown, known)
        following = self._plan.progress.next
        if self._lacked and not following and self._running is None and self._shown.get("sound"):
            self._lacked, self._running = False, self._worker.submit(self._finished)
        self._lacked |= bool(following)
        return {
            "on": True,
            "saved": self._saved or None,
            "next": f"Next: {following}." if following else "",
            **self._shown,
        }

    def calibrating(self, on: bool) -> str:
        """Begin or end to calibrate; return the message."""
        if not on:
            self._on = False
            return "Calibrating has ended; nothing is lost."
        known = self._plan.known()
        if len(known) < FEWEST:
            raise RefusedCommand(
                f"Calibrating needs {FEWEST} specimens at least, of different known moduli; {FEWEST - len(known)} to go. "
                "Give their moduli in the list of specimens."
            )
        self._on, self._seen, self._lacked = True, None, True
        return f"Calibrating with {len(known)} specimens of known modulus."

    def save_calibration(self) -> Document:
        """Save the calibration, and a report of it; return the answer."""
        if lacking := too_few(known := self._plan.known()):
            raise RefusedCommand(lacking)
        _, specimens, found = self._fit(known)
        about = replace(found.about, provenance=self._provenance())
        found = replace(found, about=about)
        path = self._files.free("probe.toml")
        found.save(path)
        self._files.made(path, "calibration")
        with suppress(MissingExtra):
            text = calibration_page(found, specimens, self._head(known))
            beside = self._files.free(f"{path.stem}-calibration.html")
            write_file(beside, text.encode())
            self._files.made(beside, "report")
        self._saved = path.name
        self.use(found, path)
        doubt = "" if found.sound else " It is not reliable yet: its verdict is in the file."
        return {
            "message": f"Saved as {path.name}; moduli are from it now.{doubt}",
            "file": path.name,
        }

    def _head(self, known: Sequence[KnownSpecimen]) -> CalibrationHead:
        """Return the head of the report: session, operator, date, recording, touches left out."""
        session = self._plan.document
        recorder = self._measurement.newest_recorder
        recording = recorder.path.name if recorder else ""
        facts = [
            NamedValue("Operator", session["operator"] or ""),
            NamedValue("Date", f"{datetime.now().astimezone():%Y-%m-%d %H:%M:%S %Z}"),
            NamedValue("Recordings", recording or "not recorded"),
        ]
        title = session["title"]
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
                self._measurement.say(f"{path.name}: no checksum: {error.strerror}")
        operator = self._plan.operator or self._files.stated("operator")
        return Provenance(
            date=present_time(),
            measured=self._watch.begun_at,
            probe=joined_texts([self._files.stated("probe")]),
            operator=joined_texts([operator]),
            site=joined_texts([self._files.stated("site")]),
            files=tuple(files),
            chips=tuple(sorted(self._watch.chips)),
            simulated=self._watch.simulated,
        )

    def use(self, found: Calibration, path: Path) -> None:
        """Go on with a calibration: with another measurement, if it needs other settings."""
        self._plan.progress.calibration, self._files.calibration = found, path
        said = f"moduli are from {path.name} from here on"
        self._plan.note(said)
        self._measurement.use(found.for_tracking(self._measurement.how), said)

    def _fit(
        self, known: Sequence[KnownSpecimen]
    ) -> tuple[list[KnownSpecimen], list[SpecimenTouches], Calibration]:
        """Return the specimens with the touches as they are used, and the fit."""
        recorder, how = self._measurement.newest_recorder, self._measurement.how
        chosen = RatioChoice("hold", {})
        if recorder and (track := _track(RecordingFile(recorder.path), how, known)):
            chosen = choose_ratio([track], {each.name: each.modulus for each in known})
            known = _measured_again(known, track, chosen)
        specimens = [
            SpecimenTouches(
                e.name,
                e.modulus,
                e.kept,
                ratio_of=e.ratio_of,
                modulus_uncertainty=e.modulus_uncertainty,
            )
            for e in known
            if e.usable
        ]
        return (
            list(known),
            specimens,
            fit_specimens(
                specimens,
                exponents=chosen.exponents,
                about=replace(chosen.about, scene=how.get("scene", "handheld")),
            ),
        )

    def _finished(self) -> Document:
        """Save the calibration, and a report of the recording if there is one."""
        saved = "Not saved"
        try:
            with self._measurement.commands:
                saved = f"Saved as {self.save_calibration()['file']}, but without a report"
            if self._files.compared():
                self._files.report()
        except (OSError, ValueError, PalpateError) as failure:
            return {
                **self._shown,
                "verdict": f"{saved}: {getattr(failure, 'strerror', None) or failure}.",
            }
        return self._shown

    def _grown(self, known: Sequence[KnownSpecimen]) -> Document:
        found, verdict = None, too_few(known)
        try:
            if not verdict:
                known, _, found = self._fit(known)
                verdict = found.verdict
        except CalibrationError:
            verdict = "Not enough yet. The ratios do not rise along a curve so far: go on, to softer and stiffer specimens."
        except (ValueError, PalpateError) as failure:  # MissingExtra, too
            verdict = str(failure)
        return {
            "touches": sum(len(each.usable) for each in known),
            "points": _points(known, found),
            "verdict": verdict,
            "sound": bool(found and found.sound),
            **_fitted(found),
        }


def _left_out(
    known: Sequence[KnownSpecimen], rows: Sequence[Document], recording: str
) -> Iterator[LeftOutTouch]:
    """Yield the touches on specimens of known modulus that do not count, with the reasons.

    `rows`: what the plan knows of the touches of this measurement; earlier ones have numbers below 1.
    """
    for each in known:
        for number, touch, kept in each.touches:
            reasons = sentences(objections(touch, (), each.ratio_of), advice(touch))
            if not kept and number > 0:
                reasons = [rows[number - 1]["why"]]
            if not kept and not reasons:
                reasons = ["left out by hand"]
            if reasons:
                yield LeftOutTouch(number, recording, each.name, tuple(reasons))


def _track(
    recording: RecordingFile, how: dict[str, Any], known: Sequence[KnownSpecimen]
) -> Track | None:
    """Return a recording with the specimen of each kept touch, by its reading; None: it does not have all of them."""
    starts = [(touch.start_s, touch.start) for touch in tracked(recording, **how).touches]
    kept = [(one.start_s, each.name) for each in known for one in each.kept]
    found = {
        start: name
        for at_s, name in kept
        for start_s, start in starts
        if abs(start_s - at_s) < _NEAR_S
    }
    return Track(recording, how, found) if len(found) == len(kept) else None


def _measured_again(
    known: Sequence[KnownSpecimen], track: Track, chosen: RatioChoice
) -> list[KnownSpecimen]:
    """Return the specimens with the touches as the chosen settings measure them."""
    touches = tracked(track.recording, **{**track.tracking, **chosen.settings}).touches

    def again(one: Touch) -> Touch:
        near = min(touches, key=lambda touch: abs(touch.start_s - one.start_s), default=one)
        return (
            one
            if (near.contact_exponent, near.age_s) == (one.contact_exponent, one.age_s)
            else near
        )

    return [
        replace(
            each,
            ratio_of=chosen.ratio_of,
            touches=tuple((n, again(one), kept) for n, one, kept in each.touches),
        )
        for each in known
    ]


def too_few(known: Sequence[KnownSpecimen]) -> str:
    """Return how many specimens are lacking before eq. (2) can be fitted, as a sentence; empty if there are enough."""
    begun = len({each.modulus for each in known if each.usable})
    return f"{FEWEST} specimens at least; {FEWEST - begun} to go." if begun < FEWEST else ""


def _fitted(found: Calibration | None) -> Document:
    if found is None:
        return {"parameters": [], "curve": None, "rigid": None}
    curve = found.curve(_POINTS)
    columns = {
        "modulus": curve.modulus,
        "ratio": curve.ratio,
        "low": curve.low,
        "high": curve.high,
    }
    return {
        "parameters": [row._asdict() for row in found.parameter_rows()],
        "curve": {name: values.tolist() for name, values in columns.items()},
        "rigid": {
            "value": curve.rigid_ratio,
            "error": curve.rigid_error,
        },
    }


def _points(known: Sequence[KnownSpecimen], found: Calibration | None) -> list[Document]:
    points: list[Document] = []
    for each in known:
        fitted = found.probe.ratio(each.modulus) if found else None
        named = {"modulus": each.modulus, "specimen": each.name, "fitted": fitted}
        points += [
            {**named, "touch": n, "ratio": each.ratio_of(touch)[0], "kept": kept}
            for n, touch, kept in each.touches
        ]
    return points
