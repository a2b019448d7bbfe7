"""The content of a report as data: its options, its sections, and how they are made of findings."""

import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from palpate._core import __version__
from palpate.calibration import plot
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import ModulusUnit
from palpate.calibration.validity import doubts_of_calibration
from palpate.display.markup import Markup, element
from palpate.display.text import counted
from palpate.report.anova import Repeatability
from palpate.report.findings import (
    Findings,
    SpecimenResult,
)
from palpate.report.recording_facts import (
    NamedValue,
    RecordingFacts,
    Settings,
    SourceFile,
    joined_once,
    shared_settings,
)
from palpate.report.tables import (
    ModulusStyle,
    ReportRow,
    ReportTable,
    TouchTableBuilder,
    budget_table,
    distance_table,
    event_table,
    parameter_table,
    recording_table,
    result_table,
)

_MOST_NAMED = 3  # specimens in the first sentence
Progress = Callable[[str], None]
"""Receives the progress of a report as a text; an error that it raises ends the work."""


@dataclass(frozen=True)
class ReportOptions:
    """The options of `palpate report`; an empty one is not given."""

    calibration: Path | None = None
    moduli: Path | None = None
    title: str = ""
    operator: str = ""
    probe: str = ""
    site: str = ""
    style: ModulusStyle = field(default_factory=ModulusStyle)
    notes: tuple[str, ...] = ()

    def words(self) -> str:
        """Return the options as words of a command line, each after a blank."""
        unit = self.style.unit
        named = [
            ("calibration", self.calibration.name if self.calibration else ""),
            ("moduli", self.moduli.name if self.moduli else ""),
            ("title", self.title),
            ("operator", self.operator),
            ("probe", self.probe),
            ("site", self.site),
            ("unit", "" if unit is ModulusUnit.MPA else unit),
        ]
        words = [f" --{name} {shlex.quote(text)}" for name, text in named if text]
        if self.style.shore:
            words.append(" --shore")
        words += [f" --note {shlex.quote(note)}" for note in self.notes if note]
        return "".join(words)

    def files(self) -> list[SourceFile]:
        """Return the files that the options name."""
        files = [file for file in (self.calibration, self.moduli) if file]
        return [SourceFile(file.name, file) for file in files]


@dataclass(frozen=True)
class CalibrationSection:
    """The section about a calibration."""

    calibration: Calibration
    picture: Markup
    rings: bool
    parameters: ReportTable
    distances: ReportTable
    about: str
    in_other_unit: bool = False  # whether the moduli of the report are not in MPa


@dataclass(frozen=True)
class SessionSections:
    """The sections about recordings, in their order."""

    found: Findings
    simulated: str
    doubts: list[str]
    named: list[str]
    verdict: str
    head: list[NamedValue]
    results: ReportTable | None
    kept: int
    repeatability: Repeatability | None
    parts: ReportTable | None
    touches: ReportTable | None
    recordings: ReportTable
    events: ReportTable | None
    settings: list[Settings]
    sums: list[NamedValue]
    commands: list[str]


@dataclass(frozen=True)
class ReportPage:
    """A whole report: of recordings, or of a calibration with its specimens."""

    title: str
    session: SessionSections | None = None
    calibration: CalibrationSection | None = None
    specimens: ReportTable | None = None
    version: str = __version__


def calibration_section(
    calibration: Calibration, results: Iterable[SpecimenResult] = (), *, in_other_unit: bool = False
) -> CalibrationSection:
    """Return the section about a calibration; moduli that were not known before are rings."""
    rings = []
    for one in results:
        if one.known is None and one.mean and one.modulus and isfinite(one.modulus.value):
            rings.append(plot.MeasuredObject(one.name, one.mean.ratio, one.modulus))
    about = calibration.about.entries()
    return CalibrationSection(
        calibration,
        picture=plot.curve_picture(calibration.curve(), rings),
        rings=bool(rings),
        parameters=parameter_table(calibration),
        distances=distance_table(calibration),
        about=", ".join(f"{name}: {text}" for name, text in about.items()),
        in_other_unit=in_other_unit,
    )


def page_of_session(found: Findings, options: ReportOptions, progress: Progress) -> ReportPage:
    """Return the report of recordings."""
    facts = [RecordingFacts(run) for run in found.runs]
    style = options.style
    kept = sum(not one.left_out for one in found.touches)
    counts = _RowCounts.of(found)
    sources = [file for each in facts for file in each.files()]
    session = SessionSections(
        found=found,
        simulated=_simulated(facts),
        doubts=_doubts(found),
        named=_named_moduli(found.results, style.unit),
        verdict=" ".join([*counts.sentences(), *_sentences(found, kept)]),
        head=_head(facts, options, counts),
        results=result_table(found, style) if found.results else None,
        kept=kept,
        repeatability=found.repeatability(),
        parts=budget_table(found.results),
        touches=_touch_table(found, facts, style, progress),
        recordings=recording_table(facts),
        events=event_table(facts),
        settings=[
            *shared_settings(facts),
            Settings("Reported by", (NamedValue("palpate", __version__),)),
        ],
        sums=[
            NamedValue(file.name, element("code", f"sha256 {file.checksum()}"))
            for file in [*sources, *options.files()]
        ],
        commands=_commands(found, options),
    )
    calibration = None
    if found.calibration:
        in_other_unit = style.unit is not ModulusUnit.MPA
        calibration = calibration_section(
            found.calibration, found.results, in_other_unit=in_other_unit
        )
    title = options.title or joined_once(run.plan.title for run in found.runs)
    return ReportPage(title or f"Report of {_recordings(found)}", session, calibration)


