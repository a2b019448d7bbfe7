"""What a report shows: recordings, the specimen of each touch and whether it is kept, and the result of each specimen."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import hypot, inf, isfinite, log, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from palpate._core import Touch
from palpate.calibration.calibration import Calibration, Modulus
from palpate.calibration.curve_fit import Measured, variances
from palpate.calibration.specimen_files import assign
from palpate.errors import CalibrationError
from palpate.recording.foreign import AnyRecording, recorded
from palpate.recording.session import Plan, plan_of
from palpate.recording.verification import Verification, verified
from palpate.report.repeatability import Repeatability, repeatability
from palpate.sentences import advice_at_end
from palpate.several import TOUCH_SCATTER, Agreement, agreement, objections
from palpate.touch import Tracked, tracked


@dataclass(frozen=True)
class Run:
    """A recording, what `check` says of it, its session, and what the scene and settings of its measurement find in it."""

    name: str
    recording: AnyRecording
    checked: Verification
    plan: Plan
    tracking: dict[str, Any]
    found: Tracked

    @property
    def document(self) -> dict[str, Any]:
        """The sidecar; empty without one."""
        return self.recording.document

    @property
    def first_s(self) -> float:
        """The first time; nan: unknown."""
        return self.checked.survey.first_ns / 1e9 if self.recording.timed else nan

    @property
    def period_s(self) -> float:
        """Mean time from pair to pair; nan: unknown."""
        return self.checked.survey.period_s if self.recording.timed else nan


def run_of(path: Path, name: str) -> Run:
    """Read a recording, check it, and send it through the estimator."""
    recording = recorded(path)
    checked = verified(recording)
    tracking: dict[str, Any] = {"scene": "handheld"} | recording.settings
    return Run(name, recording, checked, plan_of(recording.document), tracking, tracked(recording, **tracking))


@dataclass(frozen=True)
class Found:
    """A touch: its number through all recordings, its specimen ("": unknown), why it is left out, and its sentences."""

    number: int
    run: Run
    touch: Touch
    specimen: str
    left_out: tuple[str, ...]
    said: tuple[str, ...]

    @property
    def kept(self) -> bool:
        """Whether it counts."""
        return not self.left_out

    @property
    def noise(self) -> float:
        """Standard error relative to the ratio; nan: unknown."""
        return self.touch.standard_error / abs(self.touch.ratio) if self.touch.ratio else nan


@dataclass(frozen=True)
class Result:
    """All touches on one specimen; `known`: its modulus, MPa, if it was known before."""

    name: str
    known: float | None
    touches: list[Found]
    calibration: Calibration | None

    @cached_property
    def kept(self) -> list[Found]:
        """The touches that count."""
        return [one for one in self.touches if one.kept]

    @cached_property
    def agreement(self) -> Agreement | None:
        """Whether the kept touches agree, and their mean; None without any."""
        kept = [one.touch for one in self.kept]
        return (self.calibration.agreement(kept) if self.calibration else agreement(kept)) if kept else None

    @property
    def together(self) -> Agreement | None:
        """The mean of the kept touches; None if there are none, or they differ."""
        return self.agreement if self.agreement and self.agreement.agree else None

    @cached_property
    def modulus(self) -> Modulus | None:
        """Modulus of the mean ratio; None without a calibration or a mean."""
        if (mean := self.together) is None or self.calibration is None:
            return None
        return self.calibration.modulus(mean.ratio, mean.own_error, touches=mean.effective)

    @property
    def variation(self) -> float:
        """Standard deviation of the logarithm of the ratio of the kept touches; nan below two."""
        logarithms = _logarithms(self.kept)
        return float(np.std(logarithms, ddof=1)) if len(logarithms) > 1 else nan

    @property
    def inside(self) -> bool | None:
        """Whether the known modulus is in the interval; None: it is not known, or there is no interval."""
        if self.known is None or self.modulus is None or not self.modulus.low >= 0:
            return None
        return self.modulus.low <= self.known <= self.modulus.high

    @property
    def parts(self) -> list[float]:
        """Relative errors of the mean by touch, specimen, curve and noise, and all together; empty without a modulus."""
        mean = self.together
        if not (self.calibration and mean and self.modulus and 0 < self.modulus.value < inf):
            return []
        measured = Measured(mean.ratio, mean.own_error, mean.effective)
        found = variances(self.calibration.fitted, measured, np.array(log(self.modulus.value)))
        parts = [sqrt(float(part)) / mean.ratio for part in (found.touch, found.specimen, found.curve, found.noise)]
        return [*parts, hypot(*parts)]

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and text, for JSON."""
        return {
            "specimen": self.name,
            "known_MPa": self.known,
            "kept": [one.number for one in self.kept],
            "left_out": [one.number for one in self.touches if not one.kept],
            "agreement": self.agreement.as_dict() if self.agreement else None,
            "variation": self.variation if isfinite(self.variation) else None,
            "modulus": self.modulus.as_dict() if self.modulus else None,
            "inside": self.inside,
        }


