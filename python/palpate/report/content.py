"""The content of a report as data: its options, and the sections that its template shows."""

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from math import isfinite
from os import PathLike
from pathlib import Path

from palpate._core import __version__
from palpate.calibration.assessment import calibration_doubts
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import ModulusUnit
from palpate.calibration.origin import (
    AcceptedOrigin,
    ReadingsOrigin,
    accepted_remarks,
    missing_remark,
    origin_remarks,
)
from palpate.calibration.plot import MeasuredObject
from palpate.calibration.provenance import Provenance
from palpate.display.markup import element
from palpate.display.text import counted
from palpate.messages import listed, unlike
from palpate.report.findings import Findings
from palpate.report.recording_facts import (
    NamedValue,
    RecordingFacts,
    RowCounts,
    Settings,
    SourceFile,
    first_and_last,
    joined_once,
    shared_settings,
)
from palpate.report.tables import (
    ModulusStyle,
    ReportRow,
    ReportTable,
    row_of_touch,
    touch_columns,
)


def _touches_of_the_fit(found: Findings, provenance: Provenance) -> int:
    """Return how many touches are in recordings from which the calibration was made."""
    count = 0
    for run in found.runs:
        path = run.recording.path
        if any(file.name == path.name and file.is_of(path) for file in provenance.files):
            count += len(run.found.touches)
    return count


_MOST_NAMED = 3  # specimens in the first sentence
Progress = Callable[[str], None]
"""Receives the progress of a report as a text; an error that it raises ends the work."""