def _recordings(found: Findings) -> str:
    """Return the name of the recording, or the number of recordings."""
    if len(found.runs) == 1:
        return found.runs[0].name
    return counted(len(found.runs), "recording")


@dataclass(frozen=True)
class _RowCounts:
    """Rows of all recordings, and how many of them are lost, or were refused."""

    rows: int
    lost: int
    refused: int

    @classmethod
    def of(cls, found: Findings) -> "_RowCounts":
        """Return the sums over the recordings."""
        counts = [run.recording.survey for run in found.runs]
        return cls(
            sum(one.rows for one in counts),
            sum(one.lost for one in counts),
            sum(one.refused for one in counts),
        )

    def sentences(self) -> list[str]:
        """Return a sentence if rows are lost or refused."""
        bad = []
        if self.lost:
            bad.append(f"{self.lost:,} {_is(self.lost)} missing")
        if self.refused:
            bad.append(f"{self.refused:,} {_is(self.refused)} without a value")
        return [f"Of {self.rows + self.lost:,} rows {' and '.join(bad)}."] if bad else []

    def __str__(self) -> str:
        """Return the counts for the head of a report."""
        return f"{self.rows:,}, {self.lost:,} missing, {self.refused:,} without a value"


def _head(
    facts: Sequence[RecordingFacts], options: ReportOptions, counts: _RowCounts
) -> list[NamedValue]:
    """Return the entries of the head of a report; empty ones are not shown."""
    runs = [each.run for each in facts]
    begins = sorted(each.begin for each in facts if each.begin)
    return [
        NamedValue("Operator", options.operator or joined_once(run.plan.operator for run in runs)),
        NamedValue("Begin", joined_once([*begins[:1], *begins[-1:]], " to ") or "unknown"),
        *(NamedValue("Note", note) for note in options.notes),
        NamedValue("Probe", options.probe),
        NamedValue("Site", options.site),
        NamedValue("Calibration", options.calibration.name if options.calibration else "none"),
        NamedValue("Board", joined_once(each.board for each in facts)),
        NamedValue(
            "Recordings", runs[0].name if len(runs) == 1 else counted(len(runs), "recording")
        ),
        NamedValue("Rows", str(counts)),
        NamedValue("Check", joined_once(run.checked.verdict for run in runs)),
    ]


def _touch_table(
    found: Findings, facts: Sequence[RecordingFacts], style: ModulusStyle, progress: Progress
) -> ReportTable | None:
    """Return the table of the touches; of several recordings with their names; None: no touch."""
    if not found.touches:
        return None
    table = TouchTableBuilder(found, facts, style)
    rows: list[ReportRow] = []
    name = found.runs[0].name if len(found.runs) == 1 else ""
    for one in found.touches:
        progress(f"touch {one.number} of {len(found.touches)}")
        if one.run.name != name:
            name = one.run.name
            rows.append(table.heading(one))
        rows.append(table.row(one))
    return ReportTable.of(table.columns(), rows)


def _commands(found: Findings, options: ReportOptions) -> list[str]:
    """Return the commands that give the same results again."""
    names = shlex.join(run.name for run in found.runs)
    replay = f"palpate replay {names}"
    if options.calibration:
        replay += f" --calibration {shlex.quote(options.calibration.name)}"
    return [f"palpate check {names}", replay, f"palpate report {names}{options.words()}"]


def _simulated(facts: Sequence[RecordingFacts]) -> str:
    """Return the sentence about simulated data; "": there are none."""
    names = [each.run.name for each in facts if each.run.recording.sidecar.is_simulated]
    if not names:
        return ""
    some = "" if len(names) == len(facts) else f" in {', '.join(names)}"
    return f"Simulated data{some}: no probe was used."


def _doubts(found: Findings) -> list[str]:
    """Return why the report is not to be relied on."""
    doubts = [f"{run.name}: {doubt}" for run in found.runs for doubt in run.recording.doubts]
    if found.calibration:
        for scene in sorted({run.tracking["scene"] for run in found.runs}):
            doubts += doubts_of_calibration(found.calibration, scene).sentences()
    if not found.touches:
        doubts.append("no touch was found")
    return list(dict.fromkeys(doubts))


def _named_moduli(results: Sequence[SpecimenResult], unit: ModulusUnit) -> list[str]:
    """Return the moduli that were not known before, a sentence each."""
    named = []
    for one in results:
        if one.known is None and one.modulus:
            value, interval = one.modulus.texts(unit)
            text = f"{value} {unit} (95 %: {interval})" if value else interval
            named.append(f"{one.name}: {text}.")
    more = len(named) - _MOST_NAMED
    if more > 0:
        return [*named[:_MOST_NAMED], f"{counted(more, 'more specimen')} below."]
    return named


def _sentences(found: Findings, kept: int) -> Iterator[str]:
    """Yield the sentences about the touches and the moduli."""
    if not found.touches:
        yield "No touch was found."
        return
    left = len(found.touches) - kept
    reasons = f"; {left} {_is(left)} left out, with reasons" if left else ""
    yield f"{kept} of {counted(len(found.touches), 'touch')} {_is(kept)} kept{reasons}."
    inside = [result.inside for result in found.results if result.inside is not None]
    if inside:
        right = inside.count(True)
        yield f"{right} of {len(inside)} known moduli {_is(right)} in the 95 % interval."
    if found.calibration is None:
        yield "No calibration was given, so there are ratios, and no moduli."
        return
    fitted = found.calibration.ratios
    of_fit = sum(one.ratio in fitted for one in found.touches)  # with the same bits
    if of_fit:
        yield (
            f"{of_fit} of these touches are data of the calibration itself: for them that is no "
            "independent test."
        )


def _is(count: int) -> str:
    return "is" if count == 1 else "are"
