"""Writes a report of recordings, or of a calibration, as one HTML file by filling the template."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import exp
from pathlib import Path

from palpate import number_format
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import ModulusUnit
from palpate.calibration.specimen_files import read_moduli
from palpate.calibration.specimen_fit import SpecimenTouches, specimen_table
from palpate.display.markup import NONE
from palpate.display.text import counted
from palpate.errors import need
from palpate.files import write_file
from palpate.messages import unlike
from palpate.report.content import (
    Progress,
    ReportOptions,
    ReportPage,
    calibration_section,
    page_of_session,
)
from palpate.report.findings import (
    Findings,
    analyse_again,
    analyse_recording,
    findings,
)
from palpate.report.tables import (
    ModulusStyle,
    percent,
    table_of_texts,
)

_PathLike = str | os.PathLike[str]


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
    """

    path: Path
    verdict: str
    doubts: tuple[str, ...]
    results: dict[str, object]


def write_report(
    path: _PathLike,
    recordings: Sequence[_PathLike],
    calibration: _PathLike | None = None,
    *,
    moduli: _PathLike | None = None,
    title: str = "",
    operator: str = "",
    probe: str = "",
    site: str = "",
    unit: str = "MPa",
    shore: bool = False,
    notes: Sequence[str] = (),
    progress: Progress = lambda _: None,
) -> WrittenReport:
    """Write, or replace, a report of recordings as one HTML file, which needs no other file.

    The same files and arguments give the same bytes: there is no date of the report in it.

    Parameters
    ----------
    path : path-like
        The file to write.
    recordings : sequence of path-like
        One or more.
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
    ValueError
        No recording, an unknown unit, or a table whose meaning is ambiguous.
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
    if unit not in list(ModulusUnit):
        raise ValueError(f"unit: {unlike(unit, list(ModulusUnit))}")
    options = ReportOptions(
        calibration=Path(calibration) if calibration is not None else None,
        moduli=Path(moduli) if moduli is not None else None,
        title=title,
        operator=operator,
        probe=probe,
        site=site,
        style=ModulusStyle(ModulusUnit(unit), shore),
        notes=tuple(notes),
    )
    found = _found(recordings, options, progress)
    page = page_of_session(found, options, progress)
    session = page.session
    assert session is not None
    # A name of a file may be no text.
    write_file(Path(path), _render(page).encode(errors="replace"))
    repeatability = session.repeatability
    results = {
        "touches": len(found.touches),
        "kept": session.kept,
        "specimens": [result.as_dict() for result in found.results],
        "repeatability": repeatability and repeatability.as_dict(),
    }
    verdict = " ".join([*session.named, session.verdict])
    return WrittenReport(Path(path), verdict, tuple(session.doubts), results)


def _found(recordings: Sequence[_PathLike], options: ReportOptions, progress: Progress) -> Findings:
    """Return the touches of recordings, measured as the calibration needs it."""
    moduli = read_moduli(options.moduli) if options.moduli else {}
    calibration = Calibration.load(options.calibration) if options.calibration else None
    runs = []
    for name, path in _named_paths(recordings, options.moduli).items():
        runs.append(analyse_recording(path, name, progress=progress))
    if calibration:
        runs = [analyse_again(run, calibration.for_tracking(run.tracking)) for run in runs]
    return findings(runs, calibration, moduli)


def _named_paths(recordings: Sequence[_PathLike], table: Path | None) -> dict[str, Path]:
    """Return the recordings by their names in the report, without the table of moduli."""
    paths = [Path(each) for each in recordings]
    if table:
        paths = [path for path in paths if path.resolve() != table.resolve()]
    if not paths:
        raise ValueError("recordings: got none, allowed: one or more")
    if len({path.resolve() for path in paths}) < len(paths):
        raise ValueError("recordings: got one twice, allowed: each once")
    if len({path.name for path in paths}) < len(paths):
        return {path.as_posix(): path for path in paths}
    return {path.name: path for path in paths}


def calibration_page(calibration: Calibration, specimens: Sequence[SpecimenTouches]) -> str:
    """Return the report of a calibration as one HTML page without external files."""
    table = table_of_texts(specimen_table(specimens), of_text="specimen")
    section = calibration_section(calibration)
    return _render(ReportPage("Calibration of a probe", calibration=section, specimens=table))


def _render(page: ReportPage) -> str:
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
    pages.filters["percent"] = percent
    return str(pages.get_template("report.html.j2").render(page=page)).lstrip()
