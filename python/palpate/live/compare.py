"""Recordings beside each other: the touches of each specimen, and whether they agree."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from statistics import fmean

from palpate.calibration import Calibration
from palpate.live.feed import Document, RefusedCommand
from palpate.repeatability import agreement
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
_NONE = "compare: no touch of {} is on a named specimen, allowed: open each recording, and name its touches"


def compared(paths: Sequence[Path], calibration: Calibration | None) -> Document:
    """Return what a page shows of two recordings or more; their touches are those of `palpate report`."""
    if len(paths) < 2:
        raise RefusedCommand(
            f"compare: got {len(paths)} recordings, allowed: two or more; palpate live A.csv B.csv"
        )
    runs = [analyse_recording(path, letter) for letter, path in zip(LETTERS, paths, strict=False)]
    runs = (
        [analyse_again(run, calibration.for_tracking(run.tracking)) for run in runs]
        if calibration
        else runs
    )
    found = findings(runs, calibration, {})
    if not found.results:
        raise RefusedCommand(_NONE.format(" and ".join(path.name for path in paths)))
    shared = [one for one in found.results if len({each.run.name for each in one.kept}) > 1]
    kept = [each.run.name for one in found.results for each in one.kept]
    return {
        "files": [
            {"name": path.name, "touches": len(run.found.touches), "kept": kept.count(run.name)}
            for path, run in zip(paths, runs, strict=True)
        ],
        "agree": sum(one.agreement is not None and one.agreement.agree for one in shared),
        "of": len(shared),
        "scatter": found.scatter.share,
        "specimens": [_specimen(one, runs) for one in found.results],
        "same": None if shared else _as_one_object(found, runs),
    }


def _as_one_object(found: Findings, runs: Sequence[AnalysedRecording]) -> Document | None:
    """Return all touches as if they were on one object; None: the touches of only one recording count."""
    kept = [one for one in found.touches if not one.left_out]
    if len({one.run.name for one in kept}) < 2:
        return None
    touches = [one.touch for one in kept]
    if found.calibration:
        agreed = found.calibration.agreement(touches)
    else:
        agreed = agreement(touches, ratio_of=kept[0].ratio_of)
    all_touches = replace(
        found.results[0],
        name="all as one object",
        touches=found.touches,
        kept=kept,
        agreement=agreed,
    )
    return _specimen(all_touches, runs)


def _specimen(one: SpecimenResult, runs: Sequence[AnalysedRecording]) -> Document:
    """Return the touches of a specimen, each with the number of its recording, and what `palpate.agreement` says."""
    found, firsts = one.agreement, accumulate((len(run.found.touches) for run in runs), initial=0)
    before, apart = (
        dict(zip(LETTERS, firsts, strict=False)),
        [_apart(one.kept, run) for run in runs],
    )
    return {
        "name": one.name,
        "farthest": apart.index(max(apart, key=abs)),
        "apart": max(apart, key=abs),
        "agreement": found
        and {**found.as_dict(), "ratio": found.ratio, "standard_error": found.standard_error},
        "touches": [
            {
                "file": LETTERS.index(each.run.name),
                "number": each.number - before[each.run.name],
                "ratio": each.ratio,
                "left_out": "; ".join(each.left_out),
            }
            for each in one.touches
        ],
    }


def _apart(touches: list[ReportedTouch], run: AnalysedRecording) -> float:
    """Return how far the mean of a recording is from the mean of the others, relative to it; 0: there is only one."""
    own, rest = (
        [one.ratio for one in touches if (one.run is run) is inside] for inside in (True, False)
    )
    return fmean(own) / fmean(rest) - 1 if own and rest else 0.0
