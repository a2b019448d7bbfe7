"""What a report shows: recordings, the specimen of each touch and whether it is kept, and the result of each specimen."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite, log, nan
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from palpate.ad7746.registers import linearity_pF
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import Modulus, UncertaintyPart
from palpate.calibration.specimen_files import name_key, specimen_in
from palpate.errors import CalibrationError
from palpate.flags import advice_at_end, sentences
from palpate.recording.opened import OpenedRecording
from palpate.recording.reading import recorded
from palpate.recording.session import Plan
from palpate.recording.verification import Verification, verification_of
from palpate.repeatability import Agreement, agreement, objections, session_scatter, with_scatter
from palpate.report.anova import Repeatability, one_way_anova
from palpate.touch import Touch
from palpate.tracking import Tracked, tracked
from palpate.uncertainty import RatioOf, Scatter, Uncertainty, hold_ratio, level_ratio


@dataclass(frozen=True)
class AnalysedRecording:
    """A recording, what the scene and settings of its measurement find in it, what `check` says of it, its session."""

    # first_s, period_s: the first time, and the mean time from pair to pair; nan: unknown.

    name: str
    recording: OpenedRecording
    tracking: dict[str, Any]
    found: Tracked
    checked: Verification
    plan: Plan
    first_s: float
    period_s: float


def analyse_recording(
    path: Path,
    name: str,
    how: dict[str, Any] | None = None,
    tell: Callable[[str], None] = lambda _: None,
    **asked: Any,
) -> AnalysedRecording:
    """Read a recording, send it through the estimator, and check it; `how`: scene and settings, else its own.

    `tell` gets the progress; an error that it raises ends the work.
    """
    recording = recorded(path, **asked)
    recording.on_progress = lambda rows: tell(f"{rows} rows read of {name}")
    tracking: dict[str, Any] = how or {"scene": "handheld"} | recording.settings
    found = tracked(recording, **tracking)  # reads it to its end; a damaged one is an error
    survey = recording.survey
    times = (survey.first_ns / 1e9, survey.period_s) if recording.timed else (nan, nan)
    return AnalysedRecording(
        name,
        recording,
        tracking,
        found,
        verification_of(recording),
        recording.sidecar.session,
        *times,
    )


def analyse_again(run: AnalysedRecording, tracking: dict[str, Any]) -> AnalysedRecording:
    """Send a recording through the estimator again, if scene or settings are other ones."""
    same = tracking == run.tracking
    return (
        run if same else replace(run, tracking=tracking, found=tracked(run.recording, **tracking))
    )


@dataclass(frozen=True)
class ReportedTouch:
    """A touch: its number through all recordings, its specimen ("": unknown), why it is left out, and its sentences."""

    number: int
    run: AnalysedRecording
    touch: Touch
    specimen: str
    left_out: tuple[str, ...]
    said: tuple[str, ...]
    ratio_of: RatioOf

    @property
    def ratio(self) -> float:
        """The ratio that counts."""
        return self.ratio_of(self.touch)[0]

    def uncertainty(self, scatter: Scatter) -> Uncertainty:
        """Return the uncertainty of its ratio with this scatter."""
        return Uncertainty.of(
            self.touch, scatter, linearity_pF(self.run.recording.full_scale_pF), self.ratio_of
        )


@dataclass(frozen=True)
class SpecimenResult:
    """All touches on one specimen, and what the kept ones say."""

    # known: its modulus, MPa, if it was known before.
    # agreement: whether the kept touches agree; `mean` is the same if they do.
    # modulus: of the mean; None without a calibration or a mean.
    # variation: standard deviation of the logarithm of the ratio of the kept touches; nan below two.
    # budget: errors of the mean and of its modulus by their causes, and all together; empty without a modulus.

    name: str
    known: float | None
    touches: list[ReportedTouch]
    kept: list[ReportedTouch]
    agreement: Agreement | None
    mean: Agreement | None
    modulus: Modulus | None
    variation: float
    budget: list[UncertaintyPart]

    @property
    def inside(self) -> bool | None:
        """Whether the known modulus is in the interval; None: it is not known, or there is no interval."""
        if self.known is None or self.modulus is None or not self.modulus.low >= 0:
            return None
        return self.modulus.low <= self.known <= self.modulus.high

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and text, for JSON."""
        return {
            "specimen": self.name,
            "known_MPa": self.known,
            "kept": [one.number for one in self.kept],
            "left_out": [one.number for one in self.touches if one.left_out],
            "agreement": self.agreement.as_dict() if self.agreement else None,
            "variation": self.variation if isfinite(self.variation) else None,
            "modulus": self.modulus.as_dict() if self.modulus else None,
            "inside": self.inside,
        }


