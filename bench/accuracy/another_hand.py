"""Modulus where another hand measures than calibrated, in whole sessions.

    python -m bench.accuracy.another_hand [--sessions 50] [--rows PATTERN] [--out bench/results]

A session: four touches on each of ten specimens calibrate, then five objects are touched four
times, on a simulator that shares nothing with palpate: bench/accuracy/other_probe.py. A hand is off
by 0.5 degrees rms from touch to touch and trembles by 0.03; a stage is level. The bumps are domes
(force ~ depth^1.5), the soft one creeps by 3 % within 2 s and by 3 % within 20 s, the gauges are
bent by 0.5 %/pF. Each row has, in %,

    rms        error of log E
    +-         median half-width of the 95 % intervals of log E; inf: a bound
    holds      intervals that contain the true modulus
    of four    the same three of the mean of four touches
    without    touches without a modulus
    stiffens   touches with this flag
    differs    touches of which a sentence says how they differ from those that calibrated
    reliable   calibrations without an objection
    disagrees  objects that `verify` finds to disagree with their modulus

"-": palpate has no such result. A row `holds` or FAILS; the bounds that do not hold are below it.
Exit code 1: one FAILS. Objects that stiffen have the modulus of small depths.
"""

import argparse
import json
import re
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from itertools import groupby, repeat
from math import isnan
from pathlib import Path

from palpate import Calibration, Touch, number_format
from palpate.errors import CalibrationError

from bench.accuracy.another_hand_rows import NO_BOUNDS, ROWS, Row
from bench.accuracy.another_hand_scores import Estimate, Figures, Score, Share, percent
from bench.accuracy.lab import pattern_of
from bench.accuracy.other_sessions import OBJECTS, TOUCHES, Calibrating, Touched, objects, specimens
from bench.accuracy.session_calibration import (
    Calibrated,
    Stated,
    agrees,
    calibrated,
    learned,
    mean_modulus,
    modulus_of,
    remarks_on,
)
from bench.results_age import about

PROCESSES = 2
FILE = "another_hand.json"


@dataclass(frozen=True)
class Result:
    """A row, measured."""

    row: Row
    figures: Figures

    @property
    def broken(self) -> list[str]:
        """The bounds that do not hold."""
        return self.row.bounds.broken(self.figures)

    @property
    def verdict(self) -> str:
        """Whether it "holds" or "FAILS"; "": it has no bounds."""
        if self.row.bounds == NO_BOUNDS:
            return ""
        return "FAILS" if self.broken else "holds"

    def __str__(self) -> str:
        """Return the row as text; the bounds that do not hold are below it."""
        figures = self.figures
        numbers = [
            figures.rms,
            figures.half_width,
            figures.coverage,
            figures.mean_rms,
            figures.mean_half_width,
            figures.mean_coverage,
            *figures.shares.values(),
        ]
        cells = "".join(f"{percent(number):>10}" for number in numbers)
        text = f"{self.verdict:5} {self.row.title:42}{cells}"
        if self.broken:
            text += f"\n      {'; '.join(self.broken)}"
        return text


def header() -> str:
    """Return the names of the columns."""
    names = ["rms", "+-", "holds", "of four", "+-", "holds", *Share]
    return f"{'':48}" + "".join(f"{name:>10}" for name in names)


def score(row: Row, found: Calibrated | None, seed: int) -> Score:
    """Measure the objects of a session; `found`: None if there is no calibration."""
    result = Score()
    reliable = found is not None and found.calibration.sound
    result.tallies[Share.RELIABLE].add(reliable)
    if found is None:
        for _ in range(OBJECTS * TOUCHES):
            result.tallies[Share.WITHOUT].add(True)
        return result
    made = objects(row.measuring, seed)
    groups = [found.touches(one) for one in made]
    calibration = found.calibration
    if row.stated.learns:
        calibration = learned(calibration, groups)
    for one, touches in zip(made, groups, strict=True):
        _add(result, calibration, one, touches)
    return result


