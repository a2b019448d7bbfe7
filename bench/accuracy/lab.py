"""Required results of the scene handheld in a lab.

    python -m bench.accuracy.lab [--seeds 20] [--rows PATTERN] [--store]

Bad readings, rails, jumps, steps, slow noise, slow converters, and healthy presses. Each row has
the rms error of its touches with the median half-width of their 95 % intervals, and shares:

    covered   touches whose interval holds the true ratio
    silent    touches that are wrong by more than 5 % or by more than 4 standard errors, and neither
              a flag that excludes them nor a judgement says so; touches without a press count, too
    flagged   presses with such a flag or judgement
    named     presses with a flag or a judgement of the right name
    said      sessions with a judgement of the right name and channel
    lost      presses without a touch
    noted     presses with any flag but "short" and "late", or with a judgement
    called    presses with a flag or a judgement of a fault of the lab

A row `holds`, FAILS, or is `known` not to hold, with the reason below it. Exit code 1: one FAILS.
`--store` keeps the figures: later runs print them in brackets, and healthy presses are compared
with them.
"""

import argparse
import json
import math
import os
import re
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.accuracy.lab_rows import HAND, KNOWN, THEMES, Row
from bench.accuracy.lab_scores import Measure, Summary, median, percent, played, summary_of, taken
from bench.accuracy.lab_worlds import Session, make
from bench.results_age import RESULTS, about

STORE = RESULTS / "lab.json"
SHOWN = (
    Measure.COVERED,
    Measure.SILENT,
    Measure.FLAGGED,
    Measure.NAMED,
    Measure.SAID,
    Measure.LOST,
)
PRICE = 1.3  # limit: times handheld / paper, as a multiple of the stored one
ROUNDS = 15

Figures = list[tuple[float, float]]


@dataclass(frozen=True)
class Stored:
    """What a row had when it was stored.

    Attributes
    ----------
    text : str
    worlds : list
        (rms error, half-width) of each session, by world; empty if the row is not compared.
    """

    text: str
    worlds: list[Figures]


@dataclass(frozen=True)
class Result:
    """A row, measured.

    Attributes
    ----------
    row : Row
    summary : Summary
    worlds : list
        (rms error, half-width) of each session, by world.
    before : Stored or None
    """

    row: Row
    summary: Summary
    worlds: list[Figures]
    before: Stored | None = None

    @property
    def text(self) -> str:
        """What is measured, in one line."""
        half_width = 100 * self.summary.half_width
        parts = [f"error {percent(self.summary.error)}, +- {half_width:.2g}"]
        more = [limit.measure for limit in self.row.limits if limit.measure not in SHOWN]
        for measure in (*SHOWN, *more):
            parts.append(f"{measure} {100 * self.summary.shares[measure].value:.3g}")
        return ", ".join(parts)

    @property
    def growth(self) -> tuple[float, float]:
        """Error and half-width over those stored of the same sessions; 1 if none are."""
        if self.before is None:
            return 1.0, 1.0
        if len(self.worlds) != len(self.before.worlds):
            raise ValueError(f"{STORE.name} has other worlds of {self.row.title!r}: store again")
        return growth_of(self.worlds, self.before.worlds)

    @property
    def broken(self) -> list[str]:
        """The limits that do not hold."""
        row = self.row
        texts = [str(limit) for limit in row.limits if not limit.holds(self.summary)]
        if row.lost_in_a_session is not None and self.summary.worst_lost > row.lost_in_a_session:
            texts.append(f"lost in a session: {self.summary.worst_lost}")
        if row.compared is not None:
            error, width = self.growth
            if not error <= row.compared.error:
                texts.append(f"error {error:.3g} of before")
            if not width <= row.compared.half_width:
                texts.append(f"width {width:.3g} of before")
        return texts

    @property
    def verdict(self) -> str:
        """Whether it "holds", is "known" not to, with a reason, or "FAILS"."""
        return verdict_of(self.row.title, holds=not self.broken)

    def __str__(self) -> str:
        """Return the row as text, with the stored figures in brackets, and the limits."""
        text = f"{self.verdict:5} {self.row.title:54} n {self.summary.presses:4}, {self.text:82} "
        if self.before is not None:
            text += f"({self.before.text}) "
        if self.row.compared is not None:
            text += "error {:.3f}, width {:.3f} of before ".format(*self.growth)
        text += f"limits: {self.row.limit_text}"
        if self.broken:
            text += f"; broken: {', '.join(self.broken)}"
        if self.verdict == "known":
            text += f"\n      {KNOWN[self.row.title]}"
        return text


def verdict_of(title: str, *, holds: bool) -> str:
    """Return "holds", "known" or "FAILS"."""
    if holds:
        return "holds"
    return "known" if title in KNOWN else "FAILS"


def growth_of(now: list[Figures], before: list[Figures]) -> tuple[float, float]:
    """Return error and half-width of sessions over those of the same sessions before.

    Error: the ratio of the rms errors in each world; the root mean square of these. Half-width: the
    ratio in each session; the median of these.
    """
    squares = []
    widths = []
    for new, old in zip(now, before, strict=True):
        pairs = [
            (*a, *b)
            for a, b in zip(new, old, strict=False)
            if math.isfinite(a[0] + a[1] + b[0] + b[1])
        ]
        if not pairs:
            continue
        new_error, new_width, old_error, old_width = np.transpose(pairs)
        squares.append(float(np.sum(new_error**2) / np.sum(old_error**2)))
        widths += list(new_width / old_width)
    if not squares:
        return 1.0, 1.0
    return math.sqrt(sum(squares) / len(squares)), median(widths)