def _result(
    name: str,
    known: float | None,
    touches: list[ReportedTouch],
    calibration: Calibration | None,
    scatter: Scatter,
) -> SpecimenResult:
    kept = [one for one in touches if not one.left_out]
    ratios = [one.touch for one in kept]
    found = mean = modulus = None
    if kept:
        found = (
            calibration.agreement(ratios)
            if calibration
            else agreement(ratios, ratio_of=kept[0].ratio_of)
        )
        mean = with_scatter(found, scatter) if found.agree else None
    if mean and calibration:
        modulus = calibration.modulus(mean.ratio, mean.own_error, touches=mean.effective)
    logarithms = _logarithms(kept)
    variation = float(np.std(logarithms, ddof=1)) if len(logarithms) > 1 else nan
    budget = list[UncertaintyPart]()
    if calibration and mean and modulus and 0 < modulus.value < inf:
        linearity = fmean(one.uncertainty(scatter).linearity for one in kept)  # no mean reduces it
        budget = calibration.budget(
            mean.ratio, mean.own_error, touches=mean.effective, linearity=linearity
        )
    return SpecimenResult(name, known, touches, kept, found, mean, modulus, variation, budget)


@dataclass(frozen=True)
class Findings:
    """All that a report shows; the results are in the order in which the specimens were touched first."""

    runs: list[AnalysedRecording]
    touches: list[ReportedTouch]
    results: list[SpecimenResult]
    calibration: Calibration | None
    scatter: Scatter  # from touch to touch, of the calibration, or of these touches

    def repeatability(self, *, all_touches: bool = False) -> Repeatability | None:
        """Return the repeatability of the kept touches, or of all with a ratio above 0; None: no touch."""
        groups = [
            _logarithms(result.touches if all_touches else result.kept) for result in self.results
        ]
        return one_way_anova(groups) if any(groups) else None


def findings(
    runs: list[AnalysedRecording], calibration: Calibration | None, moduli: Mapping[str, float]
) -> Findings:
    """Return the touches with their specimens, and the result of each specimen."""
    known, _ = known_moduli(runs, moduli)
    by_level = all(run.plan.ratio == "level" for run in runs)
    ratio_of = calibration.ratio_of if calibration else level_ratio if by_level else hold_ratio
    touches = list(_touches(runs, calibration, known, ratio_of))
    groups: dict[str, list[ReportedTouch]] = {}
    for one in touches:
        groups.setdefault(one.specimen, []).append(one)
    kept = ((one.specimen, one.touch) for one in touches if not one.left_out)
    scatter = calibration.touch_scatter if calibration else session_scatter(kept, ratio_of)
    results = [
        _result(name, known.get(name), group, calibration, scatter)
        for name, group in groups.items()
        if name
    ]
    return Findings(runs, touches, results, calibration, scatter)


def known_moduli(
    runs: Iterable[AnalysedRecording], table: Mapping[str, float]
) -> tuple[dict[str, float], list[str]]:
    """Return the modulus of each specimen, MPa: of a table, else of the sessions; and where a session differs from the table."""
    moduli, names, differences = dict(table), {name_key(name): name for name in table}, list[str]()
    for run in runs:
        for given, modulus in run.plan.moduli.items():
            name = names.setdefault(name_key(given), given)
            known = moduli.setdefault(name, modulus)
            said = f"{run.recording.path}: {name}: got {modulus:g} MPa, "
            if known != modulus and name not in table:
                raise CalibrationError(
                    f"{said}allowed: {known:g} MPa, as in the file before; or --moduli with a table"
                )
            differences += [f"{said}used: {known:g} MPa"] if known != modulus else []
    return moduli, differences


def assigned(
    run: AnalysedRecording, moduli: Mapping[str, float]
) -> Iterator[tuple[Touch, str, str]]:
    """Yield each touch, its specimen ("": unknown), and why it was left out by hand ("": it was not).

    The session in the sidecar says it. Where it names no specimen of a touch, the name of the file does.
    """
    touches, names = run.found.touches, {name_key(name): name for name in moduli}
    entries = run.plan.matched(touches, *([run.period_s] if run.period_s > 0 else []))
    named = any(entry.specimen for entry in run.plan.touches)
    of_file = "" if named else specimen_in(run.recording.path, names)
    for touch, entry in zip(touches, entries, strict=True):
        given = of_file or (entry and entry.specimen) or ""
        yield touch, names.get(name_key(given), given), (entry and entry.left_out) or ""


def _touches(
    runs: Iterable[AnalysedRecording],
    calibration: Calibration | None,
    moduli: Mapping[str, float],
    ratio_of: RatioOf,
) -> Iterator[ReportedTouch]:
    number = 0
    for run in runs:
        advice = advice_at_end(run.found.touches, cut=run.found.cut)
        for known, (touch, specimen, by_hand) in zip(advice, assigned(run, moduli), strict=True):
            number += 1
            against = (
                calibration.objections(touch)
                if calibration
                else objections(touch, ratio_of=ratio_of)
            )
            left_out = [by_hand] if by_hand else []
            left_out += sentences(against, known)
            said = tuple(str(each) for each in known)
            yield ReportedTouch(number, run, touch, specimen, tuple(left_out), said, ratio_of)


def _logarithms(touches: Iterable[ReportedTouch]) -> list[float]:
    ratios = (one.ratio for one in touches)
    return [log(ratio) for ratio in ratios if isfinite(ratio) and ratio > 0]
