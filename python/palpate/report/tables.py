"""The tables of a report: their columns, and their rows as text."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from itertools import compress
from math import hypot, isfinite, isnan, nan

from palpate import number_format
from palpate.calibration.assessment import Residual
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import Modulus, ModulusUnit
from palpate.display.markup import LEFT_OUT, MINUS, NONE
from palpate.display.text import lasting
from palpate.materials import KnownModulus, shore_a_of_modulus
from palpate.report.calibration_head import LeftOutTouch
from palpate.report.findings import Findings, ReportedTouch, SpecimenResult
from palpate.report.recording_facts import Event, RecordingFacts

Cell = str | int
"""A cell of a table; `Markup` is a text that is not escaped."""

_ERROR = "± (k = 1)"  # one standard deviation
TEXT_COLUMNS = (
    "Specimen",
    "specimen",
    "95 % interval",
    "Inside",
    "Mark",
    "Recording",
    "Missing",
    "Check",
    "What",
    "Text",
    "Parameter",
    "Value",
    "Values",
    "Why",
)
"""Columns whose cells are text, aligned to the left, and may wrap; those of all others are numbers."""


@dataclass(frozen=True)
class ReportRow:
    """A row of a table: a cell for each column, none for a row of remarks, and remarks below it."""

    cells: tuple[Cell, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReportTable:
    """A table as text."""

    columns: tuple[str, ...]
    rows: tuple[ReportRow, ...]

    @classmethod
    def of(cls, columns: Iterable[str], rows: Iterable[ReportRow]) -> "ReportTable":
        """Return a table without the columns that are empty in each row."""
        known = tuple(rows)
        cells = [row.cells for row in known if row.cells]
        full = [set(column) != {""} for column in zip(*cells, strict=True)]
        shown = []
        for row in known:
            filled = tuple(compress(row.cells, full))
            shown.append(replace(row, cells=filled))
        return cls(tuple(compress(columns, full)), tuple(shown))


@dataclass(frozen=True)
class ModulusStyle:
    """How moduli are shown: their unit, and whether with Shore A, by `shore_a_of_modulus`."""

    unit: ModulusUnit = ModulusUnit.MPA
    shore: bool = False

    def columns(self) -> list[str]:
        """Return the columns of a modulus."""
        if self.shore:
            return [self.unit, "Shore A", "95 % interval"]
        return [self.unit, "95 % interval"]

    def known(self, known: KnownModulus) -> str:
        """Return a known modulus, with its standard uncertainty if it has one."""
        value = self.unit.of(known.modulus)
        if not known.whole:
            return f"{value:g}"
        text = number_format.number(value, value * known.whole)
        return f"{text} ± {number_format.error(100 * known.whole)} %"

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
        return [value or NONE, known_text(f"{hardness:.0f}", hardness), interval]


def known_text(text: str, value: float) -> str:
    """Return the text of a value; `NONE`: the value is unknown."""
    return text if isfinite(value) else NONE


def percent(share: float) -> str:
    """Return an error in percent; `NONE`: unknown."""
    return known_text(number_format.error(100 * share), share)


def clock(seconds: float) -> str:
    """Return a time since the start of a recording; `NONE`: unknown."""
    return NONE if isnan(seconds) else lasting(timedelta(seconds=seconds))


def signed(text: str) -> str:
    """Return a number as text with a minus sign in place of a hyphen."""
    return text.replace("-", MINUS)


def result_table(found: Findings, style: ModulusStyle) -> ReportTable:
    """Return the table of the specimens."""
    columns = ["Specimen", *style.columns(), f"Known, {style.unit}", "Inside", "Ratio", _ERROR]
    columns += ["CV, %", "Kept", "Left out"]
    missing = NONE if found.calibration else ""
    rows = [_result_row(one, style, missing) for one in found.results]
    return ReportTable.of(columns, rows)


def _result_row(one: SpecimenResult, style: ModulusStyle, missing: str) -> ReportRow:
    ratio = error = NONE
    if one.mean:
        ratio = number_format.number(one.mean.ratio, one.mean.standard_error)
        error = number_format.error(one.mean.standard_error)
    inside = {True: "yes", False: "no", None: ""}[one.inside]
    known = "" if one.known is None else style.known(one.known)
    left_out = len(one.touches) - len(one.kept)
    cells: list[Cell] = [
        one.name,
        *style.cells(one.modulus, missing),
        known,
        inside,
        ratio,
        error,
        percent(one.variation),
        len(one.kept),
        left_out or NONE,
    ]
    return ReportRow(tuple(cells))


def budget_table(results: Iterable[SpecimenResult]) -> ReportTable:
    """Return the parts of the uncertainty of each modulus."""
    columns: dict[str, None] = {}
    rows = []
    for one in results:
        cells = [one.name]
        for part in one.budget:
            columns[part.name.capitalize()] = None
            cells.append(number_format.error(part.of_ratio))
        if one.budget:
            cells.append(number_format.error(one.budget[-1].of_modulus))
            rows.append(ReportRow(tuple(cells)))
    return ReportTable.of(["Specimen", *columns, "Of the modulus"], rows)


def touch_columns(style: ModulusStyle) -> list[str]:
    """Return the columns of the table of touches."""
    columns = ["Touch", "Specimen", *style.columns(), "Start", "Samples", "Ratio", _ERROR]
    return [*columns, "Noise, %", "From mean, %", "Alarm, %", "Mark"]


def row_of_touch(
    one: ReportedTouch, found: Findings, style: ModulusStyle, events: Iterable[Event]
) -> ReportRow:
    """Return the row of a touch, with the sentences about it; `events` are of its recording."""
    touch = one.touch
    known = one.uncertainty(found.scatter)
    calibration = found.calibration
    modulus = None
    if calibration and not one.left_out:
        modulus = calibration.modulus_of(touch)
    noise = nan
    if known.ratio:
        noise = known.noise / abs(known.ratio)
    from_mean = nan
    for result in found.results:
        if result.name == one.specimen and result.mean:
            from_mean = one.ratio / result.mean.ratio - 1
    cells: list[Cell] = [
        one.number,
        one.specimen or NONE,
        *style.cells(modulus, NONE if calibration else ""),
        clock(touch.start_s - one.run.first_s),
        touch.samples,
        number_format.number(known.ratio, known.uncertainty),
        known_text(number_format.error(known.uncertainty), known.uncertainty),
        percent(noise),
        known_text(signed(f"{100 * from_mean:+.1f}"), from_mean),
        f"{100 * touch.alarm_share:.0f}",
        "; ".join(_marks(one, events)),
    ]
    remarks = [f"{LEFT_OUT} left out. {reason}" for reason in one.left_out]
    for advice in one.advice:
        if advice not in one.left_out:
            remarks.append(advice)
    return ReportRow(tuple(cells), tuple(remarks))


def _marks(one: ReportedTouch, events: Iterable[Event]) -> list[str]:
    """Return the marks in a recording during a touch."""
    start_s = one.touch.start_s
    end_s = start_s + one.touch.samples * one.run.period_s
    marks = []
    for event in events:
        if event.kind == "mark" and start_s <= event.t_s <= end_s:
            marks.append(event.text)
    return marks


def recording_table(facts: Iterable[RecordingFacts]) -> ReportTable:
    """Return the table of the recordings: begin, length, rows, lost samples, and remarks."""
    columns = ["Recording", "Begin", "Length", "Rows", "Missing", "Check"]
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


def event_table(facts: Iterable[RecordingFacts]) -> ReportTable:
    """Return the table of notes, marks, tares, gaps and judgements."""
    rows = []
    for each in facts:
        for event in each.events:
            time = clock(event.t_s - each.run.first_s)
            rows.append(ReportRow((each.run.name, time, event.kind, event.text)))
    return ReportTable.of(["Recording", "Time", "What", "Text"], rows)


def left_out_table(left_out: Iterable[LeftOutTouch]) -> ReportTable:
    """Return the table of the touches that do not count, with the reasons."""
    rows = []
    for one in left_out:
        reasons = "; ".join(one.reasons)
        rows.append(ReportRow((one.number, one.recording, one.specimen or NONE, reasons)))
    return ReportTable.of(["Touch", "Recording", "Specimen", "Why"], rows)


def parameter_table(calibration: Calibration) -> ReportTable:
    """Return the parameters of a calibration."""
    rows = map(ReportRow, calibration.parameter_rows())
    return ReportTable.of(["Parameter", "Value", "95 % interval"], rows)


def distance_table(calibration: Calibration) -> ReportTable:
    """Return the specimens of a fit: their values, their mean, and its distance from the curve."""
    columns = ["MPa", "u(E), %", "Touches", "Ratio", "Curve", "Distance, %"]
    columns += ["In std. errors", "Values"]
    rows = [_distance_row(calibration, one) for one in calibration.residuals]
    return ReportTable.of(columns, rows)


def _distance_row(calibration: Calibration, one: Residual) -> ReportRow:
    rows = calibration.moduli == one.modulus
    values = calibration.ratios[rows]
    own = calibration.modulus_uncertainties[rows][0]
    common = calibration.common_uncertainties[rows][0]
    uncertainty = hypot(own, common)
    stated = ""
    if uncertainty:
        stated = number_format.error(100 * uncertainty)
    spread = calibration.touch_spread
    return ReportRow(
        (
            f"{one.modulus:g}",
            stated,
            one.touches,
            number_format.number(one.ratio, one.standard_error),
            number_format.number(one.fitted, one.standard_error),
            signed(one.percent),
            signed(f"{one.standardised:+.1f}"),
            ", ".join(map(number_format.number, values, spread * values)),
        )
    )


def table_of_texts(rows: Sequence[Sequence[str]]) -> ReportTable:
    """Return a table of texts; the first row is the header."""
    return ReportTable.of(rows[0], map(ReportRow, map(tuple, rows[1:])))
