"""The touches of recordings with their specimens, and the result of each specimen."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, log, nan
from pathlib import Path
from statistics import fmean
from typing import Any, NamedTuple

import numpy as np

from palpate import number_format
from palpate.ad7746.registers import linearity_pF
from palpate.calibration.learning import learned_from
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import Modulus, UncertaintyPart
from palpate.calibration.ranges import wider
from palpate.calibration.specimen_files import name_key, specimen_in
from palpate.errors import CalibrationError
from palpate.flags import advice_at_end, sentences
from palpate.materials import KnownModulus
from palpate.recording.opened import OpenedRecording
from palpate.recording.reading import recorded
from palpate.recording.session import PERIOD_S, Plan
from palpate.recording.verification import Verification, verification_of
from palpate.repeatability import Agreement, agreement, objections, session_scatter, with_scatter
from palpate.report.anova import Repeatability, one_way_anova
from palpate.touch import Touch
from palpate.tracking import Tracked, tracked
from palpate.uncertainty import RatioOf, Scatter, Uncertainty, hold_ratio, level_ratio


@dataclass(frozen=True)
class AnalysedRecording:
    """A recording, the touches that a scene and settings find in it, its checks, and its session.

    Attributes
    ----------
    name : str
        Its name in a report.
    recording : OpenedRecording
    tracking : dict
        Scene and settings of the tracker.
    found : palpate.tracking.Tracked
    checked : palpate.recording.verification.Verification
    """

    name: str
    recording: OpenedRecording
    tracking: Mapping[str, Any]
    found: Tracked
    checked: Verification

    @property
    def plan(self) -> Plan:
        """The session: specimens, and which touch is on which of them."""
        return self.recording.sidecar.session

    @property
    def first_s(self) -> float:
        """The first time, s; nan: unknown."""
        return self.recording.survey.first_ns / 1e9 if self.recording.timed else nan

    @property
    def period_s(self) -> float:
        """The mean time from pair to pair, s; nan: unknown."""
        return self.recording.survey.period_s if self.recording.timed else nan


def analyse_recording(
    path: Path,
    name: str,
    tracking: Mapping[str, Any] | None = None,
    progress: Callable[[str], None] = lambda _: None,
    **reading: Any,
) -> AnalysedRecording:
    """Read a recording, track its touches, and check it.

    Parameters
    ----------
    path : pathlib.Path
    name : str
        Its name in a report.
    tracking : mapping, optional
        Scene and settings of the tracker; default: from the recording.
    progress : callable
        Receives the progress as a text; an error that it raises ends the work.
    **reading
        As in `palpate.recorded`.
    """
    recording = recorded(path, **reading)
    recording.on_progress = lambda rows: progress(f"{rows} rows read of {name}")
    used: Mapping[str, Any] = tracking or {"scene": "handheld"} | recording.settings
    found = tracked(recording, **used)  # reads it to its end; a damaged one is an error
    return AnalysedRecording(name, recording, used, found, verification_of(recording))


def analyse_again(run: AnalysedRecording, tracking: Mapping[str, Any]) -> AnalysedRecording:
    """Track the touches of a recording again, if scene or settings differ."""
    if tracking == run.tracking:
        return run
    return replace(run, tracking=tracking, found=tracked(run.recording, **tracking))


@dataclass(frozen=True)
class ReportedTouch:
    """A touch of a report: its number counts through all recordings."""

    number: int
    run: AnalysedRecording
    touch: Touch
    specimen: str  # "": unknown
    left_out: tuple[str, ...]  # why; empty: it is kept
    advice: tuple[str, ...]
    ratio_of: RatioOf

    @property
    def ratio(self) -> float:
        """The ratio that counts."""
        return self.ratio_of(self.touch)[0]

    def uncertainty(self, scatter: Scatter) -> Uncertainty:
        """Return the uncertainty of its ratio with this scatter."""
        linearity = linearity_pF(self.run.recording.full_scale_pF)
        return Uncertainty.of(self.touch, scatter, linearity, self.ratio_of)


@dataclass(frozen=True)
class SpecimenResult:
    """All touches on one specimen, and the result of the kept ones.

    Attributes
    ----------
    name : str
    known : KnownModulus or None
        Its modulus, if it was known before.
    touches, kept : list of ReportedTouch
    agreement : Agreement or None
        Whether the kept touches agree; None: none is kept.
    mean : Agreement or None
        The same with the scatter of the session; None: they do not agree.
    modulus : Modulus or None
        Of the mean; None without a calibration or a mean.
    is_named : bool
        Whether the session or a table of moduli names the specimen; else the file name does.
    variation : float
        Standard deviation of the logarithm of the ratio of the kept touches; nan below two, or if
        the touches may be on several objects.
    budget : list of UncertaintyPart
        Errors of the mean and of its modulus by their causes, and together; empty without a
        modulus.
    """

    name: str
    known: KnownModulus | None
    touches: list[ReportedTouch]
    kept: list[ReportedTouch]
    agreement: Agreement | None
    mean: Agreement | None
    modulus: Modulus | None
    is_named: bool
    variation: float
    budget: list[UncertaintyPart]

    @property
    def is_one_object(self) -> bool:
        """Whether the kept touches are on one object, so that their scatter is repeatability."""
        return _is_one_object(self.agreement, is_named=self.is_named)

    @property
    def inside(self) -> bool | None:
        """Whether the known modulus agrees with the interval; None: one is missing."""
        if self.known is None or self.modulus is None or not self.modulus.low >= 0:
            return None
        return self.modulus.agrees_with(self.known)

    def as_dict(self) -> dict[str, object]:
        """Return plain numbers and text, for JSON."""
        return {
            "specimen": self.name,
            "known_MPa": self.known and self.known.modulus,
            "kept": [one.number for one in self.kept],
            "left_out": [one.number for one in self.touches if one.left_out],
            "agreement": self.agreement and self.agreement.as_dict(),
            **number_format.plain({"variation": self.variation}),
            "modulus": self.modulus and self.modulus.as_dict(),
            "inside": self.inside,
        }


def _is_one_object(agreed: Agreement | None, *, is_named: bool) -> bool:
    """Return whether touches agree, show why they differ, or are on a specimen that is named."""
    if agreed is None:
        return False
    return is_named or agreed.agree or agreed.cause is not None


@dataclass(frozen=True)
class _Group:
    """The touches on one specimen, before the scatter of the session is known."""

    name: str
    known: KnownModulus | None
    is_named: bool
    touches: list[ReportedTouch]
    agreement: Agreement | None

    @property
    def kept(self) -> list[ReportedTouch]:
        """The touches that count."""
        return _kept(self.touches)

    def result(self, calibration: Calibration | None, scatter: Scatter) -> SpecimenResult:
        """Return the result with this scatter from touch to touch."""
        kept = self.kept
        variation = nan
        if _is_one_object(self.agreement, is_named=self.is_named):
            variation = _variation(kept)
        mean = modulus = None
        if self.agreement and self.agreement.agree:
            mean = with_scatter(self.agreement, scatter)
        budget: list[UncertaintyPart] = []
        if mean and calibration:
            measured = [one.touch for one in kept]
            modulus = calibration.mean_modulus(measured)
            if 0 < modulus.value < inf:
                linearity = fmean(one.uncertainty(scatter).linearity for one in kept)
                budget = calibration.budget_of(measured, linearity=linearity)
        return SpecimenResult(
            self.name,
            self.known,
            self.touches,
            kept,
            self.agreement,
            mean,
            modulus,
            self.is_named,
            variation,
            budget,
        )


def _kept(touches: Iterable[ReportedTouch]) -> list[ReportedTouch]:
    return [one for one in touches if not one.left_out]


def _variation(kept: list[ReportedTouch]) -> float:
    """Return the standard deviation of the logarithms of the ratios; nan below two."""
    logarithms = _logarithms(kept)
    if len(logarithms) < 2:
        return nan
    return float(np.std(logarithms, ddof=1))


def _agreement(kept: list[ReportedTouch], calibration: Calibration | None) -> Agreement:
    touches = [one.touch for one in kept]
    if calibration:
        return calibration.agreement(touches)
    return agreement(touches, ratio_of=kept[0].ratio_of)


@dataclass(frozen=True)
class Findings:
    """Touches and results of a report; specimens are in the order of their first touch."""

    runs: list[AnalysedRecording]
    touches: list[ReportedTouch]
    results: list[SpecimenResult]
    calibration: Calibration | None
    scatter: Scatter  # from touch to touch, of the calibration, or of these touches
    learned: str = ""  # what the repeated touches show of the contact exponent

    def repeatability(self, *, all_touches: bool = False) -> Repeatability | None:
        """Return the repeatability of the kept touches, or of all; None: there is no touch.

        Specimens whose touches may be on several objects do not count.
        """
        groups = []
        for result in self.results:
            if result.is_one_object:
                touches = result.touches if all_touches else result.kept
                groups.append(_logarithms(touches))
        return one_way_anova(groups) if any(groups) else None


def findings(
    runs: list[AnalysedRecording],
    calibration: Calibration | None,
    moduli: Mapping[str, KnownModulus],
) -> Findings:
    """Return the touches with their specimens, and the result of each specimen."""
    known, _ = known_moduli(runs, moduli)
    ratio_of = _ratio_of(runs, calibration)
    touches = list(_touches(runs, calibration, known, ratio_of))
    groups = _groups(runs, touches, calibration, known)
    scatter = _scatter(groups, calibration, ratio_of)
    learned = ""
    if calibration:
        objects = {group.name: [one.touch for one in group.kept] for group in groups}
        found = learned_from(calibration, objects)
        calibration = found.calibration
        learned = found.sentence
    results = []
    for group in groups:
        results.append(group.result(calibration, scatter))
    return Findings(runs, touches, results, calibration, scatter, learned)


def _groups(
    runs: Iterable[AnalysedRecording],
    touches: Iterable[ReportedTouch],
    calibration: Calibration | None,
    known: Mapping[str, KnownModulus],
) -> list[_Group]:
    """Return the touches by their specimens, in the order of the first touch."""
    of_specimen: dict[str, list[ReportedTouch]] = {}
    for one in touches:
        if one.specimen:
            of_specimen.setdefault(one.specimen, []).append(one)
    named = set(map(name_key, known))
    for run in runs:
        for entry in run.plan.touches:
            named.add(name_key(entry.specimen or ""))
    groups = []
    for name, members in of_specimen.items():
        agreed = None
        kept = _kept(members)
        if kept:
            agreed = _agreement(kept, calibration)
        is_named = name_key(name) in named
        groups.append(_Group(name, known.get(name), is_named, members, agreed))
    return groups


def _scatter(
    groups: Iterable[_Group], calibration: Calibration | None, ratio_of: RatioOf
) -> Scatter:
    """Return the scatter of the calibration, else of the kept touches that are on one object."""
    if calibration:
        return calibration.touch_scatter
    kept = []
    for group in groups:
        if _is_one_object(group.agreement, is_named=group.is_named):
            for one in group.kept:
                kept.append((group.name, one.touch))
    return session_scatter(kept, ratio_of)


def _ratio_of(runs: Iterable[AnalysedRecording], calibration: Calibration | None) -> RatioOf:
    """Return the ratio that counts: of the calibration, else of the sessions."""
    if calibration:
        return calibration.ratio_of
    kinds = {run.plan.ratio for run in runs}
    return level_ratio if kinds == {"level"} else hold_ratio


def known_moduli(
    runs: Iterable[AnalysedRecording], table: Mapping[str, KnownModulus]
) -> tuple[dict[str, KnownModulus], list[str]]:
    """Return the moduli by name, of a table, else of the sessions; and the differences."""
    moduli = dict(table)
    names = {name_key(name): name for name in table}
    differences: list[str] = []
    for run in runs:
        for given, modulus in run.plan.moduli.items():
            name = names.setdefault(name_key(given), given)
            known = moduli.setdefault(name, modulus)
            if known == modulus:
                continue
            difference = f"{run.recording.path}: {name}: got {modulus}, "
            if name not in table:
                raise CalibrationError(
                    f"{difference}allowed: {known}, as in the file before; or --moduli with a table"
                )
            differences.append(f"{difference}used: {known}")
    return moduli, differences


class AssignedTouch(NamedTuple):
    """A touch, its specimen ("": unknown), and why a person left it out ("": it was not)."""

    touch: Touch
    specimen: str
    left_out: str


def assigned(run: AnalysedRecording, moduli: Collection[str]) -> Iterator[AssignedTouch]:
    """Yield each touch with its specimen, by the session in the sidecar, else by the file name."""
    touches = run.found.touches
    names = {name_key(name): name for name in moduli}
    period_s = run.period_s if run.period_s > 0 else PERIOD_S
    entries = run.plan.matched(touches, period_s)
    of_file = ""
    if not any(entry.specimen for entry in run.plan.touches):
        of_file = specimen_in(run.recording.path, names)
    for touch, entry in zip(touches, entries, strict=True):
        named = (entry and entry.specimen) or ""
        left_out = (entry and entry.left_out) or ""
        specimen = of_file or named
        yield AssignedTouch(touch, names.get(name_key(specimen), specimen), left_out)


def _touches(
    runs: Iterable[AnalysedRecording],
    calibration: Calibration | None,
    moduli: Mapping[str, KnownModulus],
    ratio_of: RatioOf,
) -> Iterator[ReportedTouch]:
    number = 0
    for run in runs:
        advice = advice_at_end(run.found.touches, cut=run.found.cut)
        for known, (touch, specimen, by_hand) in zip(advice, assigned(run, moduli), strict=True):
            number += 1
            against: Sequence[object] = objections(touch, ratio_of=ratio_of)
            if calibration:
                against = calibration.objections(touch)
            left_out = tuple(filter(None, [by_hand, *sentences(against, known)]))
            advised = tuple(map(str, known))
            if calibration:
                advised += tuple(map(wider, calibration.differences(touch)))
            yield ReportedTouch(number, run, touch, specimen, left_out, advised, ratio_of)


def _logarithms(touches: Iterable[ReportedTouch]) -> list[float]:
    logarithms = []
    for one in touches:
        if 0 < one.ratio < inf:
            logarithms.append(log(one.ratio))
    return logarithms
