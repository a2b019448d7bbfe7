"""Speed and error: calls, blocks, streams and the ring, in comparison with other libraries.

    python -m bench.speed [--rounds 100]      measure, print, write results/speed.json and the table of docs/numbers.md
    python -m bench.speed --table             print that table from the file

All items are timed alternately in one run; the quotients are the result. Needs a C++ compiler (CXX; default c++); uses scipy,
padasip, river, filterpy and simdkalman if they are installed.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from bench.results_age import RESULTS, ROOT, about
from bench.speed.calls import measure_native, measure_python

PAGE = ROOT / "docs" / "numbers.md"
MARK = "<!-- python -m bench.speed --table -->"
END = "<!-- end -->"
Figures = dict[str, Any]

LIMITS: list[tuple[str, str, float]] = [
    ("HandoverRls", "Handover, of the scenes", 3.5),
    ("Handover, of the scenes", "AdaptiveRls", 4.5),
    ("handheld without fit", "the paper's form literally", 4.0),
    ("Python Tracker.process, 2000", "the paper's form literally", 6.0),
    ("AdaptiveRls", "the paper's form literally", 0.33),
    ("AdaptiveRls, alarm flickering", "AdaptiveRls", 1.15),
    ("AdaptiveRls, idle", "AdaptiveRls", 1.1),
    ("AdaptiveRls", "Rls", 1.15),
    ("Python trace, 2000", "Python process, 2000", 1.3),
    ("Python process, 2000", "AdaptiveRls", 1.05),
    ("Python process, 250", "AdaptiveRls, 250 samples", 1.2),
    ("Python update", "math.hypot", 0.65),
    ("VectorRls, slope and intercept", "AdaptiveRls", 8.0),
    ("Python VectorRls update, a tuple", "Python update", 2.5),
    ("Python VectorRls update, an array", "Python update", 3.0),
    ("Python Bank of 64 AdaptiveRls", "AdaptiveRls", 1.5),
    ("Python Bank of 64 HandoverRls", "HandoverRls", 1.5),
    ("Python ring, 250", "Python deque, 250", 0.02),
    ("Python update", "padasip", 0.01),
    ("Python update", "river", 0.01),
    ("Python update", "filterpy", 0.01),
    ("Python Rls process, 2000", "scipy", 1.0),
    ("Python Bank of 64 AdaptiveRls", "simdkalman, 64 streams", 0.02),
]
"""Two figures, and the wanted upper limit of their quotient."""

SHORT = {
    "AdaptiveRls": "`AdaptiveRls`, block",
    "HandoverRls": "`HandoverRls`, block",
    "VectorRls, slope and intercept": "`VectorRls`, slope and intercept, C++",
    "the paper's form literally": "the paper's equations as printed, block, C++",
    "Python Bank of 64 AdaptiveRls": "`Bank` of 64 `AdaptiveRls`, from Python, a stream's sample",
    "Python update": "`AdaptiveRls.update`, from Python",
    "numpy loop": "the same step in plain Python and numpy",
    "scipy": "scipy `lfilter` twice, block, fixed forgetting",
    "padasip": "padasip `FilterRLS`",
    "filterpy": "filterpy `FadingKalmanFilter`",
    "river": "river `BayesianLinearRegression`",
    "simdkalman, 64 streams": "simdkalman, 64 streams, a stream's sample",
}


def table(figures: Figures) -> str:
    """Print each figure, ns, with the error of the result."""
    lines = [f"{'ns a sample, a call or an item':58} {'min':>9} {'median':>9}  error"]
    for name, row in figures.items():
        if isinstance(row, dict):
            lines.append(
                f"{name:58} {row['min']:9.2f} {row['median']:9.2f}  {error_text(row)}".rstrip()
            )
    return "\n".join(lines)


def error_text(row: dict[str, float]) -> str:
    """Return the error of a row as text; empty if it has none."""
    return f"{row['error']:.1e}" if "error" in row else ""


def limits(figures: Figures) -> str:
    """Print the quotients of minima and of medians, and the wanted limits."""
    lines = [f"{'quotient':90} {'minima':>8} {'medians':>8} {'at most':>8}"]
    for one, other, limit in LIMITS:
        title = f"{one} / {other}"
        if one in figures and other in figures:
            low, middle = (figures[one][key] / figures[other][key] for key in ("min", "median"))
            lines.append(
                f"{title:90} {low:8.3f} {middle:8.3f} {limit:8.2f}  {'ok' if low <= limit else 'above'}"
            )
        else:
            lines.append(f"{title:90} {'not measured':>17} {limit:8.2f}")
    return "\n".join(lines)


def short_table(figures: Figures) -> str:
    """Return the table of docs/numbers.md."""
    lines = ["| | ns a sample | error of the ratio, rms |", "|---|---|---|"]
    for name, text in SHORT.items():
        if name in figures:
            lines.append(f"| {text} | {figures[name]['min']:.3g} | {error_text(figures[name])} |")
    return "\n".join(lines)


def replace_table(text: str, mark: str, made: str) -> str:
    """Replace the table between a mark and the next end in a page."""
    before, _, rest = text.partition(mark)
    return f"{before}{mark}\n{made}\n{END}{rest.partition(END)[2]}"


def summary(figures: Figures) -> str:
    """Return the figures of the table and of the limits as JSON, one a line."""
    wanted = {*SHORT, *(name for one, other, _ in LIMITS for name in (one, other))}
    rows = {
        name: value
        for name, value in figures.items()
        if not isinstance(value, dict) or name in wanted
    }
    return (
        "{\n"
        + ",\n".join(f"{json.dumps(name)}: {json.dumps(value)}" for name, value in rows.items())
        + "\n}\n"
    )


def main() -> None:
    """Measure, print and write; or print the table of the last measurement."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rounds", type=int, default=100, help="repeats of everything")
    parser.add_argument(
        "--out", type=Path, default=RESULTS / "speed.json", help="where the figures go"
    )
    parser.add_argument(
        "--table", action="store_true", help="print the table of docs/numbers.md from the file"
    )
    options = parser.parse_args()
    if options.table:
        print(short_table(json.loads(options.out.read_text())))
        return
    measured = measure_native(options.rounds) | measure_python(options.rounds)
    figures = {**about(), **measured}
    print(table(figures), limits(figures), sep="\n\n")
    options.out.write_text(summary(figures))
    if options.out == RESULTS / "speed.json":
        PAGE.write_text(replace_table(PAGE.read_text(), MARK, short_table(figures)))


if __name__ == "__main__":
    main()
