"""Recordings beside each other: the touches of each specimen, whether they agree, and how far apart the recordings are."""

from collections.abc import Iterable, Sequence
from itertools import accumulate
from math import sqrt
from pathlib import Path
from statistics import fmean, stdev

from palpate.calibration import Calibration
from palpate.live.feed import Document, RefusedCommand
from palpate.report.findings import Found, Result, Run, findings, run_again, run_of

LETTERS = "ABCD"
_NONE = "compare: no touch of {} is on a named specimen, allowed: open each recording, and name its touches"


def compared(paths: Sequence[Path], calibration: Calibration | None) -> Document:
    """Return what a page shows of two recordings or more; their touches are those of `palpate report`."""
    if len(paths) < 2:
        raise RefusedCommand(f"compare: got {len(paths)} recordings, allowed: two or more; palpate live A.csv B.csv")
    runs = [run_of(path, letter) for letter, path in zip(LETTERS, paths, strict=False)]
    runs = [run_again(run, calibration.for_tracking(run.tracking)) for run in runs] if calibration else runs
    found = findings(runs, calibration, {})
    if not found.results:
        raise RefusedCommand(_NONE.format(" and ".join(path.name for path in paths)))
    groups = [[_ratios(one.kept, run.name) for run in runs] for one in found.results]
    shared = [one for one, group in zip(found.results, groups, strict=True) if sum(map(bool, group)) > 1]
    within = [stdev(ratios) / fmean(ratios) for group in groups for ratios in group if len(ratios) > 1]
    means = [[(fmean(ratios), len(ratios)) for ratios in group if ratios] for group in groups]
    between = [stdev(each) / fmean(each) for group in means if len(each := [mean for mean, _ in group]) > 1]
    share, of_all = _root(within), [one.agreement.ratio if one.agreement else 1.0 for one in found.results]
    return {
        "files": [
            {
                "name": path.name,
                "touches": len(run.found.touches),
                "kept": sum(len(_ratios(one.kept, run.name)) for one in found.results),
                "away": _mean(
                    fmean(group[at]) / mean - 1 for group, mean in zip(groups, of_all, strict=True) if group[at]
                ),
            }
            for at, (path, run) in enumerate(zip(paths, runs, strict=True))  # at: place in each group
        ],
        "agree": sum(one.agreement is not None and one.agreement.agree for one in shared),
        "of": len(shared),
        "within": share,
        "between": _root(between),
        "chance": share and share * sqrt(fmean(1 / count for group in means if len(group) > 1 for _, count in group)),
        "scatter": found.scatter.share,
        "specimens": [_specimen(one, runs) for one in found.results],
    }


def _specimen(one: Result, runs: Sequence[Run]) -> Document:
    """Return the touches of a specimen, each with the number of its recording, and what `palpate.agreement` says."""
    found, firsts = one.agreement, accumulate((len(run.found.touches) for run in runs), initial=0)
    before, apart = dict(zip(LETTERS, firsts, strict=False)), [_apart(one.kept, run.name) for run in runs]
    return {
        "name": one.name,
        "farthest": apart.index(max(apart, key=abs)),
        "apart": max(apart, key=abs),
        "agreement": found and {**found.as_dict(), "ratio": found.ratio, "standard_error": found.standard_error},
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


def _apart(touches: list[Found], name: str) -> float:
    """Return how far the mean of a recording is from the mean of the others, relative to it; 0: there is only one."""
    own, rest = ([one.ratio for one in touches if (one.run.name == name) is inside] for inside in (True, False))
    return fmean(own) / fmean(rest) - 1 if own and rest else 0.0


def _ratios(touches: Iterable[Found], name: str) -> list[float]:
    return [one.ratio for one in touches if one.run.name == name]


def _mean(shares: Iterable[float]) -> float | None:
    known = list(shares)
    return fmean(known) if known else None


def _root(shares: Iterable[float]) -> float | None:
    """Return the root mean square."""
    mean = _mean(share**2 for share in shares)
    return None if mean is None else sqrt(mean)
