"""Writes a report of recordings, or of a calibration, as one HTML file."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp
from pathlib import Path
from typing import Any

from palpate import digits
from palpate.calibration.calibration import Calibration
from palpate.calibration.characterise import Specimen
from palpate.calibration.fit_tables import specimen_rows
from palpate.calibration.specimen_files import read_moduli
from palpate.extras import need
from palpate.files import replacing
from palpate.report import sections
from palpate.report.findings import Findings, findings, run_of

_PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class Written:
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
    results: dict[str, Any]


def write(
    path: _PathLike,
    recordings: Sequence[_PathLike],
    calibration: _PathLike | None = None,
    *,
    moduli: _PathLike | None = None,
    title: str = "",
    operator: str = "",
    notes: Sequence[str] = (),
) -> Written:
    """Write a report of recordings as one HTML file, which needs no other file; one of this name is replaced.

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
        Table of known moduli as for `palpate calibrate`: for recordings whose sidecar names no specimens.
    title, operator : str
        Default: those of the sessions in the sidecars.
    notes : sequence of str
        For the head of the report.

    Returns
    -------
    Written

    Raises
    ------
    RecordingError, CalibrationError
        A file is not what it should be.
    ValueError
        No recording, or a table that leaves open how it is read.
    MissingExtra
        jinja2 or scipy is missing; type: pip install 'palpate[report]'.

    Examples
    --------
    >>> import tempfile
    >>> made = write(Path(tempfile.mkdtemp()) / "report.html", ["tests/data/four-specimens.csv"])
    >>> made.results["touches"], made.path.name
    (4, 'report.html')
    """
    for module in ("scipy", "jinja2"):
        need(module, "report")  # before the recordings are read
    probe, table = (None if given is None else Path(given) for given in (calibration, moduli))
    known = read_moduli(table) if table else {}
    runs = [run_of(each, name) for name, each in _named(recordings, table).items()]
    found = findings(runs, Calibration.load(probe) if probe else None, known)
    files = {name: file for name, file in (("calibration", probe), ("moduli", table)) if file}
    given = [("title", title), ("operator", operator), *(("note", note) for note in notes)]
    context = sections.context(found, files, [(name, text) for name, text in given if text])
    with replacing(Path(path)) as file:
        file.write(_render(context).encode(errors="replace"))  # a name of a file may be no text
    return Written(
        Path(path), " ".join([*context["named"], context["verdict"]]), tuple(context["doubts"]), _plain(found)
    )


def _plain(found: Findings) -> dict[str, Any]:
    """Return the results as plain numbers and text, for JSON."""
    repeatability = found.repeatability()
    return {
        "touches": len(found.touches),
        "kept": found.kept,
        "specimens": [result.as_dict() for result in found.results],
        "repeatability": repeatability.as_dict() if repeatability else None,
    }


def calibration_page(calibration: Calibration, specimens: Sequence[Specimen]) -> str:
    """Return the report of a calibration as one HTML page without external files."""
    head, *rows = specimen_rows(specimens)
    context = {
        "title": "palpate: calibration",
        "columns": [(name, "" if at else "name") for at, name in enumerate(head)],
        "specimens": rows,
    }
    return _render(context | sections.fitted(calibration))


def _render(context: Mapping[str, Any]) -> str:
    """Return a page: everything in the context is escaped but markup, and a name that it lacks is an error."""
    jinja2 = need("jinja2", "report")
    loader, undefined = jinja2.FileSystemLoader(Path(__file__).parent), jinja2.StrictUndefined
    pages = jinja2.Environment(
        loader=loader, autoescape=True, undefined=undefined, trim_blocks=True, lstrip_blocks=True
    )
    pages.globals.update(zip=zip, exp=exp, digits=digits, **sections.SHOWN)
    pages.filters["percent"] = sections.percent
    return str(pages.get_template("report.html.j2").render(context)).lstrip()


def _named(recordings: Sequence[_PathLike], table: Path | None) -> dict[str, Path]:
    """Return the recordings by the names that the report has for them, without the table of moduli."""
    paths = [Path(each) for each in recordings if not (table and Path(each).resolve() == table.resolve())]
    if not paths:
        raise ValueError("recordings: got none, allowed: one or more")
    alone = len({path.name for path in paths}) == len(paths)
    if len({path.resolve() for path in paths}) < len(paths):
        raise ValueError("recordings: got one twice, allowed: each once")
    return {path.name if alone else path.as_posix(): path for path in paths}
