"""What a session found: for each touch its specimen and whether it is kept; for each specimen the result of its touches."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, log, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from palpate._core import Touch
from palpate.calibration.calibration import Calibration, Modulus
from palpate.calibration.curve_fit import Measured, Variances, variances
from palpate.calibration.specimen_files import assign
from palpate.errors import CalibrationError
from palpate.report.repeatability import Repeatability, repeatability
from palpate.report.runs import Run
from palpate.sentences import advice_at_end
from palpate.several import Agreement, agreement, objections


@dataclass(frozen=True)
class Found:
    """A touch of a report.

    Attributes
    ----------
    number : int
        From 1, through all recordings.
    run : Run
    touch : Touch
    specimen : str
        Its name; "": none is known.
    left_out : tuple of str
        Why it counts for nothing, a sentence each; empty: it is kept.
    said : tuple of str
        The sentences about its flags.
    """

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


@dataclass(frozen=True)
class Result:
    """The touches on one specimen together.

    Attributes
    ----------
    name : str
    known : float or None, MPa
        Modulus that was known before.
    touches : list of Found
        Also those that are left out.
    agreement : Agreement or None
        Of the kept ones; None without any.
    modulus : Modulus or None
        For their mean; None without a calibration, without a kept touch, or if they differ.
    parts : Variances or None
        Of the mean ratio, where the modulus is known.
    """

    name: str
    known: float | None
    touches: list[Found]
    agreement: Agreement | None
    modulus: Modulus | None
    parts: Variances | None

    @property
    def kept(self) -> list[Found]:
        """The touches that count."""
        return [one for one in self.touches if one.kept]

    @property
    def mean(self) -> float:
        """Mean ratio; nan if there is none, or the touches differ."""
        return self.agreement.ratio if self.agreement and self.agreement.agree else nan

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


@dataclass(frozen=True)
class Findings:
    """All that a report shows.

    Attributes
    ----------
    runs : list of Run
    touches : list of Found
    results : list of Result
        A specimen each, in the order in which they were touched first.
    calibration : Calibration or None
    """

    runs: list[Run]
    touches: list[Found]
    results: list[Result]
    calibration: Calibration | None

    def repeatability(self, *, all_touches: bool = False) -> Repeatability | None:
        """Return the repeatability of the logarithm of the ratio of the kept touches, or of all with a ratio above 0; None: no touch."""
        groups = [_logarithms(result.touches if all_touches else result.kept) for result in self.results]
        return repeatability(groups) if any(groups) else None

    @property
    def of_the_fit(self) -> int:
        """How many touches are data of the calibration: their ratio is there with the same bits."""
        known = set(self.calibration.ratios.tolist()) if self.calibration else set()
        return sum(one.touch.ratio in known for one in self.touches)


def findings(
    runs: Sequence[Run], calibration: Calibration | None, moduli: Mapping[str, float] | None = None
) -> Findings:
    """Find the specimen of each touch, and the result of each specimen.

    The specimen comes from the session in the sidecar. Without one it comes from the name of the file, as
    `palpate calibrate` finds it in the table of moduli, else the name without a number at its end.

    Parameters
    ----------
    runs : sequence of Run
    calibration : Calibration or None
    moduli : mapping, optional
        Known modulus of each specimen, MPa; it takes the place of those in the sidecars.

    Raises
    ------
    CalibrationError
        Two recordings say that a specimen has different moduli.
    """
    accept = calibration.accepted if calibration else ()
    touches = list(_touches(runs, accept, moduli or {}))
    known = moduli or _moduli(runs)
    names = dict.fromkeys(one.specimen for one in touches if one.specimen)
    results = [
        _result(name, known.get(name), [one for one in touches if one.specimen == name], calibration) for name in names
    ]
    return Findings(list(runs), touches, results, calibration)


def _touches(runs: Iterable[Run], accept: Collection[str], moduli: Mapping[str, float]) -> Iterator[Found]:
    number = 0
    for run in runs:
        planned = bool(run.plan.specimens) or any(entry and entry.specimen for entry in run.entries)
        of_file = "" if planned else _named(run.path, moduli)
        for at, (touch, entry) in enumerate(zip(run.touches, run.entries, strict=True)):
            number += 1
            said = tuple(advice_at_end(touch, cut=at >= len(run.touches) - run.cut))
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
                    f"{run.path}: {name} has {modulus:g} MPa, but {known[name]:g} MPa in a recording before: "
                    "name a table with its modulus (--moduli)"
                )
    return known


def _result(name: str, known: float | None, touches: list[Found], calibration: Calibration | None) -> Result:
    kept = [one.touch for one in touches if one.kept]
    found = (calibration.agreement(kept) if calibration else agreement(kept)) if kept else None
    if calibration is None or found is None or not found.agree:
        return Result(name, known, touches, found, None, None)
    modulus = calibration.modulus(found.ratio, found.own_error, touches=found.effective)
    return Result(name, known, touches, found, modulus, _parts(calibration, found, modulus))


def _parts(calibration: Calibration, found: Agreement, modulus: Modulus) -> Variances | None:
    if not (isfinite(modulus.value) and modulus.value > 0):
        return None
    measured = Measured(found.ratio, found.own_error, found.effective)
    return variances(calibration.fitted, measured, np.array(log(modulus.value)))


def _logarithms(touches: Iterable[Found]) -> list[float]:
    ratios = (one.touch.ratio for one in touches)
    return [log(ratio) for ratio in ratios if isfinite(ratio) and ratio > 0]


def as_dict(session: Findings) -> dict[str, Any]:
    """Return the results as plain numbers and text, for JSON."""
    found = session.repeatability()
    return {
        "touches": len(session.touches),
        "kept": sum(one.kept for one in session.touches),
        "specimens": [_plain(result) for result in session.results],
        "repeatability": found.as_dict() if found else None,
    }


def _plain(result: Result) -> dict[str, Any]:
    return {
        "specimen": result.name,
        "known_MPa": result.known,
        "kept": [one.number for one in result.kept],
        "left_out": [one.number for one in result.touches if not one.kept],
        "agreement": result.agreement.as_dict() if result.agreement else None,
        "variation": result.variation if isfinite(result.variation) else None,
        "modulus": result.modulus.as_dict() if result.modulus else None,
        "inside": result.inside,
    }


def deviations(parts: Variances, ratio: float) -> dict[str, float]:
    """Return the parts as standard deviations, relative to a ratio."""
    return {name: sqrt(float(variance)) / ratio for name, variance in parts._asdict().items()}
