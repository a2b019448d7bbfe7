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
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import Modulus, UncertaintyPart
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
    variation : float
        Standard deviation of the logarithm of the ratio of the kept touches; nan below two.
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
    variation: float
    budget: list[UncertaintyPart]

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


def _result(
    name: str,
    known: KnownModulus | None,
    touches: list[ReportedTouch],
    calibration: Calibration | None,
    scatter: Scatter,
) -> SpecimenResult:
    kept = [one for one in touches if not one.left_out]
    logarithms = _logarithms(kept)
    variation = nan
    if len(logarithms) > 1:
        variation = float(np.std(logarithms, ddof=1))
    agreed = mean = modulus = None
    if kept:
        agreed = _agreement(kept, calibration)
        if agreed.agree:
            mean = with_scatter(agreed, scatter)
    budget: list[UncertaintyPart] = []
    if mean and calibration:
        modulus = calibration.modulus(mean.ratio, mean.own_error, touches=mean.effective)
        if 0 < modulus.value < inf:
            linearity = fmean(one.uncertainty(scatter).linearity for one in kept)
            budget = calibration.budget(  # no mean reduces the linearity
                mean.ratio, mean.own_error, touches=mean.effective, linearity=linearity
            )
    return SpecimenResult(name, known, touches, kept, agreed, mean, modulus, variation, budget)


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

    def repeatability(self, *, all_touches: bool = False) -> Repeatability | None:
        """Return the repeatability of the kept touches, or of all; None: there is no touch."""
        groups = []
        for result in self.results:
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
    groups: dict[str, list[ReportedTouch]] = {}
    for one in touches:
        if one.specimen:
            groups.setdefault(one.specimen, []).append(one)
    if calibration:
        scatter = calibration.touch_scatter
    else:
        kept = []
        for one in touches:
            if not one.left_out:
                kept.append((one.specimen, one.touch))
        scatter = session_scatter(kept, ratio_of)
    results = []
    for name, group in groups.items():
        results.append(_result(name, known.get(name), group, calibration, scatter))
    return Findings(runs, touches, results, calibration, scatter)


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
            yield ReportedTouch(number, run, touch, specimen, left_out, advised, ratio_of)


def _logarithms(touches: Iterable[ReportedTouch]) -> list[float]:
    logarithms = []
    for one in touches:
        if 0 < one.ratio < inf:
            logarithms.append(log(one.ratio))
    return logarithms
