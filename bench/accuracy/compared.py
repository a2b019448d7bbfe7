"""The steady error of the scene handheld beside its rivals, on every scenario.

    python -m bench.accuracy.compared [--seeds 20] [SCENARIO ...]

Prints a table, and where another row is the best one, by how much. It is a part of bench.accuracy.error_vs_time.
"""

import argparse
from collections.abc import Iterable

from palpate import benchmark

from bench.accuracy.must_hold import front, text
from bench.rivals import OFFLINE, RIVALS, rival_rows

COLUMNS = ("paper scene", *RIVALS, front.OWN[0])
KEY = """\
median steady rms error, %; * the least of the row among the live estimators
  best        of all live estimators, those on readings that are not aligned, too
  +A          on pairs aligned as in the scene handheld; begins at the true contact, baseline the mean before it
  Kalman walk a random walk, its variance tuned on other seeds by bench.accuracy.tune_walk
  sum / sum   sum of the outputs / sum of the regressors since contact
  rms         the same quotient for the rms over all seeds, in which a lost press counts as an error of 100 %
  libraries   padasip, river and filterpy are fixed 0.995, with another arithmetic
  offline     a spline and least squares over the whole press, with the baseline after it: one ratio for the touch"""


def table(rows: Iterable[benchmark.Row]) -> str:
    """Return the errors of the scenes and rivals as text, one line for each scenario."""
    by = {(row.scenario, row.estimator): row for row in rows}
    heads = "".join(f"{name.removesuffix(' scene'):>15}" for name in COLUMNS)
    lines = [KEY, f"{'':15}{heads}{'handheld / best':>17}{'rms':>8}  {'best':15}{'offline':>10}"]
    for name in dict.fromkeys(scenario for scenario, _ in by):
        here = {estimator: row for (scenario, estimator), row in by.items() if scenario == name}
        found = front.compare(list(here.values()))
        least = min(found.hand, found.best, key=lambda row: row.rmse)
        cells = "".join(f"{100 * here[c].rmse:14.4f}{'*' if here[c] is least else ' '}" for c in COLUMNS)
        lines.append(
            f"{name:15}{cells}{found.times:17.2f}{found.rms_times:8.2f}  {least.estimator:15}"
            f"{100 * here[OFFLINE].rmse:10.4f}"
        )
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("scenarios", nargs="*", choices=[[], *benchmark.SINGLE], help="default: all")
    parser.add_argument("--seeds", type=int, default=20, help="recordings of each scenario")
    options = parser.parse_args()
    rows: list[benchmark.Row] = []
    for name in options.scenarios or benchmark.SINGLE:
        rows += benchmark.on_scenario(name, options.seeds, {}) + rival_rows(name, options.seeds)
    print(table(rows), text(front.of_table(rows)), sep="\n\n")


if __name__ == "__main__":
    main()
