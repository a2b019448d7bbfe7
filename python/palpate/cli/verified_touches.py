"""Touches on a specimen of known modulus for `palpate verify`: of recordings, or measured now."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import NamedTuple

import click

from palpate import Calibration, Touch, Uncertainty
from palpate.ad7746.registers import linearity_pF
from palpate.calibration.assurance import today
from palpate.calibration.origin import ReadingsOrigin, origin_remarks, require_origin
from palpate.calibration.provenance import Provenance, recorded_at
from palpate.calibration.ranges import wider
from palpate.calibration.specimen_files import name_key
from palpate.cli.exit_codes import usage_errors
from palpate.cli.output import print_message, print_notes
from palpate.cli.shared_options import Keywords, SourceOptions, TrackerOptions, simulation_note
from palpate.cli.specimen_moduli import has_session
from palpate.display.text import counted
from palpate.files import Json
from palpate.flags import advice
from palpate.messages import unlike
from palpate.recording.reading import recorded
from palpate.recording.verification import verification_of
from palpate.report.findings import AnalysedRecording
from palpate.stream.listeners import Listener
from palpate.tracking import tracked

_SIMULATED = (
    "the touches are simulated, but the calibration was made with a probe: they are no evidence"
)


@dataclass(frozen=True)
class VerifiedTouch:
    """A touch on the specimen.

    Attributes
    ----------
    place : str
        Name of the recording or source.
    number : int
        In it, from 1.
    touch : palpate.Touch
    uncertainty : palpate.Uncertainty
    left_out : tuple of str
        Why it does not count; empty: it counts.
    remarks : tuple of str
        Sentences: what its flags mean, and how it differs from the touches that calibrated.
    """

    place: str
    number: int
    touch: Touch
    uncertainty: Uncertainty
    left_out: tuple[str, ...]
    remarks: tuple[str, ...]

    @classmethod
    def of(
        cls,
        calibration: Calibration,
        place: str,
        number: int,
        touch: Touch,
        linearity: float,
        *,
        by_hand: str = "",
    ) -> "VerifiedTouch":
        """Return a touch; `by_hand`: why a person left it out, "": it is kept."""
        ratio_of = calibration.ratio_of
        reasons = [by_hand, *map(str, calibration.objections(touch))]
        differences = map(wider, calibration.differences(touch))
        return cls(
            place,
            number,
            touch,
            Uncertainty.of(touch, calibration.touch_scatter, linearity, ratio_of),
            left_out=tuple(filter(None, reasons)),
            remarks=(*map(str, advice(touch)), *differences),
        )


@dataclass(frozen=True)
class VerifiedTouches:
    """The touches on the specimen, and what is wrong with them.

    Attributes
    ----------
    touches : tuple of VerifiedTouch
    doubts : tuple of str
        Why they are no evidence.
    missing : str
        How many touches are missing; "": none.
    scene : str
        Of the tracker.
    date : str
        When they were measured, UTC, as 2026-11-29.
    others : mapping of sequence of Touch
        Touches on other specimens, by their names: they show the contact exponent, too.
    """

    touches: tuple[VerifiedTouch, ...]
    doubts: tuple[str, ...] = ()
    missing: str = ""
    scene: str = "handheld"
    date: str = ""
    others: Mapping[str, Sequence[Touch]] = field(default_factory=dict)

    @property
    def counted(self) -> list[Touch]:
        """The touches that count."""
        return [one.touch for one in self.touches if not one.left_out]


def analyse(
    file: Path, calibration: Calibration, reading: SourceOptions, tracker: TrackerOptions
) -> AnalysedRecording:
    """Measure the touches of a recording with the settings of the calibration; print the notes."""
    with usage_errors(f"{file}: "):
        recording = recorded(file, **_without_board(reading))
        tracking = tracker.for_recording(recording, calibration)
        found = tracked(recording, **tracking)
    notes = [recording.understood, simulation_note(recording), *recording.notes]
    print_notes(file, notes)
    return AnalysedRecording(file.name, recording, tracking, found, verification_of(recording))


def _without_board(reading: SourceOptions) -> Keywords:
    """Return the options for a recording; those for a board are refused."""
    for name, value in (("firmware", reading.firmware), ("excitation", reading.excitation)):
        if value is not None:
            raise click.UsageError(f"--{name}: got it with a recording, allowed: with a board")
    return reading.keywords()


def touches_in(
    runs: Sequence[AnalysedRecording],
    specimen: str,
    calibration: Calibration,
    accept: Collection[str],
) -> VerifiedTouches:
    """Return the touches of recordings on the specimen.

    Raises
    ------
    click.UsageError
        The sessions of the recordings name specimens, but not this one.
    CalibrationRefused
        A recording is of another chip, or the calibration is simulated, and that is not accepted.
    """
    provenance = calibration.about.provenance
    touches: list[VerifiedTouch] = []
    others: dict[str, list[Touch]] = {}
    doubts = []
    for run in runs:
        origin = ReadingsOrigin.of_sidecar(run.recording.sidecar)
        doubts += [f"{run.name}: {doubt}" for doubt in run.recording.doubts]
        doubts += _doubts_of_origin(run.name, provenance, origin, accept)
        linearity = linearity_pF(run.recording.full_scale_pF)
        for one in _named_touches(run, specimen):
            if name_key(one.specimen) != name_key(specimen):
                others.setdefault(one.specimen, []).append(one.touch)
                continue
            found = VerifiedTouch.of(
                calibration,
                run.name,
                one.number,
                one.touch,
                linearity,
                by_hand=one.left_out,
            )
            touches.append(found)
    if others and not touches:
        raise click.UsageError(f"SPECIMEN: {unlike(specimen, others)}")
    return VerifiedTouches(
        tuple(touches),
        tuple(doubts),
        scene=str(runs[0].tracking["scene"]),
        date=max(filter(None, map(_date_of, runs)), default=today()),
        others=others,
    )


def _doubts_of_origin(
    place: str, provenance: Provenance, origin: ReadingsOrigin, accept: Collection[str]
) -> list[str]:
    """Return why readings of an origin are no evidence; print remarks; refuse what does not match."""
    require_origin(place, provenance, origin, accept)
    if provenance.simulated is False and origin.simulated:
        return [f"{place}: {_SIMULATED}"]
    print_notes(place, origin_remarks(provenance, origin))
    return []


class _NamedTouch(NamedTuple):
    """A touch of a recording, its number, its specimen, and why a person left it out."""

    number: int
    touch: Touch
    specimen: str
    left_out: str


def _named_touches(run: AnalysedRecording, specimen: str) -> Iterator[_NamedTouch]:
    """Yield the touches of a recording; without names in its session all are on the specimen."""
    has_names = has_session(run)
    touches = run.found.touches
    entries = run.plan.matched(touches, run.period_s)
    for number, (touch, entry) in enumerate(zip(touches, entries, strict=True), 1):
        if not has_names:
            yield _NamedTouch(number, touch, specimen, "")
        elif entry and entry.specimen:
            yield _NamedTouch(number, touch, entry.specimen, entry.left_out or "")


def _date_of(run: AnalysedRecording) -> str:
    """Return when a recording began, UTC, as 2026-11-29; "": unknown."""
    began = recorded_at(run.recording.sidecar)
    if began is None:
        return ""
    return min(began.date().isoformat(), today())


@dataclass(frozen=True)
class Measurement:
    """A measurement of touches on the specimen, without a screen.

    Attributes
    ----------
    source : str
    wanted : int
        Number of touches.
    output : pathlib.Path or None
        The recording to write.
    reading : SourceOptions
    tracker : TrackerOptions
    accept : collection of str
        What is accepted of the calibration.
    """

    source: str
    wanted: int
    output: Path | None
    reading: SourceOptions
    tracker: TrackerOptions
    accept: Collection[str]

    def touches(self, calibration: Calibration, specimen: str) -> VerifiedTouches:
        """Measure the touches on the specimen."""
        from palpate import sources
        from palpate.cli.printer import MeasurementPrinter, TouchCounter
        from palpate.cli.record import Limits, measure, signals_stop
        from palpate.stream import Stream

        tracking = self._tracking(calibration)
        with usage_errors():
            opened = sources.open(self.source, **self.reading.keywords())
            stream = Stream(
                opened,
                record=self.output,
                notes=[f"verification with {specimen}"],
                notify=print_message,
                capacity=None if opened.live else 2,
                **tracking,
            )
        printer = MeasurementPrinter(stream, quiet=True)
        check = _OriginCheck(self.source, calibration.about.provenance, self.accept)
        for listener in (check, printer, TouchCounter(self.wanted)):
            stream.listen(listener)
        print_message(f"{specimen}: {counted(self.wanted, 'touch')} to measure")
        try:
            with signals_stop(stream) as received:
                measure(stream, printer, Limits(self.wanted, inf, recentre=False))
        finally:
            printer.clear_status()
        if received:
            raise KeyboardInterrupt
        linearity = linearity_pF(stream.tracker.settings["full_scale"])
        touches = []
        for number, touch in enumerate(stream.touches, 1):
            one = VerifiedTouch.of(calibration, self.source, number, touch, linearity)
            touches.append(one)
        return VerifiedTouches(
            tuple(touches),
            tuple(check.doubts),
            missing=self._missing(len(touches)),
            scene=str(tracking["scene"]),
            date=today(),
        )

    def _tracking(self, calibration: Calibration) -> Keywords:
        """Return scene and settings: those given, else those of the calibration."""
        given = self.tracker.keywords()
        usual: Keywords = {"scene": calibration.about.scene or "handheld"}
        return calibration.for_tracking(usual | given) | given

    def _missing(self, measured: int) -> str:
        if measured >= self.wanted:
            return ""
        return f"{measured} of {self.wanted} touches were measured"


class _OriginCheck(Listener):
    """Compares the board with the calibration when it is opened.

    Attributes
    ----------
    doubts : list of str
        Why its readings are no evidence.
    """

    def __init__(self, place: str, provenance: Provenance, accept: Collection[str]) -> None:
        self.doubts: list[str] = []
        self._place = place
        self._provenance = provenance
        self._accept = accept

    def opened(self, device: Json) -> None:
        """Compare; CalibrationRefused before anything is recorded."""
        origin = ReadingsOrigin.of_device(device)
        self.doubts += _doubts_of_origin(self._place, self._provenance, origin, self._accept)