def measured(row: Row, seeds: int, before: Stored | None = None) -> Result:
    """Measure a row."""
    sessions = [[played(world, seed) for seed in range(seeds)] for world in row.worlds]
    of_all = [session for of_world in sessions for session in of_world]
    summary = summary_of(of_all, row.names, row.only)
    by_session = iter(summary.by_session)
    worlds = [[next(by_session) for _ in of_world] for of_world in sessions]
    return Result(row, summary, worlds, before)


def rows_of(theme: str, pattern: str) -> list[Row]:
    """Return the rows of a theme whose title has the pattern."""
    return [row for row in THEMES[theme]() if re.search(pattern, row.title, re.IGNORECASE)]


def results_of(theme: str, pattern: str, seeds: int, stored: dict[str, Stored]) -> list[Result]:
    """Measure the rows of a theme."""
    return [measured(row, seeds, stored.get(row.title)) for row in rows_of(theme, pattern)]


@dataclass(frozen=True)
class Price:
    """Times of `Tracker.take`, ns a pair: minimum and median of both scenes, in turn."""

    paper: tuple[float, float]
    handheld: tuple[float, float]
    before: float | None = None

    @property
    def ratio(self) -> float:
        """How many times as long as paper handheld takes, by the minima."""
        return self.handheld[0] / self.paper[0]

    @property
    def verdict(self) -> str:
        """Whether it "holds" or "FAILS"."""
        return verdict_of("price", holds=self.before is None or self.ratio <= PRICE * self.before)

    def __str__(self) -> str:
        """Return the times as text."""
        before = "" if self.before is None else f" ({self.before:.2f} before)"
        return (
            f"{self.verdict:5} price: Tracker.take, ns a pair, minimum and median: "
            f"paper {self.paper[0]:.1f}, {self.paper[1]:.1f}; "
            f"handheld {self.handheld[0]:.1f}, {self.handheld[1]:.1f}; "
            f"ratio of minima {self.ratio:.2f}{before}, limit: {PRICE:g} of before"
        )


def time_of(session: Session, scene: str) -> float:
    """Return the time that a tracker of a scene takes, ns a pair."""
    start = time.perf_counter_ns()
    taken(session, scene)
    return (time.perf_counter_ns() - start) / len(session.times_s[0])


def price(before: float | None) -> Price:
    """Time both scenes in turn on 200 s of presses."""
    session = make(replace(HAND, presses=30), 0)
    times = np.array(
        [[time_of(session, scene) for scene in ("paper", "handheld")] for _ in range(ROUNDS)]
    )
    minima = times.min(axis=0)
    medians = np.median(times, axis=0)
    paper, handheld = zip(minima.tolist(), medians.tolist(), strict=True)
    return Price(paper, handheld, before)


def load(path: Path = STORE) -> tuple[dict[str, Stored], float | None]:
    """Return the stored rows and the stored price; empty if there is no file."""
    if not path.exists():
        return {}, None
    document = json.loads(path.read_text(encoding="utf-8"))
    rows = {title: Stored(one["text"], one["worlds"]) for title, one in document["rows"].items()}
    return rows, document["price"]


def store(results: Sequence[Result], cost: Price, seeds: int, path: Path = STORE) -> None:
    """Write the figures; `kept`: they stay when the headers change."""
    rows: dict[str, dict[str, object]] = {}
    for result in results:
        worlds: list[list[list[float]]] = []
        if result.row.compared is not None:
            worlds = [
                [[float(f"{x:.4g}") for x in one] for one in world] for world in result.worlds
            ]
        rows[result.row.title] = {"text": result.text, "worlds": worlds}
    document = about() | {"kept": True, "seeds": seeds, "price": round(cost.ratio, 3), "rows": rows}
    path.write_text(json.dumps(document) + "\n", encoding="utf-8")


def any_fails(results: Sequence[Result | Price]) -> bool:
    """Return whether a row fails."""
    return any(result.verdict == "FAILS" for result in results)


def pattern_of(text: str) -> str:
    """Return a regular expression, or the error that names its fault."""
    try:
        re.compile(text)
    except re.error as error:
        raise argparse.ArgumentTypeError(f"{text!r} is no regular expression: {error}") from error
    return text


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="sessions of each world")
    parser.add_argument(
        "--rows",
        type=pattern_of,
        default="",
        metavar="PATTERN",
        help="regular expression: only rows with it in their title",
    )
    parser.add_argument(
        "--store", action="store_true", help=f"keep the figures in {STORE.name}; all rows"
    )
    options = parser.parse_args()
    if options.seeds < 1:
        parser.error(f"--seeds is {options.seeds}; give 1 or more")
    if options.store and options.rows:
        parser.error("--store keeps all rows; leave --rows out")
    chosen = [theme for theme in THEMES if rows_of(theme, options.rows)]
    is_priced = re.search(options.rows, "price") is not None
    if not chosen and not is_priced:
        parser.error(f"no row has {options.rows!r} in its title")
    stored, price_before = load()
    results: list[Result] = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        count = len(chosen)
        for some in pool.map(
            results_of, chosen, [options.rows] * count, [options.seeds] * count, [stored] * count
        ):
            print(*some, sep="\n", flush=True)
            results += some
    failed = any_fails(results)
    if is_priced:
        cost = price(price_before)
        print(cost)
        failed |= any_fails([cost])
        if options.store:
            store(results, cost, options.seeds)
    sys.exit(failed)


if __name__ == "__main__":
    main()