@dataclass(frozen=True)
class ReportOptions:
    """The options of a report, as those of `palpate report`.

    Attributes
    ----------
    calibration : path-like, optional
        File of `Calibration.save`: adds the moduli.
    moduli : path-like, optional
        Table of known moduli as for `palpate calibrate`: for recordings whose sidecar names no
        specimens.
    title, operator : str
        Default: from the sessions in the sidecars.
    probe, site : str
        For the head of the report.
    unit : str
        Of the moduli of specimens and touches: "MPa" or "kPa".
    shore : bool
        Whether to add Shore A to the moduli, by `shore_a_of_modulus`.
    notes : sequence of str
        For the head of the report.
    accept : sequence of str
        What is accepted of the calibration, of `palpate.calibration.origin.AcceptedOrigin`.

    Raises
    ------
    ValueError
        An unknown unit or acceptance.

    Examples
    --------
    >>> ReportOptions("bench/probe.toml", operator="A. Bee", shore=True).words()
    " --calibration probe.toml --operator 'A. Bee' --shore"
    """

    calibration: str | PathLike[str] | None = None
    moduli: str | PathLike[str] | None = None
    title: str = ""
    operator: str = ""
    probe: str = ""
    site: str = ""
    unit: str = ModulusUnit.MPA
    shore: bool = False
    notes: Sequence[str] = ()
    accept: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Check the unit, and what is accepted."""
        if self.unit not in list(ModulusUnit):
            raise ValueError(f"unit: {unlike(self.unit, list(ModulusUnit))}")
        for name in self.accept:
            if name not in list(AcceptedOrigin):
                raise ValueError(f"accept: {unlike(name, list(AcceptedOrigin))}")

    @property
    def style(self) -> ModulusStyle:
        """How moduli are shown."""
        return ModulusStyle(ModulusUnit(self.unit), self.shore)

    @property
    def calibration_name(self) -> str:
        """Name of the file of the calibration; "": none."""
        return Path(self.calibration or "").name

    def words(self) -> str:
        """Return the options as words of a command line, each after a blank."""
        words = ""
        for name, value in asdict(self).items():
            if name in ("calibration", "moduli") and value:
                value = Path(value).name
            if name == "notes":
                for note in filter(None, value):
                    words += f" --note {shlex.quote(note)}"
            elif name == "accept":
                words += self.accept_words()
            elif value is True:
                words += f" --{name}"
            elif value and value != ModulusUnit.MPA:
                words += f" --{name} {shlex.quote(value)}"
        return words

    def accept_words(self) -> str:
        """Return what is accepted as words of a command line, each after a blank."""
        return "".join(map(" --accept {}".format, self.accept))

    def files(self) -> list[SourceFile]:
        """Return the files that the options name."""
        files = []
        for option in (self.calibration, self.moduli):
            if option:
                path = Path(option)
                files.append(SourceFile(path.name, path))
        return files


@dataclass(frozen=True)
class CalibrationSection:
    """The section about a calibration; measured objects are rings in its drawing."""

    calibration: Calibration
    rings: Sequence[MeasuredObject] = ()
    in_other_unit: bool = False  # whether the moduli of the report are not in MPa


@dataclass(frozen=True)
class Session:
    """The sections about recordings, in their order."""

    found: Findings
    options: ReportOptions
    progress: Progress

    @cached_property
    def facts(self) -> list[RecordingFacts]:
        """The facts of each recording."""
        return list(map(RecordingFacts, self.found.runs))

    @property
    def rows(self) -> RowCounts:
        """The rows of all recordings."""
        return RowCounts.of(self.found.runs)

    @property
    def kept(self) -> int:
        """Number of touches that are kept."""
        return sum(not one.left_out for one in self.found.touches)

    @property
    def title(self) -> str:
        """The title of the options, of the sessions, or one with the names."""
        title = self.options.title or joined_once(run.plan.title for run in self.found.runs)
        return title or f"Report of {self.recordings_text}"

    @property
    def recordings_text(self) -> str:
        """The name of the recording, or the number of recordings."""
        runs = self.found.runs
        if len(runs) == 1:
            return runs[0].name
        return counted(len(runs), "recording")

    @property
    def simulated(self) -> list[str]:
        """The names of recordings that no probe made."""
        names = []
        for run in self.found.runs:
            if run.recording.sidecar.is_simulated:
                names.append(run.name)
        return names

    @cached_property
    def doubts(self) -> list[str]:
        """Why the report is not to be relied on."""
        found = self.found
        doubts = []
        for run in found.runs:
            doubts += [f"{run.name}: {doubt}" for doubt in run.recording.doubts]
        if found.calibration:
            scenes = {run.tracking["scene"] for run in found.runs}
            for scene in sorted(scenes):
                doubts += calibration_doubts(found.calibration, scene)
        if not found.touches:
            doubts.append("no touch was found")
        return list(dict.fromkeys(doubts))

    @property
    def accepted(self) -> list[str]:
        """What differs between the calibration and the recordings, and was accepted."""
        return self._of_origins(accepted_remarks)

    @cached_property
    def origin_remarks(self) -> list[str]:
        """Remarks on the origins of the calibration and of the recordings."""
        if self.found.calibration is None:
            return []
        missing = missing_remark(self.found.calibration.about.provenance)
        return [*filter(None, [missing]), *self._of_origins(origin_remarks)]

    def _of_origins(
        self, remarks_of: Callable[[Provenance, ReadingsOrigin], list[str]]
    ) -> list[str]:
        """Return remarks on calibration and recordings, each once with the names of these."""
        if self.found.calibration is None:
            return []
        provenance = self.found.calibration.about.provenance
        names: dict[str, list[str]] = {}
        for run in self.found.runs:
            origin = ReadingsOrigin.of_sidecar(run.recording.sidecar)
            for remark in remarks_of(provenance, origin):
                names.setdefault(remark, []).append(run.name)
        remarks = []
        for remark, of in names.items():
            remarks.append(f"{listed(of, _MOST_NAMED)}: {remark}")
        return remarks

    @property
    def judged(self) -> list[str]:
        """What was judged of the readings, a sentence each, with the name of the recording."""
        judged = []
        for each in self.facts:
            judged += [f"{each.run.name}: {text}." for text in each.judged]
        return judged

    @property
    def named(self) -> list[str]:
        """The moduli that were not known before, a sentence each."""
        unit = self.options.style.unit
        named = []
        for one in self.found.results:
            if one.known is None and one.modulus:
                value, interval = one.modulus.texts(unit)
                if value:
                    interval = f"{value} {unit} (95 %: {interval})"
                named.append(f"{one.name}: {interval}.")
        more = len(named) - _MOST_NAMED
        if more > 0:
            return [*named[:_MOST_NAMED], f"{counted(more, 'more specimen')} below."]
        return named

    @property
    def verdict(self) -> str:
        """The sentences about rows, touches and moduli."""
        return " ".join(self._sentences())

    def _sentences(self) -> Iterator[str]:
        """Yield the sentences of the verdict."""
        found = self.found
        rows = self.rows
        bad = []
        if rows.lost:
            bad.append(f"{rows.lost:,} {_is(rows.lost)} missing")
        if rows.refused:
            bad.append(f"{rows.refused:,} {_is(rows.refused)} without a value")
        if bad:
            yield f"Of {rows.rows + rows.lost:,} rows {' and '.join(bad)}."
        if not found.touches:
            yield "No touch was found."
            return
        sentence = f"{self.kept} of {counted(len(found.touches), 'touch')} {_is(self.kept)} kept"
        left = len(found.touches) - self.kept
        if left:
            sentence += f"; {left} {_is(left)} left out, with reasons"
        yield f"{sentence}."
        inside = [one.inside for one in found.results if one.inside is not None]
        if inside:
            right = inside.count(True)
            yield f"{right} of {len(inside)} known moduli {_is(right)} in the 95 % interval."
        if found.calibration is None:
            yield "No calibration was given, so there are ratios, and no moduli."
            return
        if found.learned:
            yield found.learned
        of_fit = _touches_of_the_fit(found, found.calibration.about.provenance)
        if of_fit:
            yield (
                f"{of_fit} of these touches are data of the calibration itself: for them that is "
                "no independent test."
            )

    @property
    def begins(self) -> list[str]:
        """When the first and the last recording began, as far as it is known."""
        return first_and_last(self.facts)

    @cached_property
    def touches(self) -> ReportTable:
        """The table of the touches; with the names of several recordings."""
        runs = self.found.runs
        touches = self.found.touches
        style = self.options.style
        events = {each.run.name: each.events for each in self.facts}
        rows: list[ReportRow] = []
        name = ""
        for one in touches:
            self.progress(f"touch {one.number} of {len(touches)}")
            if one.run.name != name and len(runs) > 1:
                rows.append(ReportRow(remarks=(element("b", one.run.name),)))
            name = one.run.name
            rows.append(row_of_touch(one, self.found, style, events[name]))
        return ReportTable.of(touch_columns(style), rows)

    @property
    def settings(self) -> list[Settings]:
        """Devices and settings, and the version that made the report."""
        reported_by = Settings("Reported by", (NamedValue("palpate", __version__),))
        return [*shared_settings(self.facts), reported_by]

    @property
    def files(self) -> list[SourceFile]:
        """The files of which the report is made."""
        files: list[SourceFile] = []
        for each in self.facts:
            files += each.files()
        return [*files, *self.options.files()]

    @property
    def commands(self) -> list[str]:
        """The commands that give the same results again."""
        names = shlex.join(run.name for run in self.found.runs)
        replay = f"palpate replay {names}"
        if self.options.calibration:
            replay += f" --calibration {shlex.quote(self.options.calibration_name)}"
            replay += self.options.accept_words()
        report = f"palpate report {names}{self.options.words()}"
        return [f"palpate check {names}", replay, report]

    @property
    def calibration(self) -> CalibrationSection | None:
        """The section about the calibration; moduli that were not known before are rings."""
        if not self.found.calibration:
            return None
        rings = []
        for one in self.found.results:
            if one.known is None and one.mean and one.modulus and isfinite(one.modulus.value):
                rings.append(MeasuredObject(one.name, one.mean.ratio, one.modulus))
        in_other_unit = self.options.unit != ModulusUnit.MPA
        return CalibrationSection(self.found.calibration, rings, in_other_unit)


def _is(count: int) -> str:
    return "is" if count == 1 else "are"
