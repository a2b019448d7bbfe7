"""The tables of a report: their columns, and their rows as text."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from math import isfinite, isnan, nan
from typing import NamedTuple

from palpate import number_format
from palpate.calibration.assessment import Residual
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import Modulus, ModulusUnit
from palpate.display.markup import LEFT_OUT, MINUS, NONE, element
from palpate.display.text import lasting
from palpate.materials import shore_a_of_modulus
from palpate.report.findings import Findings, ReportedTouch, SpecimenResult
from palpate.report.recording_facts import RecordingFacts

Cell = str | int
"""A cell of a table; `Markup` is a text that is not escaped."""


class ReportColumn(NamedTuple):
    """A column of a table."""

    name: str
    of_text: bool = False
    """Whether its cells are text, aligned to the left, and may wrap."""


@dataclass(frozen=True)
class ReportRow:
    """A row of a table: a cell for each column, none for a row of remarks, and remarks below it."""

    cells: tuple[Cell, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReportTable:
    """A table as text."""

    columns: tuple[ReportColumn, ...]
    rows: tuple[ReportRow, ...]

    @classmethod
    def of(cls, columns: Sequence[ReportColumn], rows: Iterable[ReportRow]) -> "ReportTable":
        """Return a table without the columns that are empty in each row."""
        known = tuple(rows)
        full = [
            number
            for number in range(len(columns))
            if any(row.cells and row.cells[number] != "" for row in known)
        ]
        return cls(
            tuple(columns[number] for number in full),
            tuple(
                replace(row, cells=tuple(row.cells[number] for number in full if row.cells))
                for row in known
            ),
        )


@dataclass(frozen=True)
class ModulusStyle:
    """How moduli are shown: their unit, and whether with Shore A, by `shore_a_of_modulus`."""

    unit: ModulusUnit = ModulusUnit.MPA
    shore: bool = False

    def columns(self) -> list[ReportColumn]:
        """Return the columns of a modulus."""
        hardness = [ReportColumn("Shore A")] if self.shore else []
        return [ReportColumn(self.unit), *hardness, ReportColumn("95 % interval", of_text=True)]

    def cells(self, modulus: Modulus | None, missing: str) -> list[Cell]:
        """Return the cells of a modulus; without a value the interval says why."""
        if not modulus:
            return [missing] * len(self.columns())
        value, interval = modulus.texts(self.unit)
        if modulus.extrapolated:
            interval += ", beyond the specimens"
        if not self.shore:
            return [value or NONE, interval]
        hardness = shore_a_of_modulus(modulus.value)
        return [value or NONE, f"{hardness:.0f}" if isfinite(hardness) else NONE, interval]


def percent(share: float) -> str:
    """Return an error in percent; `NONE`: unknown."""
    return number_format.error(100 * share) if isfinite(share) else NONE


def clock(seconds: float) -> str:
    """Return a time since the start of a recording; `NONE`: unknown."""
    return NONE if isnan(seconds) else lasting(timedelta(seconds=seconds))


def signed(text: str) -> str:
    """Return a number as text with a minus sign in place of a hyphen."""
    return text.replace("-", MINUS)


def result_table(found: Findings, style: ModulusStyle) -> ReportTable:
    """Return the table of the specimens."""
    columns = [
        ReportColumn("Specimen", of_text=True),
        *style.columns(),
        ReportColumn(f"Known, {style.unit}"),
        ReportColumn("Inside", of_text=True),
        ReportColumn("Ratio"),
        ReportColumn("±"),
        ReportColumn("CV, %"),
        ReportColumn("Kept"),
        ReportColumn("Left out"),
    ]
    missing = NONE if found.calibration else ""
    return ReportTable.of(columns, [_result_row(one, style, missing) for one in found.results])


def _result_row(one: SpecimenResult, style: ModulusStyle, missing: str) -> ReportRow:
    ratio = error = NONE
    if one.mean:
        ratio = number_format.number(one.mean.ratio, one.mean.standard_error)
        error = number_format.error(one.mean.standard_error)
    inside = ""
    if one.inside is not None:
        inside = "yes" if one.inside else "no"
    cells: list[Cell] = [
        one.name,
        *style.cells(one.modulus, missing),
        f"{style.unit.of(one.known):g}" if one.known else "",
        inside,
        ratio,
        error,
        percent(one.variation),
        len(one.kept),
        len(one.touches) - len(one.kept) or NONE,
    ]
    return ReportRow(tuple(cells))


def budget_table(results: Iterable[SpecimenResult]) -> ReportTable | None:
    """Return the parts of the uncertainty of each modulus; None: there is no modulus."""
    known = [one for one in results if one.budget]
    if not known:
        return None
    parts = [ReportColumn(part.name.capitalize()) for part in known[0].budget]
    rows = []
    for one in known:
        shares = [number_format.error(part.of_ratio) for part in one.budget]
        of_modulus = number_format.error(one.budget[-1].of_modulus)
        rows.append(ReportRow((one.name, *shares, of_modulus)))
    return ReportTable.of(
        [ReportColumn("Specimen", of_text=True), *parts, ReportColumn("Of the modulus")], rows
    )


TOUCH_COLUMNS = (
    ReportColumn("Start"),
    ReportColumn("Samples"),
    ReportColumn("Ratio"),
    ReportColumn("±"),
    ReportColumn("Noise, %"),
    ReportColumn("From mean, %"),
    ReportColumn("Alarm, %"),
    ReportColumn("Mark", of_text=True),
)


@dataclass(frozen=True)
class TouchTableBuilder:
    """The table of the touches of a report, row by row."""

    found: Findings
    facts: Sequence[RecordingFacts]
    style: ModulusStyle

    def columns(self) -> list[ReportColumn]:
        """Return the columns."""
        first = [ReportColumn("Touch"), ReportColumn("Specimen", of_text=True)]
        return [*first, *self.style.columns(), *TOUCH_COLUMNS]

    def heading(self, one: ReportedTouch) -> ReportRow:
        """Return the row with the name of the recording of a touch."""
        return ReportRow(remarks=(element("b", one.run.name),))

    def row(self, one: ReportedTouch) -> ReportRow:
        """Return the row of a touch, with the sentences about it."""
        touch = one.touch
        known = one.uncertainty(self.found.scatter)
        modulus = None
        if self.found.calibration and not one.left_out:
            modulus = self.found.calibration.modulus_of(touch)
        noise = known.noise / abs(known.ratio) if known.ratio else nan
        from_mean = self._from_mean(one)
        cells: list[Cell] = [
            one.number,
            one.specimen or NONE,
            *self.style.cells(modulus, NONE if self.found.calibration else ""),
            clock(touch.start_s - one.run.first_s),
            touch.samples,
            number_format.number(known.ratio, known.uncertainty),
            number_format.error(known.uncertainty) if isfinite(known.uncertainty) else NONE,
            percent(noise),
            signed(f"{100 * from_mean:+.1f}") if isfinite(from_mean) else NONE,
            f"{100 * touch.alarm_share:.0f}",
            "; ".join(self._marks(one)),
        ]
        left_out = [f"{LEFT_OUT} left out. {reason}" for reason in one.left_out]
        others = [advice for advice in one.advice if advice not in one.left_out]
        return ReportRow(tuple(cells), (*left_out, *others))

    def _from_mean(self, one: ReportedTouch) -> float:
        """Return the relative distance of a ratio from the mean of its specimen; nan: unknown."""
        for result in self.found.results:
            if result.name == one.specimen and result.mean:
                return one.ratio / result.mean.ratio - 1
        return nan

    def _marks(self, one: ReportedTouch) -> list[str]:
        """Return the marks in a recording during a touch."""
        start_s = one.touch.start_s
        end_s = start_s + one.touch.samples * one.run.period_s
        [facts] = [each for each in self.facts if each.run.name == one.run.name]
        return [
            event.text
            for event in facts.events
            if event.kind == "mark" and start_s <= event.t_s <= end_s
        ]


def recording_table(facts: Iterable[RecordingFacts]) -> ReportTable:
    """Return the table of the recordings: begin, length, rows, lost samples, and remarks."""
    columns = [
        ReportColumn("Recording", of_text=True),
        ReportColumn("Begin"),
        ReportColumn("Length"),
        ReportColumn("Rows"),
        ReportColumn("Missing", of_text=True),
        ReportColumn("Check", of_text=True),
    ]
    rows = []
    for each in facts:
        run = each.run
        counts = run.recording.survey
        missing = "0"
        if counts.lost:
            share = number_format.number(100 * counts.lost / (counts.rows + counts.lost))
            missing = f"{counts.lost} ({share} %) {counts.in_gaps}"
        length = "unknown"
        if run.checked.timed:
            length = lasting(timedelta(seconds=counts.seconds))
        begin = each.begin or "unknown"
        rows.append(ReportRow((run.name, begin, length, counts.rows, missing, each.remarks)))
    return ReportTable.of(columns, rows)


def event_table(facts: Iterable[RecordingFacts]) -> ReportTable | None:
    """Return the table of notes, marks, tares and gaps; None: there are none."""
    columns = [
        ReportColumn("Recording", of_text=True),
        ReportColumn("Time"),
        ReportColumn("What", of_text=True),
        ReportColumn("Text", of_text=True),
    ]
    rows = []
    for each in facts:
        for event in each.events:
            time = clock(event.t_s - each.run.first_s)
            rows.append(ReportRow((each.run.name, time, event.kind, event.text)))
    return ReportTable.of(columns, rows) if rows else None


def parameter_table(calibration: Calibration) -> ReportTable:
    """Return the parameters of a calibration."""
    names = ("Parameter", "Value", "95 % interval")
    columns = [ReportColumn(name, of_text=True) for name in names]
    return ReportTable.of(columns, [ReportRow(row) for row in calibration.parameter_rows()])


def distance_table(calibration: Calibration) -> ReportTable:
    """Return the specimens of a fit: their values, their mean, and its distance from the curve."""
    columns = [
        ReportColumn("MPa"),
        ReportColumn("Touches"),
        ReportColumn("Ratio"),
        ReportColumn("Curve"),
        ReportColumn("Distance, %"),
        ReportColumn("In std. errors"),
        ReportColumn("Values", of_text=True),
    ]
    rows = [_distance_row(calibration, one) for one in calibration.residuals]
    return ReportTable.of(columns, rows)


def _distance_row(calibration: Calibration, one: Residual) -> ReportRow:
    values = calibration.ratios[calibration.moduli == one.modulus].tolist()
    spread = calibration.touch_spread
    return ReportRow(
        (
            f"{one.modulus:g}",
            one.touches,
            number_format.number(one.ratio, one.standard_error),
            number_format.number(one.fitted, one.standard_error),
            signed(one.percent),
            signed(f"{one.standardised:+.1f}"),
            ", ".join(number_format.number(value, spread * value) for value in values),
        )
    )


def table_of_texts(rows: Sequence[Sequence[str]], of_text: str) -> ReportTable:
    """Return a table of texts; the first row is the header, and names the column of text."""
    columns = [ReportColumn(name, of_text=name == of_text) for name in rows[0]]
    return ReportTable.of(columns, [ReportRow(tuple(row)) for row in rows[1:]])
