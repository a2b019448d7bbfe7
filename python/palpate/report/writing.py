"""Writes a report: one HTML file."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate._core import __version__
from palpate.calibration.calibration import Calibration
from palpate.calibration.specimen_files import read_moduli
from palpate.display import page
from palpate.display.markup import Markup, element, plain
from palpate.extras import need
from palpate.files import replacing
from palpate.report import findings, records
from palpate.report.results import Session, as_dict, session
from palpate.report.runs import checksum, run

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
        scipy is missing; type: pip install 'palpate[science]'.

    Examples
    --------
    >>> import tempfile
    >>> made = write(Path(tempfile.mkdtemp()) / "report.html", ["tests/data/four-specimens.csv"])
    >>> made.results["touches"], made.path.name
    (4, 'report.html')
    """
    need("scipy", "science")  # before the recordings are read
    probe, table = (None if given is None else Path(given) for given in (calibration, moduli))
    known = read_moduli(table) if table else None
    runs = [run(each, name) for name, each in _named(recordings, table).items()]
    found = session(runs, Calibration.load(probe) if probe else None, known)
    given = [("title", title), ("operator", operator), *(("note", note) for note in notes)]
    text = _page(found, probe, table, [(name, text) for name, text in given if text])
    with replacing(Path(path)) as file:
        file.write(text.encode(errors="replace"))  # a name of a file may have bytes that are no text
    return Written(Path(path), plain(findings.verdict(found)), tuple(_doubts(found)), as_dict(found))


def _named(recordings: Sequence[_PathLike], table: Path | None) -> dict[str, Path]:
    """Return the recordings by the names that the report has for them; the table of moduli is none of them."""
    paths = [Path(each) for each in recordings if not (table and Path(each).resolve() == table.resolve())]
    if not paths:
        raise ValueError("recordings: got none, allowed: one or more")
    alone = len({path.name for path in paths}) == len(paths)
    named = {path.name if alone else path.as_posix(): path for path in paths}
    if len({path.resolve() for path in paths}) < len(paths):
        raise ValueError("recordings: got one twice, allowed: each once")
    return named


def _page(found: Session, probe: Path | None, table: Path | None, given: Sequence[tuple[str, str]]) -> str:
    files = [("calibration", probe), ("moduli", table)]
    title, operator = dict(given).get("title") or _default_title(found), dict(given).get("operator") or _operator(found)
    sums = {name: value for each in found.runs for name, value in each.sums.items()}
    sums |= {file.name: checksum(file) for file in (probe, table) if file}
    first = found.runs[0]
    simulated = records.simulated(found)
    return page.document(
        title,
        element("h1", title),
        element("p", simulated, class_="box") if simulated else Markup(""),
        *(element("p", f"Results may be wrong: {doubt}", class_="box bad") for doubt in _doubts(found)),
        findings.verdict(found),
        records.head(found, operator, [text for name, text in given if name == "note"], probe),
        findings.results(found),
        findings.repeatability(found),
        findings.uncertainty(found),
        findings.calibration(found),
        records.touches(found),
        records.recordings(found),
        records.settings(found),
        records.again(found, sums, [*((name, file.name) for name, file in files if file), *given]),
        element("div", element("span", "measured by, date"), element("span", "checked by, date"), class_="sign"),
        footer=f"palpate {__version__} · {title} · {first.name} · sha256 {first.sums[first.name][:8]}…",
    )


def _doubts(found: Session) -> list[str]:
    """Return why the report is not to be relied on."""
    doubts = [f"{each.name}: {doubt}" for each in found.runs for doubt in each.doubts]
    if found.calibration and not found.calibration.sound:
        doubts.append(f"calibration: {found.calibration.verdict}")
    if found.calibration and (made_of := found.calibration.about.get("doubts")):
        doubts.append(f"the calibration was made from recordings that were not as written: {made_of}")
    scenes = {each.tracking["scene"] for each in found.runs}
    made_by = found.calibration.about.get("scene") if found.calibration else None
    if made_by and scenes != {made_by}:
        doubts.append(f"the calibration was made with scene {made_by}, the touches with {', '.join(sorted(scenes))}")
    return doubts if found.touches else [*doubts, "no touch was found"]


def _default_title(found: Session) -> str:
    titles = dict.fromkeys(each.plan.title for each in found.runs if each.plan.title)
    several = f"{len(found.runs)} recordings" if len(found.runs) > 1 else found.runs[0].name
    return ", ".join(titles) or f"Report of {several}"


def _operator(found: Session) -> str:
    return ", ".join(dict.fromkeys(each.plan.operator for each in found.runs if each.plan.operator))