@dataclass(frozen=True)
class Findings:
    """All that a report shows; the results are in the order in which the specimens were touched first."""

    runs: list[Run]
    touches: list[Found]
    results: list[Result]
    calibration: Calibration | None

    def repeatability(self, *, all_touches: bool = False) -> Repeatability | None:
        """Return the repeatability of the kept touches, or of all with a ratio above 0; None: no touch."""
        groups = [_logarithms(result.touches if all_touches else result.kept) for result in self.results]
        return repeatability(groups) if any(groups) else None

    @property
    def kept(self) -> int:
        """How many touches count."""
        return sum(one.kept for one in self.touches)

    @property
    def of_the_fit(self) -> int:
        """How many touches are data of the calibration: their ratio is there with the same bits."""
        known = set(self.calibration.ratios.tolist()) if self.calibration else set()
        return sum(one.touch.ratio in known for one in self.touches)

    @property
    def scatter(self) -> float:
        """Relative scatter from touch to touch: by the calibration, or assumed."""
        return self.calibration.touch_spread if self.calibration else TOUCH_SCATTER

    def error(self, touch: Touch) -> float:
        """Return the standard deviation of a ratio: what is known of its noise, and the scatter."""
        noise = touch.standard_error if isfinite(touch.standard_error) else 0.0
        return hypot(noise, self.scatter * touch.ratio)

    def from_mean(self, one: Found) -> float:
        """Return how far a touch is from the mean of its specimen, relative to it; nan: unknown."""
        return one.touch.ratio / self._means.get(one.specimen, nan) - 1

    @cached_property
    def _means(self) -> dict[str, float]:
        return {result.name: result.together.ratio for result in self.results if result.together}


def findings(runs: list[Run], calibration: Calibration | None, moduli: Mapping[str, float]) -> Findings:
    """Return the touches with their specimens, and the result of each specimen.

    The specimen comes from the session in the sidecar. Without one it comes from the name of the file, as
    `palpate calibrate` finds it in the table of moduli, else the name without a number at its end.
    """
    touches = list(_touches(runs, calibration.accepted if calibration else (), moduli))
    known = moduli or _moduli(runs)
    names = dict.fromkeys(one.specimen for one in touches if one.specimen)
    results = [
        Result(name, known.get(name), [one for one in touches if one.specimen == name], calibration) for name in names
    ]
    return Findings(runs, touches, results, calibration)


def _touches(runs: Iterable[Run], accept: Collection[str], moduli: Mapping[str, float]) -> Iterator[Found]:
    number = 0
    for run in runs:
        touches = run.found.touches
        entries = run.plan.matched(touches, *([run.period_s] if run.period_s > 0 else []))
        planned = bool(run.plan.specimens) or any(entry and entry.specimen for entry in entries)
        of_file = "" if planned else _named(run.recording.path, moduli)
        for at, (touch, entry) in enumerate(zip(touches, entries, strict=True)):
            number += 1
            said = tuple(advice_at_end(touch, cut=at >= len(touches) - run.found.cut))
            against = objections(touch, accept)
            reasons = [sentence for sentence in said if sentence.partition(":")[0] in against]
            by_hand = [entry.left_out] if entry and entry.left_out else []
            specimen = ((entry and entry.specimen) or "") if planned else of_file
            yield Found(number, run, touch, specimen, (*by_hand, *reasons), said)


def _named(path: Path, moduli: Mapping[str, float]) -> str:
    """Return the specimen that the name of a file says."""
    try:
        return next(name for name, files in assign([path], moduli).items() if files)
    except CalibrationError:
        return re.sub(r"[-_ .]\d{1,3}$", "", path.name.partition(".")[0]) or path.stem


def _moduli(runs: Iterable[Run]) -> dict[str, float]:
    known: dict[str, float] = {}
    for run in runs:
        for name, modulus in run.plan.moduli.items():
            if known.setdefault(name, modulus) != modulus:
                raise CalibrationError(
                    f"{run.recording.path}: {name} has {modulus:g} MPa, but {known[name]:g} MPa in a recording before: "
                    "name a table with its modulus (--moduli)"
                )
    return known


def _logarithms(touches: Iterable[Found]) -> list[float]:
    ratios = (one.touch.ratio for one in touches)
    return [log(ratio) for ratio in ratios if isfinite(ratio) and ratio > 0]