def _add(result: Score, calibration: Calibration, one: Touched, touches: list[Touch]) -> None:
    """Add the touches on one object."""
    for touch in touches:
        modulus = modulus_of(calibration, touch)
        has_value = modulus is not None and not isnan(modulus.value)
        remarks = remarks_on(calibration, touch)
        result.tallies[Share.WITHOUT].add(not has_value)
        result.tallies[Share.STIFFENS].add(remarks.stiffens)
        result.tallies[Share.DIFFERS].add(remarks.differs)
        if modulus is not None:
            result.touches.append(Estimate.of(modulus, one.modulus_MPa))
    mean = mean_modulus(calibration, touches)
    if mean is not None:
        result.means.append(Estimate.of(mean, one.modulus_MPa))
    agreeing = agrees(calibration, touches, one.modulus_MPa)
    if agreeing is not None:
        result.tallies[Share.DISAGREES].add(not agreeing)


def scores(rows: Sequence[Row], seed: int) -> list[Score]:
    """Measure a session of rows that calibrate alike."""
    first = rows[0]
    touched = specimens(first.calibrating, seed)
    try:
        found = calibrated(touched, first.stated)
    except CalibrationError:
        found = None
    return [score(row, found, seed) for row in rows]


def figures_of(row: Row, sessions: int) -> Figures:
    """Measure one row in this process."""
    total = Score()
    for seed in range(sessions):
        [one] = scores([row], seed)
        total.add(one)
    return Figures.of(total)


def _calibration_of(row: Row) -> tuple[Calibrating, Stated]:
    """Return everything on which the calibration of a row depends."""
    return row.calibrating, replace(row.stated, learns=False)


def results(rows: Sequence[Row], sessions: int) -> Iterator[Result]:
    """Measure rows; neighbours that calibrate alike share their calibrations."""
    with ProcessPoolExecutor(PROCESSES) as pool:
        for _, group in groupby(rows, key=_calibration_of):
            alike = list(group)
            totals = [Score() for _ in alike]
            for of_session in pool.map(scores, repeat(alike, sessions), range(sessions)):
                for total, one in zip(totals, of_session, strict=True):
                    total.add(one)
            for row, total in zip(alike, totals, strict=True):
                yield Result(row, Figures.of(total))


def _plain(figures: Figures) -> dict[str, object]:
    """Return the numbers for JSON, with two decimals; None: unknown or not finite."""
    values = asdict(figures)
    shares = values.pop("shares")
    return number_format.plain(_rounded(values)) | {"shares": number_format.plain(_rounded(shares))}


def _rounded(values: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 2) for name, value in values.items()}


def write(found: Sequence[Result], sessions: int, folder: Path) -> None:
    """Write the results to another_hand.json."""
    rows = {}
    for one in found:
        rows[one.row.title] = {"verdict": one.verdict, **_plain(one.figures)}
    document = about() | {"sessions": sessions, "rows": rows}
    (folder / FILE).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--sessions", type=int, default=50, help="sessions of each row")
    parser.add_argument(
        "--rows",
        type=pattern_of,
        default="",
        metavar="PATTERN",
        help="regular expression: only rows with it in their title",
    )
    parser.add_argument("--out", type=Path, metavar="FOLDER", help=f"write {FILE} to this folder")
    options = parser.parse_args()
    if options.sessions < 1:
        parser.error(f"--sessions is {options.sessions}; give 1 or more")
    rows = [row for row in ROWS if re.search(options.rows, row.title, re.IGNORECASE)]
    if not rows:
        parser.error(f"no row has {options.rows!r} in its title")
    print(header())
    found = []
    for one in results(rows, options.sessions):
        print(one, flush=True)
        found.append(one)
    if options.out:
        write(found, options.sessions, options.out)
    sys.exit(any(one.broken for one in found))


if __name__ == "__main__":
    main()
