"""What the page is told of the session: plain values, ready for JSON."""

from typing import Any

from palpate.live.desk.growth import Known
from palpate.live.desk.progress import Done, Progress
from palpate.recording.session import Specimen

Document = dict[str, Any]
_SHOWN = 99  # the newest touches of a specimen


def session(progress: Progress) -> Document:
    """Return the specimens with their touches, what comes next, how many touches are done, and the last touch."""
    last = progress.present[-1].number if progress.present else None
    judged = progress.judged
    return {
        "specimens": [_specimen(progress, one) for one in progress.specimens],
        "next": _next(progress),
        "count": {
            "kept": sum(min(judged[one.name].kept, one.wanted) for one in progress.specimens),
            "of": sum(one.wanted for one in progress.specimens),
        },
        "last": {"touch": last, "kept": not progress.why[last]} if last else None,
    }


def rows(progress: Progress) -> list[Document]:
    """Return specimen, deviation, whether it is kept, and why not, for each touch of the measurement."""
    means = {name: judged.mean for name, judged in progress.judged.items()}
    return [
        {
            "specimen": done.specimen,
            "deviation": _deviation(done, means[done.specimen] if done.specimen else None),
            "kept": not progress.why[done.number],
            "why": progress.why[done.number],
        }
        for done in progress.present
    ]


def known(progress: Progress) -> list[Known]:
    """Return the specimens of known modulus with their touches; those of earlier measurements have numbers below 1."""
    return [
        Known(
            one.name,
            one.modulus_MPa,
            one.wanted,
            tuple((done.number, done.touch, kept) for done, kept in progress.judged[one.name].touches),
        )
        for one in progress.specimens
        if one.modulus_MPa is not None
    ]


def _next(progress: Progress) -> Document | None:
    one = progress.named(progress.next or "")
    if one is None:
        return None
    nth = progress.judged[one.name].kept + 1
    return {"name": one.name, "modulus": one.modulus_MPa, "nth": nth, "of": max(one.wanted, nth)}


def _specimen(progress: Progress, one: Specimen) -> Document:
    judged = progress.judged[one.name]
    mean = judged.mean
    return {
        "name": one.name,
        "modulus": one.modulus_MPa,
        "kept": judged.kept,
        "of": one.wanted,
        "mean": mean,
        "deviations": [
            {
                "touch": done.number if done.number > 0 else None,
                "deviation": _deviation(done, mean),
                "kept": kept,
            }
            for done, kept in judged.touches[-_SHOWN:]
        ],
    }


def _deviation(done: Done, mean: float | None) -> float | None:
    return done.touch.ratio / mean - 1 if mean else None
