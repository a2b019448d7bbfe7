"""Writes a report of recordings, or of a calibration, as one HTML file by filling the template."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import exp
from pathlib import Path

from palpate import number_format
from palpate._core import __version__
from palpate.calibration.model import Calibration
from palpate.calibration.origin import ReadingsOrigin, provenance_document, require_origin
from palpate.calibration.plot import curve_picture
from palpate.calibration.specimen_files import read_moduli
from palpate.calibration.specimen_fit import SpecimenTouches, specimen_table
from palpate.display.markup import NONE
from palpate.display.text import counted
from palpate.errors import need
from palpate.files import write_file
from palpate.report import tables
from palpate.report.calibration_head import CalibrationHead
from palpate.report.content import CalibrationSection, Progress, ReportOptions, Session
from palpate.report.findings import Findings, analyse_again, analyse_recording, findings

_PathLike = str | os.PathLike[str]
_NO_OPTIONS = ReportOptions()
_NO_HEAD = CalibrationHead()


@dataclass(frozen=True)
class WrittenReport:
    """A report that was written.

    Attributes
    ----------
    path : pathlib.Path
    verdict : str
        Its first sentences.
    doubts : tuple of str
        Why it is not to be relied on; empty: nothing is known against it.
    results : dict
        The results as plain numbers and text.
    remarks : tuple of str
        Remarks on the origins of the calibration and of the recordings.
    """

    path: Path
    verdict: str
    doubts: tuple[str, ...]
    results: dict[str, object]
    remarks: tuple[str, ...] = ()


def write_report(
    path: _PathLike,
    recordings: Sequence[_PathLike],
    options: ReportOptions = _NO_OPTIONS,
    *,
    progress: Progress = lambda _: None,
) -> WrittenReport:
    """Write, or replace, a report of recordings as one HTML file, which needs no other file.

    The same files and options give the same bytes: there is no date of the report in it.

    Parameters
    ----------
    path : path-like
        The file to write.
    recordings : sequence of path-like
        One or more.
    options : ReportOptions
        Calibration, known moduli, unit, and the texts of the head.
    progress : callable
        Receives the progress as a text, often; an error that it raises ends the work, and nothing
        is written.

    Returns
    -------
    WrittenReport

    Raises
    ------
    RecordingError, CalibrationError
        A file is damaged, or of another kind.
    CalibrationRefused
        The calibration is of another chip than a recording, or simulated.
    ValueError
        No recording, or a table whose meaning is ambiguous.
    MissingExtra
        jinja2 or scipy is missing; type: pip install 'palpate[report]'.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "report.html"
    >>> made = write_report(path, ["tests/data/four-specimens.csv"])
    >>> made.results["touches"], made.path.name
    (4, 'report.html')
    """
    for module in ("scipy", "jinja2"):
        need(module, "report")  # before the recordings are read
    found = _found(recordings, options, progress)
    session = Session(found, options, progress)
    page = _render(session.title, session=session, section=session.calibration)
    # A name of a file may be no text.
    write_file(Path(path), page.encode(errors="replace"))
    repeatability = found.repeatability()
    results = {
        "touches": len(found.touches),
        "kept": session.kept,
        "specimens": [result.as_dict() for result in found.results],
        "repeatability": repeatability and repeatability.as_dict(),
    }
    remarks = tuple(session.origin_remarks)
    if found.calibration:
        provenance = found.calibration.about.provenance
        results["calibration"] = provenance_document(provenance, remarks)
    verdict = " ".join([*session.named, session.verdict])
    return WrittenReport(Path(path), verdict, tuple(session.doubts), results, remarks)


def _found(recordings: Sequence[_PathLike], options: ReportOptions, progress: Progress) -> Findings:
    """Return the touches of recordings, measured as the calibration needs it."""
    moduli = {}
    paths = list(map(Path, recordings))
    if options.moduli:
        table = Path(options.moduli)
        moduli = read_moduli(table)
        paths = [path for path in paths if path.resolve() != table.resolve()]
    calibration = None
    if options.calibration:
        calibration = Calibration.load(options.calibration)
    runs = []
    for name, path in _named(paths).items():
        run = analyse_recording(path, name, progress=progress)
        if calibration:
            origin = ReadingsOrigin.of_sidecar(run.recording.sidecar)
            require_origin(name, calibration.about.provenance, origin, options.accept)
            run = analyse_again(run, calibration.for_tracking(run.tracking))
        runs.append(run)
    return findings(runs, calibration, moduli)


def _named(paths: Sequence[Path]) -> dict[str, Path]:
    """Return the recordings by their names in the report."""
    if not paths:
        raise ValueError("recordings: got none, allowed: one or more")
    if len(set(map(Path.resolve, paths))) < len(paths):
        raise ValueError("recordings: got one twice, allowed: each once")
    names = {path.name: path for path in paths}
    if len(names) < len(paths):
        names = dict(zip(map(Path.as_posix, paths), paths, strict=True))
    return names


def calibration_page(
    calibration: Calibration,
    specimens: Sequence[SpecimenTouches],
    head: CalibrationHead = _NO_HEAD,
) -> str:
    """Return the report of a calibration as one HTML page without external files.

    Parameters
    ----------
    calibration : Calibration
    specimens : sequence of SpecimenTouches
        Of the fit.
    head : CalibrationHead
        Title, date, probe, operator and files, and the touches that are left out.
    """
    section = CalibrationSection(calibration)
    table = tables.table_of_texts(specimen_table(specimens))
    return _render(head.title, section=section, specimens=table, head=head)


def _render(
    title: str,
    *,
    section: CalibrationSection | None,
    session: Session | None = None,
    specimens: tables.ReportTable | None = None,
    head: CalibrationHead | None = None,
) -> str:
    """Return a page as HTML: all of its texts are escaped except markup."""
    jinja2 = need("jinja2", "report")
    pages = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        undefined=jinja2.StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    pages.globals.update(exp=exp, digits=number_format, counted=counted, NONE=NONE)
    pages.globals.update(tables=tables, curve_picture=curve_picture, version=__version__)
    pages.filters["percent"] = tables.percent
    page = pages.get_template("report.html.j2")
    return str(
        page.render(title=title, section=section, session=session, specimens=specimens, head=head)
    ).lstrip()
