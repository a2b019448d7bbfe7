"""Recordings beside each other: the touches of each specimen, and whether they agree."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import fmean

from palpate.calibration import Calibration
from palpate.live.protocol import (
    ComparedFile,
    ComparedMessage,
    ComparedSpecimen,
    ComparedTouch,
    RefusedCommand,
    ShownAgreement,
)
from palpate.live.touch_rows import shown_agreement
from palpate.repeatability import Agreement, agreement
from palpate.report.findings import (
    AnalysedRecording,
    Findings,
    ReportedTouch,
    SpecimenResult,
    analyse_again,
    analyse_recording,
    findings,
)

LETTERS = "ABCD"


def compared(paths: Sequence[Path], calibration: Calibration | None) -> ComparedMessage:
    """Return what a page shows of two recordings or more; their touches are those of `palpate report`."""
    if len(paths) < 2:
        raise RefusedCommand(
            f"compare: got {len(paths)} recordings, allowed: two or more; palpate live A.csv B.csv"
        )
    runs = [analyse_recording(path, letter) for letter, path in zip(LETTERS, paths, strict=False)]
    if calibration:
        runs = [analyse_again(run, calibration.for_tracking(run.tracking)) for run in runs]
    found = findings(runs, calibration, {})
    if not found.results:
        names = " and ".join(path.name for path in paths)
        raise RefusedCommand(
            f"compare: no touch of {names} is on a named specimen, allowed: open each recording, "
            "and name its touches"
        )
    kept: list[str] = []  # the recording of each kept touch
    agree = 0
    shared = 0
    for result in found.results:
        runs_of_kept = [touch.run.name for touch in result.kept]
        kept += runs_of_kept
        if len(set(runs_of_kept)) > 1:
            shared += 1
            agree += result.agreement is not None and result.agreement.agree
    files = []
    for path, run in zip(paths, runs, strict=True):
        files.append(ComparedFile(path.name, len(run.found.touches), kept.count(run.name)))
    return ComparedMessage(
        "compare",
        files,
        agree,
        shared,
        found.scatter.share,
        [_specimen(result, runs) for result in found.results],
        None if shared else _as_one_object(found, runs),
    )


def _as_one_object(found: Findings, runs: Sequence[AnalysedRecording]) -> ComparedSpecimen | None:
    """Return all touches as if they were on one object; None: the touches of only one recording count."""
    kept = [one for one in found.touches if not one.left_out]
    if len({one.run.name for one in kept}) < 2:
        return None
    touches = [one.touch for one in kept]
    if found.calibration:
        agreed = found.calibration.agreement(touches)
    else:
        agreed = agreement(touches, ratio_of=kept[0].ratio_of)
    result = replace(
        found.results[0],
        name="all as one object",
        touches=found.touches,
        kept=kept,
        agreement=agreed,
    )
    return _specimen(result, runs)


def _specimen(result: SpecimenResult, runs: Sequence[AnalysedRecording]) -> ComparedSpecimen:
    """Return the touches of a specimen, each with the number of its recording, and whether they agree."""
    before = {}  # number of touches of the recordings before
    touches_so_far = 0
    for run in runs:
        before[run.name] = touches_so_far
        touches_so_far += len(run.found.touches)
    distances = [_distance(result.kept, run) for run in runs]
    farthest = max(distances, key=abs)
    touches = []
    for each in result.touches:
        number = each.number - before[each.run.name]
        file = LETTERS.index(each.run.name)
        touches.append(ComparedTouch(file, number, each.ratio, "; ".join(each.left_out)))
    agreed = _with_mean(result.agreement) if result.agreement else None
    return ComparedSpecimen(result.name, distances.index(farthest), farthest, agreed, touches)


def _with_mean(found: Agreement) -> ShownAgreement:
    """Return an agreement with its mean, whether the touches agree or not."""
    shown = shown_agreement(found, str(found))
    shown.ratio = found.ratio
    shown.standard_error = found.standard_error
    return shown


def _distance(touches: list[ReportedTouch], run: AnalysedRecording) -> float:
    """Return how far the mean of a recording is from the mean of the others, relative to it; 0: there is only one."""
    own = []
    rest = []
    for touch in touches:
        if touch.run is run:
            own.append(touch.ratio)
        else:
            rest.append(touch.ratio)
    if own and rest:
        return fmean(own) / fmean(rest) - 1
    return 0.0
