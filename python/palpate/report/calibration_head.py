"""The head of the report of a calibration, and the touches that it leaves out."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.display.text import counted
from palpate.flags import advice_at_end, sentences
from palpate.repeatability import objections
from palpate.report.findings import AnalysedRecording, AssignedTouch, assigned
from palpate.report.recording_facts import (
    NamedValue,
    RecordingFacts,
    RowCounts,
    SourceFile,
    first_and_last,
    joined_once,
)
from palpate.uncertainty import RatioOf, hold_ratio

TITLE = "Calibration of a probe"
_NO_MODULUS = "no modulus of its specimen is known"


@dataclass(frozen=True)
class LeftOutTouch:
    """A touch that does not count in a calibration.

    Attributes
    ----------
    number : int
        Its number in the recording, from 1.
    recording : str
        Name of the recording.
    specimen : str
        "": unknown.
    reasons : tuple of str
        Why it does not count, a sentence each.
    """

    number: int
    recording: str
    specimen: str
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class CalibrationHead:
    """What the report of a calibration says before the curve, and the touches that it leaves out.

    Attributes
    ----------
    title : str
    facts : tuple of NamedValue
        Names and values; an empty value is not shown.
    simulated : tuple of str
        Names of recordings that no probe made.
    is_all_simulated : bool
        Whether these are all recordings.
    doubts : tuple of str
        Why the calibration is not to be relied on.
    left_out : tuple of LeftOutTouch
    files : tuple of SourceFile
        The files of which the calibration was made.

    Examples
    --------
    >>> CalibrationHead(facts=(NamedValue("Operator", "A. Bee"),)).title
    'Calibration of a probe'
    """

    title: str = TITLE
    facts: tuple[NamedValue, ...] = ()
    simulated: tuple[str, ...] = ()
    is_all_simulated: bool = False
    doubts: tuple[str, ...] = ()
    left_out: tuple[LeftOutTouch, ...] = ()
    files: tuple[SourceFile, ...] = ()

    @classmethod
    def of_recordings(
        cls,
        runs: Sequence[AnalysedRecording],
        *,
        moduli: Path | None = None,
        stated: Iterable[NamedValue] = (),
        left_out: Iterable[LeftOutTouch] = (),
    ) -> "CalibrationHead":
        """Return the head for recordings.

        Parameters
        ----------
        runs : sequence of AnalysedRecording
        moduli : pathlib.Path, optional
            The table of known moduli.
        stated : iterable of NamedValue
            Further facts, as the probe; one with the name of a fact of the recordings is shown in
            its place.
        left_out : iterable of LeftOutTouch
            As of `left_out_touches`.
        """
        facts = list(map(RecordingFacts, runs))
        simulated = []
        doubts = []
        files = []
        for each in facts:
            if each.run.recording.sidecar.is_simulated:
                simulated.append(each.run.name)
            for doubt in each.run.recording.doubts:
                doubts.append(f"{each.run.name}: {doubt}")
            files += each.files()
        if moduli:
            files.append(SourceFile(moduli.name, moduli))
        session = joined_once(run.plan.title for run in runs)
        values = _facts_of_recordings(facts)
        for name, value in stated:
            values[name] = value or values.get(name, "")
        return cls(
            f"{TITLE}: {session}" if session else TITLE,
            tuple(NamedValue(name, value) for name, value in values.items()),
            tuple(simulated),
            len(simulated) == len(runs),
            tuple(doubts),
            tuple(left_out),
            tuple(files),
        )


def _facts_of_recordings(facts: Sequence[RecordingFacts]) -> dict[str, str]:
    """Return the facts of recordings in the order of the head."""
    runs = []
    operators = []
    boards = []
    verdicts = []
    for each in facts:
        runs.append(each.run)
        operators.append(each.run.plan.operator)
        boards.append(each.board)
        verdicts.append(each.run.checked.verdict)
    recordings = counted(len(runs), "recording")
    if len(runs) == 1:
        recordings = runs[0].name
    return {
        "Operator": joined_once(operators),
        "Begin": " to ".join(first_and_last(facts)) or "unknown",
        "Probe": "",
        "Site": "",
        "Board": joined_once(boards),
        "Recordings": recordings,
        "Rows": str(RowCounts.of(runs)),
        "Check": joined_once(verdicts),
    }


def left_out_touches(
    runs: Iterable[AnalysedRecording],
    moduli: Mapping[str, object],
    accept: Collection[str] = (),
    ratio_of: RatioOf = hold_ratio,
) -> Iterator[LeftOutTouch]:
    """Yield each touch that does not count in a calibration, with its reasons.

    Parameters
    ----------
    runs : iterable of AnalysedRecording
    moduli : mapping of str to float, MPa
        Known moduli by the names of specimens.
    accept : collection of str
        Flags that do not exclude a touch.
    ratio_of : callable
        The ratio that is calibrated.
    """
    for run in runs:
        advice = advice_at_end(run.found.touches, cut=run.found.cut)
        for number, one in enumerate(assigned(run, moduli), 1):
            against = objections(one.touch, accept, ratio_of)
            reasons = [*_reasons(one, moduli), *sentences(against, advice[number - 1])]
            if reasons:
                yield LeftOutTouch(number, run.name, one.specimen, tuple(reasons))


def _reasons(one: AssignedTouch, moduli: Mapping[str, object]) -> Iterator[str]:
    """Yield why a touch does not count, apart from its flags."""
    if one.left_out:
        yield one.left_out
    if not one.specimen:
        yield "no specimen is named for it"
    elif one.specimen not in moduli:
        yield _NO_MODULUS
